"""Arguments that are checked once a call has failed."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sheldrake.common._checked import checked
from sheldrake.geometry.optimization import AffineSubspace
from sheldrake.symbolic import Expression, Variable
from sheldrake.systems.framework import LeafSystem

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Thing:
    size = 2


@checked
def half(thing: Thing, by: int = 2, note: str | None = None) -> int:
    if by == 0:
        raise RuntimeError("half(): by is zero.")
    return thing.size // by


@checked
def ends(values: ArrayLike, call: Any = None) -> Any:
    if call is not None:
        call(values)
    return float(values)  # type: ignore[arg-type]


@checked
class Pair:
    def __init__(self, thing: Thing) -> None:
        self.twice = 2 * thing.size

    def of(self, thing: Thing) -> int:
        return self.twice // thing.size

    @staticmethod
    def alone(thing: Thing) -> int:
        return thing.size

    def _own(self, thing: Thing) -> int:
        return thing.size


def test_what_would_succeed_is_of_the_classes_that_are_named_too():
    class Other:
        size = 6

    with pytest.raises(TypeError, match="thing must be Thing, not Other"):
        half(Other())  # type: ignore[arg-type]
    assert half(Thing(), by=1) == 2


@pytest.mark.parametrize("wrong", [None, "text", 3, [1.0]])
def test_a_wrong_class_is_a_type_error_that_names_it(wrong):
    for call in (half, Pair, Pair(Thing()).of, Pair.alone):
        with pytest.raises(TypeError, match=r"thing must be Thing, not|thing cannot be"):
            call(wrong)


def test_what_the_body_says_of_right_arguments_stays():
    with pytest.raises(RuntimeError, match="by is zero"):
        half(Thing(), 0)
    with pytest.raises(RuntimeError, match="by is zero"):
        half(Thing(), 0, None)  # None is a default, and may be given
    with pytest.raises(TypeError, match=r"thing must be Thing, not str"):  # pydrake looks at types first, too
        half("text", 0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="could not convert"):
        ends(_Refuses())  # type: ignore[arg-type]


class _Refuses:
    """An array of another library."""

    def __len__(self) -> int:
        return 1

    def __float__(self) -> float:
        raise ValueError("could not convert")


def test_text_is_no_array():
    with pytest.raises(TypeError, match="values must be ArrayLike, not str"):
        ends("text")


@checked
def first_size(items: Sequence[Thing], size: int = 1, scale: float = 1.0, call: Callable[..., Any] = print) -> int:
    if not scale or not items or size in (0, 10**30):
        raise RuntimeError("first_size(): nothing to scale.")
    return items[0].size // size


@checked
def sixth(values: ArrayLike) -> Any:
    return np.asarray(values)[5]


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (lambda: first_size([3]), r"items must be Sequence\[Thing\], not list"),
        (lambda: first_size(3, 0), "items must be .*, not int"),
        (lambda: first_size([], np.zeros(2)), "size must be int, not ndarray"),
        (lambda: first_size([], 10**30), "size must be int, not int"),
        (lambda: first_size([], 1, 0.0, 3), r"call must be Callable\[..., Any\], not int"),
        (lambda: sixth(np.array(["x"])), "values must be ArrayLike, not ndarray"),
        (lambda: sixth([["x"]]), "values must be ArrayLike, not list"),
    ],
)
def test_what_is_in_sequences_and_arrays_is_looked_at(wrong, says):
    with pytest.raises(TypeError, match=says):
        wrong()


def test_arguments_of_checked_calls_are_looked_at_when_the_body_stumbles():
    @checked
    def first(values: ArrayLike, *more: ArrayLike) -> Any:
        if more:
            raise RuntimeError("first(): more.")
        return values[0]  # type: ignore[index]

    assert first([3]) == 3
    with pytest.raises(TypeError, match=r"first\(\).*values must be ArrayLike, not ndarray"):
        first(np.array(["x"])[:0])
    with pytest.raises(IndexError):
        first(np.zeros(0))
    with pytest.raises(RuntimeError, match="more"):  # numbers one by one are no arrays, and none need be
        first([1.0], 2.0)


def test_an_array_of_another_size_than_the_body_reshapes_it_to_is_a_type_error():
    @checked
    def corner(name: str, lower: ArrayLike, upper: ArrayLike) -> Any:
        return np.reshape(upper, (3,)) - np.asarray(lower)

    assert corner("box", [0, 0, 0], [1, 2, 3]).tolist() == [1, 2, 3]
    with pytest.raises(TypeError, match=r"corner\(\).*upper must be an array of shape \(3,\), not list"):
        corner("box", [0, 0, 0], [1, 2])
    with pytest.raises(ValueError, match="broadcast"):
        corner("box", [0, 0], [1, 2, 3])


def test_a_symbol_for_a_number_that_is_compared_is_a_type_error():
    @checked
    def positive(value: float, symbol: Expression | None = None) -> float:
        return value if value > 0 or (symbol is not None and symbol > 0) else 0.0

    with pytest.raises(TypeError, match=r"value must be float, not Variable"):
        positive(Variable("a"))  # type: ignore[arg-type]
    with pytest.raises(RuntimeError, match="no truth value"):  # the symbol was asked for
        positive(-1.0, Expression(Variable("a")))


def test_errors_of_a_callers_function_are_the_callers():
    """What looked in vain was not the library."""
    with pytest.raises(AttributeError, match="nothing"):
        ends(1.0, lambda values: values.nothing)


def test_private_methods_and_signatures_stay():
    with pytest.raises(AttributeError):
        Pair(Thing())._own(None)  # type: ignore[arg-type]
    assert list(inspect.signature(half).parameters) == ["thing", "by", "note"]


def test_an_argument_without_the_attribute_is_named_whatever_its_annotation_is():
    with pytest.raises(TypeError, match=r"ContainedIn.*other"):
        AffineSubspace().ContainedIn(None)


def test_constructors_of_systems():
    class Own(LeafSystem):
        def __init__(self, thing: Thing):
            super().__init__()
            self.size = thing.size

    with pytest.raises(TypeError, match="thing"):
        Own(None)  # type: ignore[arg-type]
