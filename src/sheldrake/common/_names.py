"""Names of templates as people see them, `Foo_[AutoDiffXd]`, and as identifiers."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any


class _MangledName:
    """Turns `LeafSystem_[AutoDiffXd]` into a valid identifier and back.

    Pickle and `class` statements need identifiers, people read expressions. Each character that an identifier
    forbids has one stand-in letter, the same letters that pydrake uses, so that names agree between the two.
    """

    UNICODE_LEFT_BRACKET = "𝓣"
    UNICODE_RIGHT_BRACKET = "𝓤"
    UNICODE_COMMA = "𝓬"
    UNICODE_PERIOD = "𝓹"

    _TO_IDENTIFIER = str.maketrans({"[": "𝓣", "]": "𝓤", ",": "𝓬", ".": "𝓹"})
    _TO_EXPRESSION = str.maketrans({"𝓣": "[", "𝓤": "]", "𝓬": ",", "𝓹": "."})

    @staticmethod
    def mangle(name: str) -> str:
        """The identifier that stands for the expression `name`."""
        mangled = name.translate(_MangledName._TO_IDENTIFIER)
        assert f"_{mangled}".isidentifier(), f"{name!r} cannot be spelled as an identifier"
        return mangled

    @staticmethod
    def demangle(name: str) -> str:
        """The expression that the identifier `name` stands for."""
        return name.translate(_MangledName._TO_EXPRESSION)

    @staticmethod
    def module_getattr(*, module_name: str, module_globals: Mapping[str, Any], name: str) -> Any:
        """The module global that `name` stands for, in either spelling; `Foo_[float]` finds plain `Foo`.

        Raises:
            AttributeError: no such name in the module.
        """
        mangled = _MangledName.mangle(name)
        for candidate in (mangled, mangled.removesuffix("_𝓣float𝓤")):
            if candidate in module_globals:
                return module_globals[candidate]
        raise AttributeError(f"module {module_name!r} has no attribute {mangled!r}")


def pretty_class_name(cls: type, *, use_qualname: bool = False) -> str:
    """The name of `cls` as a person writes it, such as `RigidTransform_[AutoDiffXd]`.

    Args:
        cls: Any class.
        use_qualname: Start from `__qualname__` instead of `__name__`.
    """
    return _MangledName.demangle(cls.__qualname__ if use_qualname else cls.__name__)


def show_as_own(package: Mapping[str, Any], *more: str) -> None:
    """Classes and functions of a package say that they are the package's, not of the file that they are written in.

    Classes that are members of a class, as `CameraConfig.FovDegrees`, say that too.

    Args:
        package: The globals of a package, once its `__all__` is complete.
        more: Names of others that it has.
    """
    private = f"{package['__name__']}._"
    for name in (*package["__all__"], *more):
        thing = package.get(name)  # some are made when they are first asked for
        if (inspect.isclass(thing) or inspect.isfunction(thing)) and thing.__module__.startswith(private):
            thing.__module__ = package["__name__"]
    for outer in filter(inspect.isclass, map(package.get, package["__all__"])):
        for name, inner in vars(outer).items():
            if inspect.isclass(inner) and name[0] != "_" and inner.__module__.startswith(private):
                inner.__module__, inner.__qualname__ = outer.__module__, f"{outer.__qualname__}.{name}"
