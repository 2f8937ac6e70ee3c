"""The alias: modules of sheldrake by the names of pydrake's; see `sheldrake.as_pydrake`."""

from __future__ import annotations

import dis
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from sheldrake import __version__
from sheldrake._pydrake import names, retired
from sheldrake._pydrake.defaults import with_drakes_defaults

if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec

__all__ = ["install", "missing_name"]

_IMPORT_FROM = dis.opmap["IMPORT_FROM"]


class _Pydrake(ModuleType):
    """The package `pydrake` itself. Its modules are sheldrake's."""

    __path__: list[str] = []

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(f"module 'pydrake' has no attribute {name!r}")
        if name == "getDrakePath":
            return importlib.import_module("sheldrake.common").GetDrakePath
        if _native_name(f"pydrake.{name}") is not None or names.is_module(f"pydrake.{name}"):
            return importlib.import_module(f"pydrake.{name}")
        raise AttributeError(f"module 'pydrake' has no attribute {name!r}")


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives sheldrake's modules under their pydrake names."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname == "drake":  # Drake's own messages are plain Python, and work here as they are
            is_installed = importlib.machinery.PathFinder.find_spec(fullname, path) is not None
            return None if is_installed else importlib.machinery.ModuleSpec(fullname, self)
        if fullname != "pydrake" and not fullname.startswith("pydrake."):
            return None
        known = (
            fullname == "pydrake"
            or fullname in retired.MODULES
            or fullname in retired.GONE
            or _native_name(fullname) is not None
            or names.is_module(fullname)
        )
        # An unknown name gives None, and nothing else finds it: the folders searched are sheldrake's own.
        return importlib.machinery.ModuleSpec(fullname, self) if known else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        if spec.name == "pydrake":
            return _Pydrake("pydrake", "The modules of sheldrake, by the names of pydrake's.")
        if spec.name == "drake":
            return _messages_module()
        if spec.name in retired.MODULES:
            return retired.MODULES[spec.name].make(spec.name)
        if spec.name in retired.GONE:
            raise ModuleNotFoundError(f"Drake removed {spec.name}, with {retired.GONE[spec.name]}.", name=spec.name)
        native = _native_name(spec.name)
        if native is None:
            reason = names.reason_against(spec.name)
            fate = f"will not have: {reason}" if reason else f"{__version__} does not have yet"
            raise ModuleNotFoundError(f"{spec.name} is a module of pydrake that sheldrake {fate}.", name=spec.name)
        module = importlib.import_module(native)
        retired.install(module)
        adapted = with_drakes_defaults(module)
        if adapted:
            module = _view(module, adapted)
        spec.loader_state = module.__spec__  # The import system is about to overwrite it.
        return module

    def exec_module(self, module: ModuleType) -> None:
        assert module.__spec__ is not None
        fullname, original = module.__spec__.name, module.__spec__.loader_state
        if original is not None:
            module.__spec__ = original
            _complete(fullname, module)
            if fullname == "pydrake.all":
                _add_imports_of_drakes(module)


def _messages_module() -> ModuleType:
    """Message types of LCM, as `from drake import lcmt_iiwa_command` finds them."""
    from sheldrake.lcm import _messages

    module = ModuleType("drake", "Message types of LCM.")
    vars(module).update({name: value for name, value in vars(_messages).items() if name.startswith("lcmt_")})
    return module


def _native_name(fullname: str) -> str | None:
    """The name of sheldrake's module that is the pydrake module `fullname`, or None."""
    native = "sheldrake" + fullname.removeprefix("pydrake")
    if native in sys.modules:
        return native
    try:
        return native if importlib.util.find_spec(native) is not None else None
    except ModuleNotFoundError:  # A parent is missing, or is no package.
        return None


def _view(native: ModuleType, adapted: dict[str, Any]) -> ModuleType:
    """A module with the names of one of sheldrake's, some of them adapted; that one stays as it is."""
    view = ModuleType(native.__name__, native.__doc__)
    vars(view).update(vars(native), __all__=list(vars(native)["__all__"]), **adapted)
    return view


