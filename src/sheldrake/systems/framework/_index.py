"""Typed integers and enumerations of the framework.

Ports, states, parameters and cache entries are numbered; each kind of number is a class of its own, as in Drake.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, SupportsIndex

from sheldrake.common._copies import is_never_changed
from sheldrake.common._enums import IndexEnum, NumberEnum
from sheldrake.common._overloads import Mismatch
from sheldrake.common.value import _register_value_type

if TYPE_CHECKING:
    from typing_extensions import Self

_UNSET = -1234567


class _TypedIndex:
    """An integer that names one kind of thing; it equals plain ints and its own kind, never another kind."""

    __slots__ = ("_value",)

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        _register_value_type(cls)
        is_never_changed(cls)

    def __init__(self, value: SupportsIndex = _UNSET, /):
        if isinstance(value, _TypedIndex) and type(value) is not type(self):
            raise Mismatch(
                f"__init__(): incompatible constructor arguments. {type(self).__name__} takes an int, not {value!r}."
            )
        try:
            self._value = value.__index__()
        except AttributeError:
            raise Mismatch(
                f"__init__(): incompatible constructor arguments. {type(self).__name__} takes an int, not {value!r}."
            ) from None

    def is_valid(self) -> bool:
        """Whether a value was given."""
        return self._value >= 0

    def __int__(self) -> int:
        return self._value

    def __index__(self) -> int:
        return self._value

    def _other(self, other: object) -> int | None:
        if type(other) is type(self):
            return other._value
        return None if isinstance(other, _TypedIndex) or not hasattr(other, "__index__") else int(other)

    def __eq__(self, other: object) -> bool:
        if type(other) is type(self):
            return self._value == other._value  # type: ignore[attr-defined, no-any-return]
        value = self._other(other)
        return NotImplemented if value is None else self._value == value

    def __lt__(self, other: object) -> bool:
        value = self._other(other)
        return NotImplemented if value is None else self._value < value

    def __hash__(self) -> int:
        return hash(self._value)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._value})"

    def __reduce__(self) -> tuple:
        return type(self), (self._value,)

    def __deepcopy__(self, memo: dict) -> Self:
        return self  # it never changes


class InputPortIndex(_TypedIndex):
    """Number of an input port in its system."""

    __slots__ = ()


class OutputPortIndex(_TypedIndex):
    """Number of an output port in its system."""

    __slots__ = ()


class SubsystemIndex(_TypedIndex):
    """Number of a subsystem in its diagram."""

    __slots__ = ()


class DiscreteStateIndex(_TypedIndex):
    """Number of a group of discrete state."""

    __slots__ = ()


class ContinuousStateIndex(_TypedIndex):
    """Names a leaf's continuous state, of which there is one."""

    __slots__ = ()


class AbstractStateIndex(_TypedIndex):
    """Number of an abstract state."""

    __slots__ = ()


class NumericParameterIndex(_TypedIndex):
    """Number of a group of numeric parameters."""

    __slots__ = ()


class AbstractParameterIndex(_TypedIndex):
    """Number of an abstract parameter."""

    __slots__ = ()


class CacheIndex(_TypedIndex):
    """Number of a cache entry in its system."""

    __slots__ = ()


class SystemConstraintIndex(_TypedIndex):
    """Number of a constraint in its system."""

    __slots__ = ()


class DependencyTicket(_TypedIndex):
    """Names something a computation may depend on."""

    __slots__ = ()


class PortDataType(NumberEnum):
    """Whether a port carries a vector of numbers or an abstract value."""

    kVectorValued = 0
    kAbstractValued = 1


class InputPortSelection(IndexEnum):
    """Which input port a function that takes one should use."""

    kNoInput = -1
    kUseFirstInputIfItExists = -2


class OutputPortSelection(IndexEnum):
    """Which output port a function that takes one should use."""

    kNoOutput = -1
    kUseFirstOutputIfItExists = -2


class UseDefaultName:
    """Type of `kUseDefaultName`: lets a port name itself."""

    def __repr__(self) -> str:
        return "kUseDefaultName"


kUseDefaultName = UseDefaultName()


class Ticket:
    """The built-in dependency tickets' numbers; indexed tickets of a system follow."""

    NOTHING, TIME, ACCURACY, Q, V, Z, XC, XD, XA, ALL_STATE, PN, PA, ALL_PARAMETERS = range(13)
    ALL_SOURCES_EXCEPT_INPUTS, ALL_INPUTS, ALL_SOURCES, CONFIGURATION, KINEMATICS = range(13, 18)
    XCDOT, PE, KE, PC, PNC = range(18, 23)
    FIRST_INDEXED = 23
