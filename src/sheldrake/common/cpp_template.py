"""Families of classes, functions or methods indexed by parameters: `Foo_[T]`."""

from __future__ import annotations

import sys
import types
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from sheldrake.common._names import _MangledName, pretty_class_name
from sheldrake.common._overloads import Mismatch
from sheldrake.common.cpp_param import get_param_canonical, get_param_names
from sheldrake.common.deprecation import _warn_deprecated

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["TemplateBase", "TemplateClass", "TemplateFunction", "TemplateMethod", "get_or_init"]


def _calling_module(depth: int = 2) -> types.ModuleType:
    """The module whose code runs `depth` frames above."""
    name = sys._getframe(depth).f_globals.get("__name__")  # code that `exec` runs may have none
    return sys.modules.get(name or "__main__", sys.modules["__main__"])


def get_or_init(scope: ModuleType | type, name: str, template_cls: type, *args: Any, **kwargs: Any) -> TemplateBase:
    """The template `scope.name`; made as `template_cls(name, ...)` and stored there if it is not there yet."""
    template = getattr(scope, name, None)
    if template is None:
        template = template_cls(name, *args, scope=scope, **kwargs)
        setattr(scope, name, template)
    return template


class _Deferred:
    """Marks a parameter set whose instantiation is made when first asked for."""


class _Notice(NamedTuple):
    message: str
    date: str | None


