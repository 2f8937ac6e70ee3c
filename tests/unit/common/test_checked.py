"""Calls that check their arguments against the annotations of their parameters."""

from __future__ import annotations

import enum
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common._checked import checked
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.tree import Joint


class Colour(enum.Enum):
    RED = 1


class Car:
    @checked
    def paint(self, colour: Colour, name: str = "") -> tuple:
        """Paints."""
        return colour, name

    @checked
    def drive(self, x: ArrayLike, watch: Callable[..., Any], limit: float | None = None) -> int:
        return len(np.atleast_1d(x))

    @staticmethod
    @checked
    def wheels(number: int, spare: bool = False) -> int:
        return number + spare

    @checked
    def meet(self, *others: Car, how: str = "gently") -> int:
        return len(others)

    @checked
    def anything(self, value: Any, other, trailer: Trailer | None = None) -> None:
        pass


class Trailer:
    pass


def test_what_fits_is_passed_on():
    car = Car()
    assert car.paint(Colour.RED, name="x") == (Colour.RED, "x")
    assert car.drive([1.0, 2.0], print) == 2 and car.drive(3.0, watch=print, limit=None) == 1
    assert car.wheels(np.int64(4), spare=np.bool_(True)) == 5 == Car.wheels(5)
    assert car.meet() == 0 and car.meet(car, car) == 2
    car.anything(None, None, Trailer())
    car.anything(None, other=None, trailer=None)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda car: car.paint(None), "colour must be Colour, not None"),
        (lambda car: car.paint(1), "colour must be Colour, not int"),
        (lambda car: car.paint(Colour.RED, name=None), "name must be str, not None"),
        (lambda car: car.drive(None, print), "x must be ArrayLike, not None"),
        (lambda car: car.drive(1.0, None), "watch must be .*, not None"),
        (lambda car: car.drive(1.0, print, "far"), r"limit must be float \| None, not str"),
        (lambda car: car.wheels(4.0), "number must be int, not float"),
        (lambda car: car.wheels(4, spare=[]), "spare must be bool, not list"),
        (lambda car: car.meet(car, None), "others must be Car, not"),
        (lambda car: car.meet(how=1), "how must be str, not int"),
        (lambda car: car.anything(1, 2, 3), r"trailer must be Trailer \| None, not int"),
    ],
)
def test_what_does_not_is_named(call, says):
    with pytest.raises(TypeError, match=f"Car.*incompatible function arguments.*{says}"):
        call(Car())


def test_classes_that_are_named_for_type_checkers_alone_are_known():
    @checked
    def at(joint: Joint, note: Unheard | None = None) -> str:  # type: ignore[name-defined]  # noqa: F821
        return joint

    plant = MultibodyPlant(0.0)
    joint = RevoluteJoint("j", plant.world_frame(), plant.AddRigidBody("b").body_frame(), [0, 0, 1])
    assert at(joint, 3) is joint and at(joint, None) is joint
    with pytest.raises(TypeError, match="joint must be Joint, not MultibodyPlant"):
        at(plant)


@checked
def lit(flag: bool) -> str:
    return "on" if flag else "off"


@pytest.mark.parametrize("flag", [True, np.bool_(True), 1, 0.5, 1j, np.array(1), np.array([2.0])])
def test_flags_are_what_has_a_truth(flag):
    assert lit(flag) == "on" and lit(0 * flag) == lit(None) == "off"


@pytest.mark.parametrize("wrong", ["", {}, np.array([1, 2]), AutoDiffXd(1.0), print])
def test_what_has_none_is_no_flag(wrong):
    with pytest.raises(TypeError, match="flag must be bool"):
        lit(wrong)


def test_a_truth_of_numpy_is_a_whole_number():
    assert Car.wheels(np.bool_(True)) == 1


def test_what_python_finds_wrong_it_says_itself():
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'colour'"):
        Car().paint()
    with pytest.raises(TypeError, match="unexpected keyword argument 'color'"):
        Car().paint(color=Colour.RED)


def test_keeps_name_and_documentation():
    assert Car.paint.__doc__ == "Paints." and Car.paint.__qualname__ == "Car.paint"


class Speed:
    @checked
    def set(self, value: float, limit: float | None = None) -> tuple:
        return value, limit


class _Fast(Speed):
    pass


class Fast(_Fast):
    @checked
    def set(self, value: float, limit: float | None = None, *, more: int = 0) -> tuple:
        return super().set(value, limit)


class Faster(Fast):
    pass


