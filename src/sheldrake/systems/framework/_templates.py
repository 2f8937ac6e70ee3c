"""`Foo_[T]`: classes of the framework by scalar type."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from sheldrake.common._scalars import scalar_types
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.common.value import _register_value_type
from sheldrake.systems.framework._vector import BasicVector

if TYPE_CHECKING:
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder


def on_scalar_of(builder: DiagramBuilder, cls: type) -> type:
    """The version of a system's class for the scalar type of a DiagramBuilder."""
    return cls._template[builder._scalar]  # type: ignore[attr-defined]


class SystemTemplate(TemplateClass):
    """`Foo_`: class Foo for float and, made when first asked for, for the other scalars.

    The scalar belongs to a context's memory, so that most classes are the same for all scalars (`own=False`). Those
    that users construct or derive from get a derived class of their own, which sets `_scalar`.

    Args:
        name: Name of the family, `Foo_`.
        cls: The class Foo.
        scope: Name of the public module of both.
        own: Whether each scalar has a class of its own.
        base: The family of Foo's base class, where that has classes of its own.
    """

    def __init__(self, name: str, cls: type, *, scope: str, own: bool = False, base: SystemTemplate | None = None):
        super().__init__(name, scope=sys.modules[scope])
        self._class, self._own, self._base = cls, own, base
        if own:
            cls._template = self  # type: ignore[attr-defined]
        self.add_instantiation(float, cls, skip_rename=True)
        self.__doc__ = f"The class {cls.__name__} for each scalar type."

    @property
    def param_list(self) -> list[tuple]:  # type: ignore[override]
        """The scalar types, as parameters."""
        return [(T,) for T in scalar_types()]

    @param_list.setter
    def param_list(self, params: list[tuple]) -> None:
        """Ignored: a family has all scalar types, also those that nobody has asked for yet."""

    def get_instantiation(self, param: Any = None, throw_error: bool = True) -> tuple[Any, tuple]:
        """See `TemplateBase.get_instantiation`."""
        T = param[0] if isinstance(param, (tuple, list)) and len(param) == 1 else param
        if isinstance(T, type) and T is not float and (T,) not in self._instantiation_map and T in scalar_types():
            if self._own:
                bases = (self._class,) if self._base is None else (self._class, self._base[T])
                sibling = type(self.name, bases, {"_scalar": T, "__doc__": self._class.__doc__, "_template": self})
                self.add_instantiation(T, sibling)
                if self._class is BasicVector:
                    _register_value_type(sibling)
            else:
                self.add_instantiation(T, self._class, skip_rename=True)
        return super().get_instantiation(param, throw_error)