class TemplateBase:
    """Maps parameters (types or literals) to instantiations.

    `template[T]` is the instantiation for `T`; `template(args)` tries each one in the order they were added.
    """

    _deferred = _Deferred()

    def __init__(self, name: str, allow_default: bool = True, scope: ModuleType | type | None = None):
        """
        Args:
            name: Name of the template.
            allow_default: `template[None]` is the first instantiation.
            scope: The module (or class) it belongs to; by default the calling module.
        """
        self.name = name
        self.param_list: list[tuple] = []
        self.__doc__ = ""
        self._allow_default = allow_default
        self._scope = _calling_module() if scope is None else scope
        self._instantiation_map: dict[tuple, Any] = {}
        self._renamed: dict[Any, Any] = {}
        self._instantiation_func: Callable[[tuple], Any] | None = None
        self._notices: dict[tuple, _Notice] = {}
        self._of_types: dict[type, Any] = {}

    def __getitem__(self, param: object) -> Any:
        if not isinstance(param, type):
            return self.get_instantiation(param)[0]
        known = self._of_types.get(param)
        if known is None:
            known, canonical = self.get_instantiation(param)
            if canonical not in self._notices:  # which are told each time
                self._of_types[param] = known
        return known

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """What the first instantiation that accepts the arguments gives."""
        if not args and not kwargs:
            raise Mismatch(f"{self.name}: incompatible function arguments for template: Cannot call without arguments")
        result = self._call_internal(*args, **kwargs)
        if result is None:
            raise Mismatch(f"{self.name}: incompatible function arguments for template: No compatible instantiations")
        return result

    def _call_internal(self, *args: Any, **kwargs: Any) -> Any:
        for param in list(self.param_list):
            try:
                return self.get_instantiation(param)[0](*args, **kwargs)
            except Mismatch:
                continue
        return None

    def get_module_name(self) -> str:
        """Name of the module the template belongs to.

        Raises:
            RuntimeError: it belongs to a class, not to a module.
        """
        if isinstance(self._scope, types.ModuleType):
            return self._scope.__name__
        raise RuntimeError(f"Unable to resolve `get_module_name` for a scope that is not a module: {self._scope}")

    def get_instantiation(self, param: object = None, throw_error: bool = True) -> tuple[Any, tuple]:
        """The instantiation for `param`, and `param` in canonical spelling.

        Args:
            param: A parameter, a tuple or list of them, or None for the first instantiation.
            throw_error: Raise on an unknown parameter instead of giving None.

        Raises:
            RuntimeError: no instantiation for `param`.
        """
        param = self._param_resolve(param)
        instantiation = self._instantiation_map.get(param)
        if instantiation is TemplateBase._deferred:
            assert self._instantiation_func is not None
            instantiation = self._store(param, self._instantiation_func(param), skip_rename=False)
        elif instantiation is None and throw_error:
            raise RuntimeError(f"Invalid instantiation: {self._instantiation_name(param)}")
        notice = self._notices.get(param)
        if notice is not None:
            _warn_deprecated(notice.message, date=notice.date, stacklevel=4)
        return instantiation, param

    def add_instantiation(self, param: object, instantiation: object, skip_rename: bool = False) -> tuple:
        """Add the instantiation for `param`; gives `param` in canonical spelling.

        Raises:
            RuntimeError: `param` has one already.
        """
        param = self._param_resolve(param)
        if param in self._instantiation_map:
            raise RuntimeError(f"Parameter instantiation already registered: {param}")
        self._note_param(param)
        self._store(param, instantiation, skip_rename)
        return param

    def _note_param(self, param: tuple) -> None:
        self.param_list.append(param)

    def _store(self, param: tuple, instantiation: object, skip_rename: bool) -> Any:
        assert instantiation is not None, f"{self._instantiation_name(param)} must not be None"
        if instantiation is not TemplateBase._deferred:
            original = instantiation
            instantiation = self._on_add(param, original, skip_rename)
            if instantiation is not original:
                self._renamed[original] = instantiation
        self._instantiation_map[param] = instantiation
        return instantiation

    def add_instantiations(self, instantiation_func: Callable[[tuple], Any], param_list: Iterable[Any]) -> None:
        """Add one instantiation for each parameter set, made by `instantiation_func(param)` when first asked for.

        Raises:
            RuntimeError: called a second time.
        """
        assert instantiation_func is not None
        if self._instantiation_func is not None:
            raise RuntimeError("`add_instantiations` cannot be called multiple times.")
        self._instantiation_func = instantiation_func
        for param in param_list:
            self.add_instantiation(param, TemplateBase._deferred)

    def deprecate_instantiation(self, param: object, message: str, *, date: str | None = None) -> tuple[Any, tuple]:
        """Warn with `message` whenever the instantiation for `param` is asked for.

        Raises:
            RuntimeError: it is deprecated already.
        """
        param = self._param_resolve(param)
        if param in self._notices:
            raise RuntimeError(f"Deprecation already registered: {self._instantiation_name(param)}")
        instantiation, param = self.get_instantiation(param)
        self._notices[param] = _Notice(message, date)
        self._of_types.clear()
        return instantiation, param

    def get_param_set(self, instantiation: object) -> set[tuple]:
        """All parameter sets that lead to `instantiation`."""
        return {param for param, known in self._instantiation_map.items() if known == instantiation}

    def is_instantiation(self, obj: object) -> bool:
        """Whether `obj` is an instantiation of this template."""
        obj = self._renamed.get(obj, obj)
        return any(self.get_instantiation(param)[0] is obj for param in self.param_list)

    def _param_resolve(self, param: object) -> tuple:
        if param is None:
            assert self._allow_default and self.param_list, f"{self.name} has no default instantiation"
            param = self.param_list[0]
        elif isinstance(param, list):
            param = tuple(param)
        elif not isinstance(param, tuple):
            param = (param,)
        return get_param_canonical(param)

    def _instantiation_name(self, param: object, *, mangle: bool = False) -> str:
        names = get_param_names(self._param_resolve(param), mangle=mangle)
        name = f"{self.name}[{','.join(names)}]"
        return _MangledName.mangle(name) if mangle else name

    def _full_name(self) -> str:
        return f"{self._scope.__name__}.{self.name}"

    def __str__(self) -> str:
        kind = next(cls for cls in type(self).__mro__ if cls.__module__ == __name__)  # those of our own are as these
        return f"<{pretty_class_name(kind)} {self._full_name()}>"

    def _on_add(self, param: tuple, instantiation: Any, skip_rename: bool) -> Any:
        return instantiation

    @classmethod
    def define(
        cls, name: str, param_list: Iterable[Any], *args: Any, scope: Any = None, **kwargs: Any
    ) -> Callable[[Callable[[tuple], Any]], Any]:
        """Decorator: the function below it makes the instantiation for each parameter set, when first asked.

        Example:
            ::

                @TemplateClass.define("Box_", param_list=[(float,), (AutoDiffXd,)])
                def Box_(param):
                    (T,) = param
                    class Impl: ...
                    return Impl
        """
        template = cls(name, *args, scope=_calling_module() if scope is None else scope, **kwargs)  # type: ignore[misc]

        def decorate(instantiation_func: Callable[[tuple], Any]) -> TemplateBase:
            template.add_instantiations(instantiation_func, param_list)
            return template

        return decorate


