"""Values of any type behind one interface, as abstract ports, states and parameters hold them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from sheldrake.common._names import pretty_class_name
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import Mismatch
from sheldrake.common.cpp_param import List
from sheldrake.common.cpp_template import TemplateClass

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["AbstractValue", "Value"]


@no_constructor("Use Value(x), Value[T](...) or AbstractValue.Make(x).")
class AbstractValue:
    """A held value whose type is fixed at construction. Made by `Value(x)`, `Value[T](...)` or `AbstractValue.Make`."""

    _type: ClassVar[Any] = None  # the class of the held object
    _held: Any

    @staticmethod
    def Make(value: object) -> AbstractValue:
        """A value holding `value`, of the type `Value[type(value)]` if there is one, else `Value[object]`.

        A non-empty list is a `Value[List[T]]` where T, the type of its first item, has one.
        """
        kind = List[type(value[0])] if isinstance(value, list) and value else type(value)
        cls, _ = Value.get_instantiation(kind, throw_error=False)
        return (_ObjectValue if cls is None else cls)(value)

    @classmethod
    def _holding(cls, held: Any) -> Self:
        """A value that holds this very object, which is of the right type and nobody else's."""
        new = object.__new__(cls)
        new._held = held
        return new

    def Clone(self) -> AbstractValue:
        """An independent copy; a `Value[object]` copies deeply."""
        return self._holding(self._copy(self._held))

    def _like(self, value: object) -> AbstractValue:
        """A new one of this kind that holds `value`; raises as `set_value`."""
        new = self.Clone()
        new.set_value(value)
        return new

    def SetFrom(self, other: AbstractValue, /) -> None:
        """Copy the value of `other`.

        Raises:
            RuntimeError: `other` holds another type.
        """
        if not isinstance(other, AbstractValue):
            raise Mismatch(
                f"AbstractValue.SetFrom(): incompatible function arguments: expected an AbstractValue, "
                f"got {pretty_class_name(type(other))}"
            )
        if type(self) is not type(other):
            raise RuntimeError(
                f"AbstractValue.SetFrom(): a {pretty_class_name(type(self))} cannot take its value from a "
                f"{pretty_class_name(type(other))}: a request to cast to another static type failed."
            )
        self._assign(self._copy(other._held))

    def get_value(self) -> Any:
        """The held value. Treat it as constant."""
        return self._held

    def get_mutable_value(self) -> Any:
        """The held value, to be changed in place.

        Raises:
            RuntimeError: it is a str, bool or float, or of a `Value[List[T]]`: these are set as a whole.
        """
        return self._held

    @classmethod
    def _not_in_place(cls) -> RuntimeError:
        return RuntimeError(f"Cannot get mutable value (or reference) for a type-conversion type: {cls._type}")

    def set_value(self, value: object) -> None:
        """Replace the held value.

        Raises:
            TypeError: `value` is of another type.
        """
        self._assign(self._accept(value))

    def _assign(self, value: object) -> None:
        """Store `value`; a type with `_assign_from` is overwritten in place, so that references stay live."""
        assign_from = getattr(self._held, "_assign_from", None)
        if assign_from is not None and type(self._held) is type(value):
            assign_from(value)
        else:
            self._held = value

    @classmethod
    def _copy(cls, held: Any) -> Any:
        raise NotImplementedError

    @classmethod
    def _accept(cls, value: Any) -> Any:
        raise NotImplementedError

    @classmethod
    def _reject(cls, value: object) -> TypeError:
        return Mismatch(
            f"{pretty_class_name(cls)}.set_value(): incompatible function arguments: expected "
            f"{_type_name(cls._type)}, got {value!r} of type {pretty_class_name(type(value))}"
        )

    def __copy__(self) -> AbstractValue:
        return self.Clone()

    def __deepcopy__(self, memo: dict) -> AbstractValue:
        return self.Clone()

    def __repr__(self) -> str:
        return f"{pretty_class_name(type(self))}({self._held!r})"


def _type_name(kind: object) -> str:
    return pretty_class_name(kind) if isinstance(kind, type) and not hasattr(kind, "__origin__") else str(kind)


class _ObjectValue(AbstractValue):
    """Holds a reference to any Python object; copies are deep."""

    _type = object

    def __init__(self, value: object = None, /):
        self._held = value

    @classmethod
    def _copy(cls, held: Any) -> Any:
        method = getattr(type(held), "__deepcopy__", None)  # which `copy.deepcopy` finds after a longer search
        return copy.deepcopy(held) if method is None else method(held, {})

    @classmethod
    def _accept(cls, value: Any) -> Any:
        return value


