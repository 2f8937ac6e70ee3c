"""Classes that exist once per scalar type: float, AutoDiffXd and Expression.

`Foo` is written once, on arrays of dtype float64 or object. `Foo_ = ScalarTemplate("Foo_", Foo)` makes its siblings
when they are first asked for. The scalar classes themselves live in `autodiffutils` and `symbolic`, which import this
package; they are looked up by name when somebody asks for them.
"""

from __future__ import annotations

import functools
import importlib
import sys
import types
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Kind, Mismatch, Ways, incompatible, kind, overload
from sheldrake.common.cpp_param import get_param_canonical
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.common.value import _register_value_type

if TYPE_CHECKING:
    from types import ModuleType

    from typing_extensions import Self

_HOMES = {"AutoDiffXd": "sheldrake.autodiffutils", "Expression": "sheldrake.symbolic"}


@functools.cache
def home_of(name: str) -> ModuleType:
    """The module of a scalar class."""
    return importlib.import_module(_HOMES[name])


def autodiff_class() -> type:
    """The class AutoDiffXd."""
    return home_of("AutoDiffXd").AutoDiffXd


def expression_class() -> type:
    """The class Expression."""
    return home_of("Expression").Expression


def scalar_types() -> tuple[type, ...]:
    """All scalar types, plainest first."""
    return (float, autodiff_class(), expression_class())


def is_symbolic(T: type) -> bool:
    """Whether numbers of type `T` are expressions, whose comparisons give formulas."""
    return T is not float and T.__name__ == "Expression"


# --- conversion of arguments ------------------------------------------------------------------------------------


def as_scalar(T: type, value: Any) -> Any:
    """`value` as one number of type `T`.

    Raises:
        Mismatch: it is not one.
    """
    if type(value) is T:
        return value
    if type(value) is np.ndarray and value.ndim == 0:
        value = value.item()
    if T is float:
        if isinstance(value, (str, bytes, np.ndarray)):
            raise Mismatch
        try:
            return float(value)
        except (TypeError, ValueError, RuntimeError):
            raise Mismatch from None
    try:
        return T(value.item() if isinstance(value, np.generic) else value)
    except (TypeError, ValueError, RuntimeError):
        raise Mismatch from None


def as_array(T: type, value: object, shape: tuple[int, ...]) -> np.ndarray:
    """A new read-only array of numbers of type `T`; a vector may be given as a column.

    Raises:
        Mismatch: `value` has another shape or other contents.
    """
    array = any_array(T, value, shape).reshape(shape)
    array.setflags(write=False)
    return array


_FLOAT64 = np.dtype(np.float64)


def writable(call: str, name: str, array: object) -> np.ndarray:
    """An array that a caller gave to have results written into it.

    Raises:
        TypeError: it is none, cannot be written, or cannot hold the numbers: whole numbers would lose their fractions.
    """
    if isinstance(array, np.ndarray) and array.flags.writeable and array.dtype in (_FLOAT64, np.dtype(object)):
        return array
    found = repr(array)
    if isinstance(array, np.ndarray):
        found = f"an array of {array.dtype}" if array.flags.writeable else "one that is read-only"
    raise Mismatch(
        f"{call}(): incompatible function arguments: {name} must be a writable array of float64, not {found}."
    )