def test_errors_name_the_class_that_people_use():
    with pytest.raises(TypeError, match=r"^Faster\.set\(\): .*value must be float, not None"):
        Faster().set(None)
    with pytest.raises(TypeError, match=r"^RevoluteJoint\.__init__\(\): .*name must be str, not None"):
        RevoluteJoint(None, None, None, [0, 0, 1])
    plant = MultibodyPlant(0.0)
    joint = plant.AddJoint(RevoluteJoint("j", plant.world_frame(), plant.AddRigidBody("b").body_frame(), [0, 0, 1]))
    with pytest.raises(TypeError, match=r"^RevoluteJoint\.set_default_damping\(\): .*damping must be float, not str"):
        joint.set_default_damping("x")
    with pytest.raises(TypeError, match=r"^MultibodyPlant\.AddRigidBody\(\): .*name must be str, not None"):
        plant.AddRigidBody(None)


@checked
class Pair:
    def __init__(self, first: Speed, second: Speed | None = None) -> None:
        self.both = first, second

    def swap(self, first: Speed) -> tuple:
        return first, self.both

    @classmethod
    def make(cls, first: Speed) -> Pair:
        return cls(first)

    @staticmethod
    def one(first: Speed) -> Speed:
        return first

    def _own(self, first: Speed) -> Speed:
        return first


def test_a_class_is_checked_by_its_constructor_and_public_methods():
    speed = Speed()
    pair = Pair(speed, second=None)
    assert pair.swap(speed) == (speed, (speed, None)) and Pair.make(speed).both == (speed, None)
    assert Pair.one(speed) is speed and pair._own(3) == 3
    for call in (Pair, pair.swap, Pair.make, Pair.one):
        with pytest.raises(TypeError, match="first must be Speed, not int"):
            call(3)


@pytest.mark.parametrize("value", [1, True, np.float32(1), np.int64(1), np.float64(1), np.array(1.0), np.array(1)])
def test_numbers_arrive_as_floats(value):
    speed = Speed()
    for given in ((value,), (value, value), (1.0, value), (value, None)):
        for _ in range(2):  # the second time, the types are known
            got = speed.set(*given)
            assert [type(x) for x in got if x is not None] == [float] * (2 - got.count(None))
            assert all(x in (1.0, None) for x in got)
    assert type(speed.set(value=value, limit=value)[1]) is float


@pytest.mark.parametrize("value", [[1.0], (1.0,), np.array([1.0]), 1j, "1", b"1", None, {}])
def test_what_is_no_number_is_refused_even_where_its_type_may_be_one(value):
    speed = Speed()
    speed.set(np.array(1.0))
    with pytest.raises(TypeError, match=r"Speed\.set\(\).*value must be float"):
        speed.set(value)
    with pytest.raises(TypeError, match=r"Speed\.set\(\).*value must be float"):
        speed.set(value=value)


def test_other_scalars_pass_as_they_are():
    from sheldrake.autodiffutils import AutoDiffXd

    dual = AutoDiffXd(1.0, [1.0])
    assert Speed().set(dual, dual) == (dual, dual)


def test_arguments_that_passed_once_let_no_others_pass():
    """By position, by name or left out: each way is looked at by itself, also after others of its types have passed."""
    car = Car()
    for _ in range(2):
        assert car.paint(Colour.RED) == (Colour.RED, "") == car.paint(colour=Colour.RED)
        assert car.paint(Colour.RED, "x") == (Colour.RED, "x") == car.paint(name="x", colour=Colour.RED)
        for wrong in ((Colour.RED, None), ("x", Colour.RED), (None,)):
            with pytest.raises(TypeError, match=r"Car\.paint.*incompatible"):
                car.paint(*wrong)
        with pytest.raises(TypeError, match="colour must be Colour, not str"):
            car.paint(name=Colour.RED, colour="x")
        with pytest.raises(TypeError, match="takes from 2 to 3 positional arguments but 4 were given"):
            car.paint(Colour.RED, "x", "y")
        with pytest.raises(TypeError, match="multiple values for argument 'colour'"):
            car.paint(Colour.RED, colour=Colour.RED)


def test_the_library_is_between_a_call_and_its_caller():
    """As warnings that blame the nearest caller outside of the library count on."""
    frames = []

    @checked
    def look(depth: int) -> None:
        frame = sys._getframe(1)
        while frame.f_globals["__name__"] != __name__:
            frames.append(frame.f_globals["__name__"])
            frame = frame.f_back

    for _ in range(2):
        look(1)
    assert frames and set(frames) == {"sheldrake.common._checked"}