class TemplateClass(TemplateBase):
    """A family of classes."""

    def __init__(self, name: str, *, scope: ModuleType | type | None = None, **kwargs: Any):
        super().__init__(name, scope=_calling_module() if scope is None else scope, **kwargs)

    def _on_add(self, param: tuple, instantiation: Any, skip_rename: bool) -> type:
        if not skip_rename:
            cls: Any = instantiation
            cls._original_name = cls.__name__
            cls._original_qualname = cls.__qualname__
            cls.__name__ = cls.__qualname__ = self._instantiation_name(param, mangle=True)
            cls.__module__ = self._scope.__name__
            setattr(self._scope, cls.__name__, cls)  # where pickle looks for it
        return instantiation

    def is_subclass_of_instantiation(self, obj: type) -> type | None:
        """The first instantiation that `obj` derives from, or None."""
        for param in self.param_list:
            instantiation, _ = self.get_instantiation(param)
            if issubclass(obj, instantiation):
                return instantiation
        return None


_BUILTIN_CALLABLES = (types.MethodType, types.BuiltinMethodType, types.BuiltinFunctionType)


def _rename_callable(function: Any, scope: ModuleType | type, name: str, cls: type | None = None) -> Any:
    """`function` named as a member of the module or class; a builtin, whose name is fixed, gets a wrapper."""
    module = scope.__module__ if isinstance(scope, type) else scope.__name__
    if (function.__module__, function.__name__) == (module, name):
        return function
    if isinstance(function, _BUILTIN_CALLABLES):
        original = function

        def function(*args: Any, **kwargs: Any) -> Any:
            return original(*args, **kwargs)

        function.__doc__ = original.__doc__
    function.__module__ = module
    function.__name__ = name
    function.__qualname__ = name if cls is None else f"{cls.__qualname__}.{name}"
    return function


class TemplateFunction(TemplateBase):
    """A family of functions."""

    def _on_add(self, param: tuple, instantiation: Any, skip_rename: bool) -> Any:
        assert skip_rename is False
        name = self._instantiation_name(param, mangle=True)
        function = _rename_callable(instantiation, self._scope, name)
        setattr(self._scope, function.__name__, function)
        return function


class TemplateMethod(TemplateBase):
    """A family of methods of one class; `obj.method[T](...)`."""

    def __init__(self, name: str, cls: type, scope: ModuleType | type | None = None, **kwargs: Any):
        super().__init__(name, scope=_calling_module() if scope is None else scope, **kwargs)
        self._cls = cls

    def _on_add(self, param: tuple, instantiation: Any, skip_rename: bool) -> Any:
        assert skip_rename is False
        name = self._instantiation_name(param, mangle=True)
        function = _rename_callable(instantiation, self._scope, name, self._cls)
        setattr(self._cls, function.__name__, function)
        return function

    def __get__(self, obj: object, objtype: type | None = None) -> TemplateMethod | TemplateMethod._Bound:
        return self if obj is None else TemplateMethod._Bound(self, obj)

    def __set__(self, obj: object, value: object) -> None:
        raise RuntimeError("Read-only property")

    def __str__(self) -> str:
        return f"<unbound TemplateMethod {self._full_name()}>"

    def _full_name(self) -> str:
        return f"{self._cls.__name__}.{self.name}"

    class _Bound:
        def __init__(self, template: TemplateMethod, obj: Any):
            self._template = template
            self._obj = obj

        def __getitem__(self, param: Any) -> types.MethodType:
            return types.MethodType(self._template[param], self._obj)

        def __str__(self) -> str:
            return f"<bound TemplateMethod {self._template._full_name()} of {self._obj}>"
