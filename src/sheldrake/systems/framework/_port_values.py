"""What ports give together: a bus of named values, and the values of all output ports."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from sheldrake.common._copies import Cloned
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import Mismatch
from sheldrake.common.value import AbstractValue, _register_value_type
from sheldrake.systems.framework._values import _index
from sheldrake.systems.framework._vector import BasicVector


class BusValue(Cloned):
    """Abstract values by name, as one port carries them together."""

    def __init__(self) -> None:
        self._values: dict[str, AbstractValue] = {}

    def Set(self, name: str, value: AbstractValue) -> None:
        """Stores a copy of `value` under `name`.

        Raises:
            RuntimeError: there is a value of another type under `name`.
        """
        if not isinstance(value, AbstractValue):
            raise Mismatch(f"BusValue.Set(): incompatible function arguments: {value!r} is no AbstractValue.")
        if name in self._values:
            self._values[name].SetFrom(value)
        else:
            self._values[name] = value.Clone()

    def Find(self, name: str) -> Any:
        """The held object under `name`, or None."""
        value = self._values.get(name)
        return None if value is None else value.get_value()

    def Clear(self) -> None:
        """Forgets all values."""
        self._values.clear()

    def Clone(self) -> BusValue:
        """An independent copy."""
        bus = BusValue()
        bus._values = {name: value.Clone() for name, value in self._values.items()}
        return bus

    def _assign_from(self, other: BusValue) -> None:
        self._values = other.Clone()._values

    def __getitem__(self, key: str) -> Any:
        if key not in self._values:
            raise KeyError(key)
        return self._values[key].get_value()

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._values))


_register_value_type(BusValue)


@no_constructor("Use System.AllocateOutput().")
class SystemOutput:
    """The values of all output ports of a system, filled by `System.CalcOutput`; each is made when asked for."""

    _values: list[AbstractValue | None]
    _allocate: Callable[[int], AbstractValue]

    @classmethod
    def _of(cls, num_ports: int, allocate: Callable[[int], AbstractValue]) -> SystemOutput:
        output = object.__new__(cls)
        output._values, output._allocate = [None] * num_ports, allocate
        return output

    def num_ports(self) -> int:
        """How many output ports there are."""
        return len(self._values)

    def get_data(self, index: int, /) -> AbstractValue:
        """Value of output port `index`."""
        i, values = _index("SystemOutput.get_data()", index, len(self._values)), self._values
        value = values[i]
        if value is None:
            value = values[i] = self._allocate(i)
        return value

    def get_vector_data(self, index: int, /) -> BasicVector:
        """Value of vector output port `index`.

        Raises:
            RuntimeError: the port is abstract.
        """
        value = self.get_data(index).get_value()
        if not isinstance(value, BasicVector):
            raise RuntimeError(
                f"SystemOutput.get_vector_data(): a request to cast to BasicVector failed: output port {index} carries "
                f"a {type(value).__name__}."
            )
        return value
