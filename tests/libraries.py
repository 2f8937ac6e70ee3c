"""sheldrake and pydrake side by side: the same modules of one library or the other, "sheldrake" or "pydrake"."""

from __future__ import annotations

import importlib
from types import SimpleNamespace


def names_of(library: str, *modules: str) -> SimpleNamespace:
    """All names of some modules in one namespace; `library` is the library's."""
    names: dict[str, object] = {}
    for module in modules:
        names.update(vars(importlib.import_module(f"{library}.{module}")))
    return SimpleNamespace(**{**names, "library": library})


def modules_of(library: str, *modules: str) -> SimpleNamespace:
    """Some modules by their last names."""
    return SimpleNamespace(**{m.rpartition(".")[2]: importlib.import_module(f"{library}.{m}") for m in modules})
