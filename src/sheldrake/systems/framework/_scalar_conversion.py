"""Systems on other scalars: AutoDiffXd and Expression.

A converter makes a system anew for another scalar; the new one's contexts then have slabs of objects, and the same
callbacks and kernels run on them as Python.
"""

from __future__ import annotations

import copy
import functools
import types
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from sheldrake.common._scalars import autodiff_class, expression_class, scalar_types
from sheldrake.systems.framework._declarations import CacheDeclaration, InputDeclaration, OutputDeclaration
from sheldrake.systems.framework._event import Event, WitnessFunction
from sheldrake.systems.framework._system_base import SystemBase
from sheldrake.systems.framework._vector import BasicVector

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.systems.framework._system import System


class _OfClass:
    """An attribute of a class that is computed when asked for."""

    def __init__(self, compute: Callable[[], Any]):
        self._compute = compute

    def __get__(self, obj: object, objtype: type | None = None) -> Any:
        return self._compute()


class SystemScalarConverter:
    """How a system is made anew on another scalar.

    Entries are functions `convert(system) -> system`, one per pair of scalars (to, from).
    """

    SupportedScalars: ClassVar[Any] = _OfClass(lambda: scalar_types())
    SupportedConversionPairs: ClassVar[Any] = _OfClass(
        lambda: tuple((to, source) for source in scalar_types() for to in scalar_types() if to is not source)
    )

    def __init__(self) -> None:
        self._entries: dict[tuple[Any, Any], Callable[[Any], Any]] = {}

    def _Add(self, to: type, source: type, convert: Callable[[Any], Any]) -> None:
        self._entries[to, source] = convert

    def _convert(self, to: type, system: Any) -> Any:
        convert = self._entries.get((to, system._scalar))
        return None if convert is None else convert(system)

    def _is_convertible(self, to: type, source: type) -> bool:
        return (to, source) in self._entries

    def __copy__(self) -> SystemScalarConverter:
        new = SystemScalarConverter()
        new._entries = dict(self._entries)
        return new


class ScalarConversion(SystemBase):
    """The part of System that converts it to other scalars.

    The scalar belongs to the slab of a context, so a system whose behaviour is kernels and generic Python converts by
    a copy whose contexts hold the other scalar: such classes set `_generic`.
    """

    _scalar: type = float
    _generic = False
    _symbolic = True
    """Whether a generic system converts to symbolic expressions too."""
    _kept_systems: tuple[tuple[str, str], ...] = ()
    """Names of attributes: systems that it computes with, and of the context it has of each ("": none)."""
    _scalar_converter: SystemScalarConverter | None = None

    def _convert(self, scalar: type) -> Any:
        """This system on another scalar, or None."""
        if self._scalar_converter is not None:
            return self._scalar_converter._convert(scalar, self)
        return self._converted(scalar)

    def _converted(self, scalar: type) -> Self | None:
        if not self._is_generic() or not (self._symbolic or scalar is not expression_class()):
            return None
        new = self._copy()
        if not all(self._convert_kept(new, scalar, *names) for names in self._kept_systems):
            return None
        new._name = ""
        template = type(self).__dict__.get("_template")
        if template is not None:
            new.__class__ = template[scalar]
        new._scalar = scalar
        return new

    def _convert_kept(self, new: Self, scalar: type, system_name: str, context_name: str) -> bool:
        system, context = getattr(self, system_name), getattr(self, context_name, None)
        converted = system if scalar is system._scalar else system._convert(scalar)
        if converted is None:
            return False
        setattr(new, system_name, converted)
        if context is not None:
            own = converted.CreateDefaultContext()
            own.SetTimeStateAndParametersFrom(context)
            setattr(new, context_name, own)
        return True

    def _copy(self) -> Self:
        from sheldrake.systems.framework._system_base import _ids as system_ids

        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__)
        for name, value in self.__dict__.items():
            if type(value) not in _SHARED:
                new.__dict__[name] = _rebound(value, self, new)
        new._system_id, new._parent_ref = next(system_ids), None
        new._ports, new._layouts, new._state_of = {}, {}, None
        new._entries_in_use = weakref.WeakValueDictionary()
        return new

    def _clone(self) -> Self:
        new = self._convert(self._scalar)
        if new is None and self._is_generic():
            new = self._copy()
        for scalar in scalar_types():  # there and back
            there = None if new is not None or scalar is self._scalar else self._convert(scalar)
            new = new if there is None else there._convert(self._scalar)
        if new is None:
            raise RuntimeError(
                f"System::Clone(): {self.GetSystemType()} system '{self.GetSystemPathname()}' does not support Cloning "
                "(it has no scalar conversion)."
            )
        new._name = self._name
        return new

    def get_system_scalar_converter(self) -> SystemScalarConverter:
        """The converter this system was given, or an empty one."""
        if self._scalar_converter is not None:
            return self._scalar_converter
        converter = SystemScalarConverter()
        if self._is_generic():
            for to, source in SystemScalarConverter.SupportedConversionPairs:
                if not self._symbolic and expression_class() in (to, source):
                    continue
                converter._Add(to, source, functools.partial(_converted_to, to))
        return converter

    def _is_generic(self) -> bool:
        """Whether it converts to any scalar by a copy."""
        return self._generic

    def _to(self, scalar: type, must: bool) -> Any:
        new = None if scalar is self._scalar else self._convert(scalar)
        if new is None:
            if not must:
                return None
            raise RuntimeError(
                f"System {self.GetSystemPathname()} of type {self.GetSystemType()} does not support scalar conversion "
                f"to type {scalar.__name__}"
            )
        if not new.get_name():
            new.set_name(self.get_name())
        return new

    def ToAutoDiffXd(self) -> Self:
        """This system on AutoDiffXd; RuntimeError if it cannot be."""
        return self._to(autodiff_class(), True)

    def ToAutoDiffXdMaybe(self) -> Self | None:
        """This system on AutoDiffXd, or None."""
        return self._to(autodiff_class(), False)

    def ToSymbolic(self) -> Self:
        """This system on symbolic Expression; RuntimeError if it cannot be."""
        return self._to(expression_class(), True)

    def ToSymbolicMaybe(self) -> Self | None:
        """This system on symbolic Expression, or None."""
        return self._to(expression_class(), False)


