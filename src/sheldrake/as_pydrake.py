"""Import this module, and `import pydrake` means sheldrake, in this process, from then on.

    import sheldrake.as_pydrake
    from pydrake.all import *

`pydrake.systems.framework` is then the very module `sheldrake.systems.framework`, whether or not Drake itself is
installed; names that Drake retired since 2021 are there with a hint; a name of pydrake that sheldrake does not have
yet raises an error that says so. Defaults in which sheldrake departs from Drake are Drake's once pydrake is imported.

`sheldrake run script.py` does this for a script that knows nothing of sheldrake.
"""

from __future__ import annotations

import dis
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import sys
from types import ModuleType
from typing import Any

from sheldrake import __version__, _pydrake_names, _retired

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
        if _native_name(f"pydrake.{name}") is not None or _pydrake_names.is_module(f"pydrake.{name}"):
            return importlib.import_module(f"pydrake.{name}")
        raise AttributeError(f"module 'pydrake' has no attribute {name!r}")


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives sheldrake's modules under their pydrake names."""

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> Any:
        if fullname != "pydrake" and not fullname.startswith("pydrake."):
            return None
        known = (
            fullname == "pydrake"
            or fullname in _retired.MODULES
            or fullname in _retired.GONE
            or _native_name(fullname) is not None
            or _pydrake_names.is_module(fullname)
        )
        # An unknown name gives None, and nothing else finds it: the folders searched are sheldrake's own.
        return importlib.machinery.ModuleSpec(fullname, self) if known else None

    def create_module(self, spec: Any) -> ModuleType:
        if spec.name == "pydrake":
            _take_drakes_defaults()
            return _Pydrake("pydrake", __doc__)
        if spec.name in _retired.MODULES:
            return _retired.MODULES[spec.name].make(spec.name)
        if spec.name in _retired.GONE:
            raise ModuleNotFoundError(f"Drake removed {spec.name}, with {_retired.GONE[spec.name]}.", name=spec.name)
        native = _native_name(spec.name)
        if native is None:
            reason = _pydrake_names.reason_against(spec.name)
            fate = f"will not have: {reason}" if reason else f"{__version__} does not have yet"
            raise ModuleNotFoundError(f"{spec.name} is a module of pydrake that sheldrake {fate}.", name=spec.name)
        module = importlib.import_module(native)
        spec.loader_state = module.__spec__  # The import system is about to overwrite it.
        return module

    def exec_module(self, module: ModuleType) -> None:
        assert module.__spec__ is not None
        fullname, original = module.__spec__.name, module.__spec__.loader_state
        if original is not None:
            module.__spec__ = original
            _complete(fullname, module)


def _native_name(fullname: str) -> str | None:
    """The name of sheldrake's module that is the pydrake module `fullname`, or None."""
    native = "sheldrake" + fullname.removeprefix("pydrake")
    if native in sys.modules:
        return native
    try:
        return native if importlib.util.find_spec(native) is not None else None
    except ModuleNotFoundError:  # A parent is missing, or is no package.
        return None


def _complete(fullname: str, module: ModuleType) -> None:
    """Adds to a module of sheldrake what scripts for pydrake may ask of it."""
    _retired.install(module)
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
        if submodule in _retired.MODULES:
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


def _from_its_home(module: str, name: str) -> Any:
    """What pydrake's module imports from another one, and shows, from where it is in sheldrake; or None."""
    if name not in _pydrake_names.names_of(module):
        return None
    for home in _pydrake_names.modules_with(name):
        native = _native_name(home)
        if native is not None and home != module:
            found = vars(importlib.import_module(native)).get(name)
            if found is not None:
                return found
    return None


def missing_name(module: str, name: str) -> str | None:
    """What to tell the user of `name`, absent from pydrake's `module`: a sentence, or None for an unknown name."""
    if name in _pydrake_names.names_of(module):
        if reason := _pydrake_names.reason_against(name):
            return f"{module}.{name} is a name of pydrake that sheldrake will not have: {reason}."
        return f"{module}.{name} is a name of pydrake that sheldrake {__version__} does not have yet."
    if name in _retired.GONE_NAMES:
        return f"Drake removed {name}: {_retired.GONE_NAMES[name]}."
    elsewhere = _pydrake_names.modules_with(name)
    return f"{module} has no {name}; pydrake has it in {' and '.join(elsewhere)}." if elsewhere else None


def _take_drakes_defaults() -> None:
    from sheldrake.geometry import _defaults

    _defaults.point_contact_algorithm = "single_point"


def install() -> None:
    """Makes `import pydrake` mean sheldrake; done when this module is imported, and harmless when repeated.

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


install()
