"""Objects that show calls of their parts as their own."""

import inspect

import pytest

from sheldrake.common._parts import Call, forget_calls, home_of, part


class Memory:
    def __init__(self):
        self.numbers = []

    def add(self, number: int, times: int = 1) -> int:
        """How many numbers there are now."""
        self.numbers += [number] * times
        return len(self.numbers)


_memory = part(Memory, "_parts.memory")


class Parts:
    def __init__(self):
        self.memory = Memory()


class Whole:
    def __init__(self):
        self._parts = Parts()

    add = Call(_memory.add)
    put = Call(_memory.add)


def test_a_call_is_the_parts_own_bound_method_once_asked_for():
    whole = Whole()
    assert whole.add(3, times=2) == 2
    assert whole.__dict__["add"].__self__ is whole._parts.memory
    assert whole.put(4) == 3, "another name for the same call"


def test_it_looks_like_a_method_of_the_whole():
    assert Whole.add.__doc__ == "How many numbers there are now."
    assert Whole.add.__qualname__ == "Whole.add"
    assert list(inspect.signature(Whole.add).parameters) == ["self", "number", "times"]
    assert list(inspect.signature(Whole().add).parameters) == ["number", "times"]
    with pytest.raises(TypeError, match=r"Whole\.add\(\) missing 1 required positional argument"):
        Whole().add()


def test_it_may_be_called_on_the_class():
    whole = Whole()
    assert Whole.add(whole, 1) == 1


def test_a_derived_class_overrides_it():
    class More(Whole):
        def add(self, number, times=1):
            return super().add(number, 2 * times)

    more = More()
    assert (more.add(1), more.add(1)) == (2, 4), "also after the base class was asked"


def test_new_parts_are_found_after_forgetting():
    whole = Whole()
    whole.add(1)
    whole._parts = Parts()
    assert whole.add(1) == 2, "the part it had"
    whole._parts = Parts()
    forget_calls(whole)
    assert whole.add(1) == 1


def test_what_replaces_the_parts_method_is_called(monkeypatch):
    assert home_of(Whole, "add") is Memory
    assert home_of(Memory, "add") is Memory
    monkeypatch.setattr(Memory, "add", lambda self, number: "new")
    assert Whole().add(1) == "new"