class _ScalarValue(AbstractValue):
    """Holds an immutable str, bool or float."""

    _sources: ClassVar[tuple[type, ...]] = ()

    def __init__(self, *args: object, **kwargs: object):
        if len(args) == 1 and not kwargs and isinstance(args[0], bytes) and self._type is str:
            self._held = args[0].decode()
        else:
            self._held = self._type(*args, **kwargs)

    def get_mutable_value(self) -> Any:
        raise self._not_in_place()

    @classmethod
    def _copy(cls, held: Any) -> Any:
        return held

    @classmethod
    def _accept(cls, value: Any) -> Any:
        if cls._type is float:
            if hasattr(value, "__float__") or hasattr(value, "__index__"):
                return float(value)
            raise cls._reject(value)
        if cls._type is bool and (value is None or hasattr(type(value), "__bool__")):
            return bool(value)
        if not isinstance(value, cls._type):
            raise cls._reject(value)
        return value


class _TypedValue(AbstractValue):
    """Holds its own copy of an object of one class."""

    _clone: ClassVar[Any] = staticmethod(copy.copy)
    _coerce: ClassVar[Any] = None

    def __init__(self, *args: object, **kwargs: object):
        if len(args) == 1 and not kwargs and isinstance(args[0], self._type):
            self._held = self._clone(args[0])
        else:
            self._held = self._type(*args, **kwargs)

    @classmethod
    def _copy(cls, held: Any) -> Any:
        return cls._clone(held)

    @classmethod
    def _accept(cls, value: Any) -> Any:
        if not isinstance(value, cls._type):
            raise cls._reject(value)
        return cls._clone(value)

    def set_value(self, value: object) -> None:
        if self._coerce is not None and not isinstance(value, self._type):
            value = self._coerce(value)
        super().set_value(value)


class _ListValue(AbstractValue):
    """Holds its own copy of a list of objects of one class."""

    _item: ClassVar[type]

    def __init__(self, value: list | None = None, /):
        self._held = [] if value is None else self._accept(value)

    def get_mutable_value(self) -> Any:
        raise self._not_in_place()

    def _like(self, value: object) -> AbstractValue:
        new = object.__new__(type(self))
        new._held = self._accept(value)
        return new

    @classmethod
    def _copy(cls, held: Any) -> Any:
        return [item.__copy__() for item in held] if hasattr(cls._item, "__copy__") else [copy.copy(i) for i in held]

    @classmethod
    def _accept(cls, value: Any) -> Any:
        kind = cls._item
        if not isinstance(value, (list, tuple)) or not all([isinstance(item, kind) for item in value]):
            raise cls._reject(value)
        return cls._copy(value)


class _ValueTemplate(TemplateClass):
    """`Value`: called, it chooses the class by the type of what it is given."""

    def _call_internal(self, *args: object, **kwargs: object) -> AbstractValue:
        return AbstractValue.Make(*args, **kwargs)


Value = _ValueTemplate("Value")
Value.__doc__ = "`Value[T]` holds a T; `Value(x)` holds x in the fitting class (see `AbstractValue.Make`)."


def _new_value_class(base: type, kind: Any, **members: object) -> type:
    return type("Value", (base,), {"_type": kind, "__doc__": f"Holds a {_type_name(kind)}.", **members})


def _register_value_type(
    kind: type,
    *,
    clone: Callable[[Any], Any] | None = None,
    coerce: Callable[[Any], Any] | None = None,
    with_list: bool = False,
) -> type:
    """Give `kind` its own class `Value[kind]` with value semantics: held by copy, type checked.

    Args:
        kind: The class of the held objects.
        clone: Copies one; by default its `Clone()` if it has one, else `copy.copy`.
        coerce: Makes a `kind` of other things `set_value` should take, or raises TypeError.
        with_list: Also give it `Value[List[kind]]`.
    """
    if clone is None:
        clone = (lambda held: held.Clone()) if hasattr(kind, "Clone") else copy.copy
    members: dict[str, Any] = {"_clone": staticmethod(clone)}
    if coerce is not None:
        members["_coerce"] = staticmethod(coerce)
    Value.add_instantiation(kind, _new_value_class(_TypedValue, kind, **members))
    if with_list:
        Value.add_instantiation(List[kind], _new_value_class(_ListValue, List[kind], _item=kind))
    return Value[kind]


for _kind in (str, bool, float):
    Value.add_instantiation(_kind, _new_value_class(_ScalarValue, _kind))
Value.add_instantiation(object, _ObjectValue)
