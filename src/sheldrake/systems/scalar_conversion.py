"""Systems written in Python once for all scalar types."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from sheldrake.common._scalars import scalar_types
from sheldrake.common.cpp_template import TemplateClass, _calling_module
from sheldrake.systems.framework import LeafSystem_, SystemScalarConverter

__all__ = ["TemplateSystem"]


class TemplateSystem(TemplateClass):
    """A family of LeafSystems, one for each scalar type, that convert into each other.

    Each class defines `_construct(self, ..., converter=None)` in place of `__init__`, and
    `_construct_copy(self, other, converter=None)` to make itself of a sibling::

        @TemplateSystem.define("Doubler_")
        def Doubler_(T):
            class Impl(LeafSystem_[T]):
                def _construct(self, size, converter=None):
                    LeafSystem_[T].__init__(self, converter=converter)
                    ...

                def _construct_copy(self, other, converter=None):
                    Impl._construct(self, other.size, converter=converter)

            return Impl
    """

    def __init__(
        self,
        name: str,
        T_list: Iterable[Any] | None = None,
        T_pairs: Iterable[tuple[Any, Any]] | None = None,
        scope: Any = None,
    ):
        """
        Args:
            name: Name of the family.
            T_list: Scalar types; by default all.
            T_pairs: Conversions (to, from); by default all between types of `T_list`.
            scope: The module it belongs to; by default the calling module.
        """
        super().__init__(name, scope=_calling_module() if scope is None else scope)
        supported = scalar_types()
        self._T_list = list(supported if T_list is None else T_list)
        for T in self._T_list:
            if T not in supported:
                raise RuntimeError(f"{name}: {T} is no scalar type of systems; they are {supported}.")
        pairs = SystemScalarConverter.SupportedConversionPairs if T_pairs is None else T_pairs
        self._T_pairs = [(to, source) for to, source in pairs if to in self._T_list and source in self._T_list]
        if T_pairs is not None and len(self._T_pairs) != len(list(T_pairs)):
            raise RuntimeError(f"{name}: T_pairs must name types of T_list, {self._T_list}.")

    @classmethod
    def define(  # type: ignore[override]
        cls,
        name: str,
        T_list: Iterable[Any] | None = None,
        T_pairs: Iterable[tuple[Any, Any]] | None = None,
        *args: Any,
        **kwargs: Any,
    ) -> Callable[[Callable], TemplateSystem]:
        """A decorator that makes a family of a function `f(T)` which gives the class for T."""
        scope = kwargs.pop("scope", None) or _calling_module()
        template = cls(name, T_list, T_pairs, scope=scope)

        def decorator(function: Callable) -> TemplateSystem:
            template.__doc__ = function.__doc__ or ""
            template.add_instantiations(lambda param: function(param[0], *args, **kwargs), template._T_list)
            return template

        return decorator

    def __str__(self) -> str:
        return f"<TemplateSystem {self._full_name()}>"

    def _on_add(self, param: tuple, instantiation: Any, skip_rename: bool) -> type:
        (T,) = param
        if not issubclass(instantiation, LeafSystem_[T]):
            raise RuntimeError(f"{self.name}: the class for {T.__name__} must derive from LeafSystem_[{T.__name__}].")
        for method in ("_construct", "_construct_copy"):
            if method not in vars(instantiation):
                raise RuntimeError(f"{self.name}: the class for {T.__name__} must define `{method}`.")
        if "__init__" in vars(instantiation):
            raise RuntimeError(f"{self.name}: the class for {T.__name__} must define `_construct`, not `__init__`.")
        template = self

        def __init__(system: Any, *args: Any, **kwargs: Any) -> None:
            converter = kwargs.pop("converter", None)
            if converter is None:
                converter = template._make_converter()
            other = args[0] if len(args) == 1 and not kwargs else None
            if other is not None and template.is_instantiation(type(other)):
                system._construct_copy(other, converter=converter)
            else:
                system._construct(*args, converter=converter, **kwargs)

        instantiation.__init__ = __init__
        return super()._on_add(param, instantiation, skip_rename)

    def _make_converter(self) -> SystemScalarConverter:
        converter = SystemScalarConverter()
        for to, source in self._T_pairs:
            converter._Add(to, source, partial(self._copy_to, to))
        return converter

    def _copy_to(self, to: Any, system: Any) -> Any:
        new = self[to](system)
        new._scalar_converter = system._scalar_converter
        return new