_SHARED: set[type] = {type(None), bool, int, float, str, tuple, types.FunctionType, weakref.ref}
_SHARED |= {InputDeclaration, OutputDeclaration, CacheDeclaration}
"""Types of which copies are asked for most, and whose objects they share."""


def _rebound(value: Any, old: object, new: object) -> Any:
    """What a copy has for an attribute: lists, dicts, vectors, methods and witness functions of its own."""
    if type(value) in _SHARED:
        return value
    if isinstance(value, list):
        return [v if type(v) in _SHARED else _rebound(v, old, new) for v in value]
    if isinstance(value, dict):
        return {k: v if type(v) in _SHARED else _rebound(v, old, new) for k, v in value.items()}
    if isinstance(value, types.MethodType) and value.__self__ is old:
        return types.MethodType(value.__func__, new)
    if isinstance(value, BasicVector):
        return value.Clone()
    if isinstance(value, (WitnessFunction, Event)):
        own = copy.copy(value)
        own.__dict__.update({name: new if v is old else _rebound(v, old, new) for name, v in vars(value).items()})
        return own
    return value


def _converted_to(scalar: type, system: System) -> System | None:
    return system._converted(scalar)


class _PerScalar:
    """`obj.method[T](...)`: calls `call(obj, params, ...)`."""

    def __init__(self, call: Callable):
        self._call = call

    def __get__(self, obj: object, objtype: type | None = None) -> _PerScalar | _BoundPerScalar:
        return self if obj is None else _BoundPerScalar(self._call, obj)


class _BoundPerScalar:
    def __init__(self, call: Callable, obj: object):
        self._call, self._obj = call, obj

    def __getitem__(self, param: type) -> Callable:
        return lambda *args: self._call(self._obj, param, *args)


ScalarConversion.ToScalarType = _PerScalar(lambda system, T: system._to(T, True))  # type: ignore[attr-defined]
ScalarConversion.ToScalarTypeMaybe = _PerScalar(lambda system, T: system._to(T, False))  # type: ignore[attr-defined]
SystemScalarConverter.IsConvertible = _PerScalar(  # type: ignore[attr-defined]
    lambda converter, pair: converter._is_convertible(*pair)
)
