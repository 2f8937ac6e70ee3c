"""Collects the public names of several modules into one, as `sheldrake.all` does."""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

from sheldrake._pydrake import retired


def roll_up(namespace: dict[str, Any], modules: list[str]) -> list[str]:
    """Puts the public names of the modules into a module's globals, later ones over earlier ones.

    Args:
        namespace: Globals of the module that rolls up.
        modules: Names of modules of sheldrake. One that does not exist (a part still to come) adds nothing.

    Returns:
        All names added, sorted: the `__all__` of the module that rolls up.
    """
    added: set[str] = set()
    for name in modules:
        if not _exists(name):
            continue
        module = importlib.import_module(name)
        public = getattr(module, "__all__", None) or [n for n in vars(module) if not n.startswith("_")]
        names = {n: getattr(module, n) for n in public}
        names.update(retired.install(module))
        namespace.update(names)
        added.update(names)
    return sorted(added)


def _exists(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:  # Its parent does not exist.
        return False