def any_array(T: type, value: Any, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """A new array of numbers of type `T`, of whatever shape `value` has; a vector may be a column of a shape asked for.

    Raises:
        Mismatch: `value` has other contents, or is not of the shape asked for.
    """
    if value is None:  # nan for NumPy
        raise Mismatch
    floats = type(value) is np.ndarray and value.dtype is _FLOAT64
    try:
        source = np.array(value, dtype=np.float64) if T is float else value if floats else np.asarray(value, object)
    except (TypeError, ValueError, RuntimeError):
        raise Mismatch from None
    if shape is not None and source.shape != shape and (len(shape) != 1 or source.shape != (*shape, 1)):
        raise Mismatch
    if T is float:
        return source
    if floats and not is_symbolic(T):
        return home_of("AutoDiffXd")._matrices.constants(source)
    numbers = [x if type(x) is T else T(x) if type(x) is float else as_scalar(T, x) for x in source.ravel().tolist()]
    array = np.empty(len(numbers), dtype=object)
    array[:] = numbers
    return array.reshape(source.shape)


def plain_vector(value: object, size: int = 3) -> np.ndarray | None:
    """A read-only copy of so many numbers as most calls give them, or None: then a kind has to look."""
    if type(value) is np.ndarray and value.dtype is _FLOAT64 and value.shape == (size,):
        p = value.copy()
    elif type(value) is list and len(value) == size and all([isinstance(x, (float, int)) for x in value]):
        p = np.array(value, np.float64)
    else:
        return None
    p.setflags(False)  # type: ignore[call-arg]
    return p


@functools.cache
def scalar(T: type) -> Kind:
    """Parameter kind: one number."""
    return kind(T.__name__)(functools.partial(as_scalar, T))


@functools.cache
def vector(T: type, n: int) -> Kind:
    """Parameter kind: a vector of `n` numbers."""
    return kind(f"{T.__name__} array of shape ({n},)")(functools.partial(as_array, T, shape=(n,)))


@kind("float array of shape (n,)")
def float_vector(value: object) -> np.ndarray:
    """Parameter kind: a vector of floats, of any size."""
    numbers = any_array(float, value)
    return as_array(float, numbers, (numbers.size,))


@functools.cache
def matrix(T: type, rows: int, cols: int) -> Kind:
    """Parameter kind: a matrix of fixed size."""
    return kind(f"{T.__name__} array of shape ({rows}, {cols})")(functools.partial(as_array, T, shape=(rows, cols)))


def frozen(array: np.ndarray) -> np.ndarray:
    """`array`, made read-only."""
    array.setflags(write=False)
    return array


def new_array(T: type, nested: object) -> np.ndarray:
    """A read-only array of numbers already of type `T`."""
    array = np.array(nested, dtype=np.float64 if T is float else object)
    array.setflags(write=False)
    return array


def identity(T: type, n: int) -> np.ndarray:
    """The read-only unit matrix of size `n`."""
    return _identity(T, n)


@functools.cache
def _identity(T: type, n: int) -> np.ndarray:
    return as_array(T, np.eye(n), (n, n))


@functools.cache
def zeros(T: type, n: int) -> np.ndarray:
    """The read-only zero vector of size `n`."""
    return as_array(T, np.zeros(n), (n,))


def plain(array: np.ndarray) -> list[Any]:
    """The numbers of an array as nested lists of Python floats (or of the array's objects)."""
    return array.tolist()


# --- classes per scalar -----------------------------------------------------------------------------------------


class _BoundCast:
    def __init__(self, obj: ScalarBase):
        self._obj = obj

    def __getitem__(self, T: Any) -> Callable[[], Any]:
        cls, T = type(self._obj), _one_type(T)
        source = cls._T
        if T not in (source, *(scalar_types() if source is float else ())):
            raise RuntimeError(
                f"Invalid instantiation: cast[{getattr(T, '__name__', T)}] of a {pretty_class_name(cls)}"
            )
        return lambda: self._obj._cast_to(cls._template[T])

    def __str__(self) -> str:
        return f"<bound TemplateMethod {type(self._obj).__name__}.cast of {self._obj}>"


class _Cast:
    """`obj.cast[T]()`: the same value in another scalar type; only float can become another type."""

    def __get__(self, obj: ScalarBase | None, objtype: type | None = None) -> Any:
        return self if obj is None else _BoundCast(obj)

    def __set__(self, obj: object, value: object) -> None:
        raise RuntimeError("Read-only property")


def _one_type(T: Any) -> Any:
    (canonical,) = get_param_canonical(T if isinstance(T, tuple) else (T,))
    return canonical


class ScalarBase:
    """Base of a class written once for all scalar types.

    A subclass keeps its numbers in the slots named by `_FIELDS`: read-only arrays, numbers, or other such objects.
    """

    __slots__ = ("__weakref__",)
    _T: ClassVar[type] = float
    _FIELDS: ClassVar[tuple[str, ...]] = ()
    _template: ClassVar[Any]
    _way_cache: ClassVar[dict[tuple[type, str], Ways]] = {}

    cast = _Cast()

    def _cast_to(self, cls: type) -> Any:
        new: ScalarBase = object.__new__(cls)
        for name in self._FIELDS:
            value = getattr(self, name)
            if isinstance(value, np.ndarray):
                value = as_array(cls._T, value, value.shape)  # type: ignore[attr-defined]
            elif isinstance(value, ScalarBase):
                value = value._cast_to(type(value)._template[cls._T])  # type: ignore[attr-defined]
            else:
                value = as_scalar(cls._T, value)  # type: ignore[attr-defined]
            setattr(new, name, value)
        return new

    def _assign_from(self, other: ScalarBase) -> None:
        """Take the value of `other`; what it shares is never written."""
        for name in self._FIELDS:
            value = getattr(other, name)
            if isinstance(value, ScalarBase):
                getattr(self, name)._assign_from(value)
            else:
                setattr(self, name, value)

    def __copy__(self) -> Self:
        new = object.__new__(type(self))
        for name in self._FIELDS:
            value = getattr(self, name)
            setattr(new, name, value.__copy__() if isinstance(value, ScalarBase) else value)
        return new

    def __deepcopy__(self, memo: dict) -> Self:
        return self.__copy__()

    def __getstate__(self) -> object:
        return {name: getattr(self, name) for name in self._FIELDS}

    def __setstate__(self, state: Any) -> None:
        for name, value in state.items():
            setattr(self, name, frozen(value) if isinstance(value, np.ndarray) else value)

    @classmethod
    def _sibling(cls, template: ScalarTemplate) -> type:
        """The class of the same scalar type in another family."""
        return template[cls._T]

    @classmethod
    def _plain_class(cls) -> Any:
        """The class itself, also when asked on a user's subclass."""
        return cls._template[cls._T]

    def _choose(self, call: str, args: tuple, kwargs: dict) -> None:
        """Run the first way to make `call` that takes the arguments (see `_ways_<call>`)."""
        key = (type(self), call)
        ways = self._way_cache.get(key)
        if ways is None:
            cls = type(self)._plain_class()
            ways = self._way_cache[key] = Ways(getattr(cls, f"_ways_{call}")(cls))
        found = ways.first(args, kwargs)
        if found is not None:
            function, values = found
            return function(self, *values)
        name = pretty_class_name(type(self)._plain_class())
        where = name if call == "init" else f"{name}.{call}"
        raise incompatible(where, [str(way) for way in ways], args, kwargs, constructor=call == "init")

    @classmethod
    def _argument(cls, call: str, convert: Kind, **named: Any) -> Any:
        """The one argument of a call, converted.

        Raises:
            TypeError: it is of another kind.
        """
        ((name, value),) = named.items()
        try:
            return convert(value)
        except Mismatch:
            where = f"{pretty_class_name(cls._plain_class())}.{call}"
            raise incompatible(where, [str(overload(**{name: convert}))], (), named) from None


class ScalarTemplate(TemplateClass):
    """`Foo_`: the versions of class Foo for all scalar types; those other than float are made when first asked for."""

    def __init__(self, name: str, float_class: type, *, scope: str, value_type: bool = False):
        """
        Args:
            name: Name of the family, `Foo_`.
            float_class: The class Foo. Its methods must not use `super()`: they are shared by all versions.
            scope: Name of the public module of both.
            value_type: Also hold them by value in `Value[Foo]` and `Value[List[Foo]]`.
        """
        super().__init__(name, scope=sys.modules[scope])
        self._value_type = value_type
        own = ("__dict__", "__weakref__", "__qualname__", *getattr(float_class, "__slots__", ()))
        self._members = {key: value for key, value in vars(float_class).items() if key not in own}
        self._bases = float_class.__bases__
        self.__doc__ = f"The class {float_class.__name__} for each scalar type."
        float_class.__module__ = scope
        self._adopt(float, float_class, skip_rename=True)

    def _adopt(self, T: type, cls: type[ScalarBase], skip_rename: bool) -> None:
        cls._T, cls._template = T, self
        self.add_instantiation(T, cls, skip_rename)
        if self._value_type:
            _register_value_type(cls, with_list=True)

    def _add(self, T: type) -> None:
        if (T,) not in self._instantiation_map:
            bases = tuple(self._base_for(base, T) for base in self._bases)
            cls = types.new_class(self.name, bases, exec_body=lambda namespace: namespace.update(self._members))
            self._adopt(T, cls, skip_rename=False)

    @staticmethod
    def _base_for(base: type, T: type) -> type:
        template = base.__dict__.get("_template")
        return base if template is None else template[T]

    def __getitem__(self, param: Any) -> Any:
        if isinstance(param, type) and not self._notices:  # nearly always, and often
            found = self._instantiation_map.get((param,))
            if isinstance(found, type):
                return found
        return self.get_instantiation(param)[0]

    def get_instantiation(self, param: Any = None, throw_error: bool = True) -> tuple[Any, tuple]:
        """See `TemplateBase.get_instantiation`."""
        T = param[0] if isinstance(param, (tuple, list)) and len(param) == 1 else param
        if isinstance(T, type) and not self._notices and isinstance(self._instantiation_map.get((T,)), type):
            return self._instantiation_map[T,], (T,)
        if isinstance(T, type) and _HOMES.get(T.__name__) and T in scalar_types():
            self._add(T)
        return super().get_instantiation(param, throw_error)

    @property
    def param_list(self) -> list[tuple]:  # type: ignore[override]
        """The scalar types, each as a tuple of one."""
        return [(T,) for T in scalar_types()]

    @param_list.setter
    def param_list(self, value: list[tuple]) -> None:
        assert value == []

    def _note_param(self, param: tuple) -> None:
        pass  # the list is known beforehand

    def __str__(self) -> str:
        return f"<TemplateClass {self._full_name()}>"
