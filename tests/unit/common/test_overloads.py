"""Calls with several forms: the first that fits is taken, and an error lists them all."""

import pytest

from sheldrake.common._kinds import anything, count, flag, instance_of, text
from sheldrake.common._overloads import Mismatch, dispatch, kind, overload, overloaded


@kind("even int")
def even(value):
    if value % 2:
        raise Mismatch
    return value // 2


class Shelf:
    @overloaded(overload(copy=instance_of(str)), overload(size=count, label=(text, "none"), lit=(flag, False)))
    def __init__(self, what, label="", lit=None):
        self.told = (what, label, lit)

    @overloaded(
        overload(lambda self, pair: ("pair", pair), pair=even),
        overload(name=text, at=(anything, None)),
        overload(place=count, at=(anything, None)),
    )
    def find(self, what, at):
        """Finds something."""
        return what, at


@overloaded(overload(), overload(number=even))
def halve(number=None):
    return number


def test_the_first_form_that_fits_is_taken():
    shelf = Shelf(3)
    assert shelf.told == (3, "none", False)
    assert Shelf("a").told == ("a", "", None)
    assert Shelf(size=3, lit=1).told == (3, "none", True)
    assert shelf.find(4) == ("pair", 2)
    assert shelf.find(3) == (3, None)
    assert shelf.find(4, None) == (4, None)
    assert shelf.find("x", at=shelf) == ("x", shelf)
    assert (halve(), halve(6), halve(number=8)) == (None, 3, 4)


def test_an_error_lists_all_forms():
    with pytest.raises(TypeError) as error:
        Shelf(3).find(place=1.5)
    assert str(error.value) == (
        "Shelf.find(): incompatible function arguments. Got (place=float); accepted: (pair: even int), "
        "(name: str, at = None), (place: int, at = None)."
    )
    with pytest.raises(TypeError, match=r"Shelf\(\): incompatible constructor arguments. Got \(\); accepted: \(copy"):
        Shelf()
    with pytest.raises(TypeError, match=r"halve\(\): incompatible function arguments. Got \(int\); accepted: \(\), "):
        halve(3)


@pytest.mark.parametrize("args, kwargs", [((1, 2, 3), {}), ((1,), {"place": 1}), ((), {"at": 1}), ((1,), {"where": 2})])
def test_names_and_numbers_of_arguments_must_fit(args, kwargs):
    with pytest.raises(TypeError, match="incompatible function arguments"):
        Shelf(3).find(*args, **kwargs)


def test_errors_of_the_body_are_its_own():
    def fail(target):
        raise TypeError("of the body")

    with pytest.raises(TypeError, match="of the body"):
        dispatch("call", [overload(fail), overload(lambda target: None)], None, (), {})


def test_a_method_keeps_its_name_and_docstring():
    assert Shelf.find.__name__ == "find" and Shelf.find.__doc__ == "Finds something."


class Small(int):
    pass


def test_what_took_a_type_before_still_looks_at_the_value():
    shelf = Shelf(3)
    for _ in range(2):
        assert shelf.find(4) == ("pair", 2)
        assert shelf.find(3) == (3, None)
        assert shelf.find(Small(5)) == (5, None)
        with pytest.raises(TypeError):
            shelf.find(-3)
        with pytest.raises(TypeError):
            shelf.find(None)


def test_who_passes_for_another_class_is_taken():
    class Proxy:
        def __init__(self, cls):
            self.cls = cls

        @property
        def __class__(self):
            return self.cls

    assert isinstance(Proxy(str), str)
    told = [Shelf(Proxy(cls)).told[0] for cls in (str, str)]
    assert all(isinstance(proxy, Proxy) for proxy in told)
    with pytest.raises(TypeError):
        Shelf(Proxy(float))


def test_memory_of_types_is_bounded():
    for k in range(200):
        assert halve(type(f"Even{k}", (int,), {})(4)) == 2
    assert len(halve._ways._plans) <= 64