def _complete(fullname: str, module: ModuleType) -> None:
    """Adds to a module of sheldrake what scripts for pydrake may ask of it."""
    previous = vars(module).get("__getattr__")
    if getattr(previous, "_is_alias", False):
        return

    def __getattr__(name: str) -> Any:
        if previous is not None:
            try:
                return previous(name)
            except AttributeError:
                pass
        submodule = f"{fullname}.{name}"
        if submodule in retired.MODULES:
            return importlib.import_module(submodule)
        found = _from_its_home(fullname, name)
        if found is not None:
            return found
        caller = sys._getframe(1)
        # `from m import name` hides the text of an AttributeError; an ImportError reaches the reader.
        is_import = caller.f_code.co_code[caller.f_lasti] == _IMPORT_FROM
        text = missing_name(fullname, name)
        if is_import and text is not None:
            raise ImportError(text, name=fullname)
        raise AttributeError(text or f"module {module.__name__!r} has no attribute {name!r}")

    __getattr__._is_alias = True  # type: ignore[attr-defined]
    vars(module)["__getattr__"] = __getattr__


_IMPORTS = {"np": "numpy"} | {
    name: name
    for name in ("functools", "math", "operator", "os", "re", "socket", "subprocess", "sys", "typing", "warnings")
}
_IMPORTED_NAMES = {
    "List": "sheldrake.common.cpp_param",
    "NamedTemporaryFile": "tempfile",
    "SVG": "IPython.display",
    "TemplateClass": "sheldrake.common.cpp_template",
    "TemplateMethod": "sheldrake.common.cpp_template",
    "display": "IPython.display",
    "getDrakePath": "pydrake",
    "get_ipython": "IPython",
    "partial": "functools",
}
"""Modules, and names of modules, that Drake's own import, and `from pydrake.all import *` gives; scripts rely on it."""


def _add_imports_of_drakes(module: ModuleType) -> None:
    """Adds them; those of IPython in a notebook only, which has imported it."""
    found = {name: importlib.import_module(native) for name, native in _IMPORTS.items()}
    for name, home in _IMPORTED_NAMES.items():
        if home in sys.modules or not home.startswith("IPython"):
            found[name] = getattr(importlib.import_module(home), name)
    for name, value in found.items():
        if name not in vars(module):
            vars(module)[name] = value
            vars(module)["__all__"].append(name)


def _from_its_home(module: str, name: str) -> Any:
    """What pydrake's module imports from another one, and shows, from where it is in sheldrake; or None."""
    if name not in names.names_of(module):
        return None
    for home in names.modules_with(name):
        if _native_name(home) is not None and home != module:
            found = vars(importlib.import_module(home)).get(name)
            if found is not None:
                return found
    return None


def missing_name(module: str, name: str) -> str | None:
    """What to tell the user of `name`, absent from pydrake's `module`: a sentence, or None for an unknown name."""
    if name in names.names_of(module):
        if reason := names.reason_against(name):
            return f"{module}.{name} is a name of pydrake that sheldrake will not have: {reason}."
        return f"{module}.{name} is a name of pydrake that sheldrake {__version__} does not have yet."
    if name in retired.GONE_NAMES:
        return f"Drake removed {name}: {retired.GONE_NAMES[name]}."
    elsewhere = names.modules_with(name)
    return f"{module} has no {name}; pydrake has it in {' and '.join(elsewhere)}." if elsewhere else None


def install() -> None:
    """Makes `import pydrake` mean sheldrake; done when `sheldrake.as_pydrake` is imported, and harmless when repeated.

    Raises:
        ImportError: if Drake's own pydrake has been imported before.
    """
    if any(isinstance(finder, _Finder) for finder in sys.meta_path):
        return
    loaded = sys.modules.get("pydrake")
    if loaded is not None:
        raise ImportError(
            f"sheldrake.as_pydrake: pydrake is already imported, from {getattr(loaded, '__file__', 'unknown')}. "
            "Import sheldrake.as_pydrake first, or use `sheldrake run`."
        )
    sys.meta_path.insert(0, _Finder())
