"""Writes what editors and type checkers read of the modules whose names are collected as they are imported.

`sheldrake.all` and the like collect the public names of other modules (`sheldrake._pydrake.roll_up`), which no type
checker can follow. Beside each this writes a stub that imports every name from where it is defined, and all of a
module's at once where they all are in it:

    python tools/make_stubs.py            writes them
    python tools/make_stubs.py --check    says which are not as they should be, and fails
"""

from __future__ import annotations

import ast
import contextlib
import functools
import importlib
import inspect
import keyword
import pathlib
import sys
from types import ModuleType
from typing import Any

SOURCES = pathlib.Path(__file__).resolve().parents[1] / "src"
COLLECTIONS = ("common.all", "geometry.all", "multibody.all", "systems.all", "all")


def stub_of(module: ModuleType) -> str:
    """The stub of a module that collects names."""
    imports: dict[str, list[str]] = {}
    lines = []
    for name in sorted(module.__all__):
        home = home_of(name, getattr(module, name))
        if home is None:
            lines.append(f"{name}: Any")
            continue
        imports.setdefault(home[0], []).append(home[1])
        if home[1] != name:  # what is imported under another name is no public name
            lines.append(f"{name} = {home[1]}")
    text = [f'"""{(module.__doc__ or "").strip()}\n\nMade by tools/make_stubs.py.\n"""\n', "from typing import Any\n"]
    for home, names in sorted(imports.items()):
        if _is_all_in(home, module):
            text.append(f"from {home} import *")
            names = [name for name in names if _is_unlisted(home, name)]
        if names:
            text.append(f"from {home} import (\n" + "".join(f"    {name} as {name},\n" for name in names) + ")")
    return "\n".join([*text, "", *lines]) + "\n"


def _is_all_in(home: str, collection: ModuleType) -> bool:
    """Whether the public list of a module says, in the source, nothing that the collection has otherwise."""
    module = importlib.import_module(home)
    public = getattr(module, "__all__", None)
    if public is None or public != _public_list(home):
        return False
    return all(_says(home, name) and vars(collection).get(name) is getattr(module, name) for name in public)


def _public_list(home: str) -> list[str] | None:
    """`__all__` as a type checker reads it; None where it is more than a list of words."""
    for node in _tree(home).body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", None) == "__all__":
            with contextlib.suppress(ValueError):
                return list(ast.literal_eval(node.value))
    return None


def home_of(name: str, value: Any) -> tuple[str, str] | None:
    """Module and name under which the source says what a value is; None where only running it does."""
    module, own = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
    candidates = [(package, name) for package in _packages_with(name, value)]
    if isinstance(own, str) and (inspect.isclass(value) or callable(value)):
        candidates.append((module, own))
    for home, defined in candidates:
        if isinstance(home, str) and home.startswith("sheldrake") and defined.isidentifier():
            if not keyword.iskeyword(defined) and _says(home, defined):
                return home, defined
    return None


def _packages_with(name: str, value: Any) -> list[str]:
    """Loaded modules of sheldrake that have a value under a name; those that list it first, as they stay there."""
    modules = [m for m in sys.modules if m.startswith("sheldrake.") and not m.endswith(".all") and "_pydrake" not in m]
    return sorted(
        (m for m in modules if vars(sys.modules[m]).get(name) is value),
        key=lambda m: (_is_unlisted(m, name), "._" in m, m.count("."), m),
    )


def _is_unlisted(module: str, name: str) -> bool:
    return name not in getattr(sys.modules[module], "__all__", ())


def _says(module: str, name: str) -> bool:
    """Whether a module's text defines or imports a name, so that a type checker finds it there."""
    return name in {n for node in _tree(module).body for n in _names_of(node)}


@functools.cache
def _tree(module: str) -> ast.Module:
    return ast.parse(pathlib.Path(str(importlib.import_module(module).__file__)).read_text(encoding="utf-8"))


def _names_of(node: Any) -> list[str]:
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        return [node.name]
    if isinstance(node, (ast.Import, ast.ImportFrom)):
        return [alias.asname or alias.name for alias in node.names]
    if isinstance(node, ast.Assign):
        return [target.id for target in node.targets if isinstance(target, ast.Name)]
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
        return [node.target.id]
    if isinstance(node, ast.If):
        return [name for child in [*node.body, *node.orelse] for name in _names_of(child)]
    return []


def main() -> int:
    """Writes the stubs, or with --check compares them with what is there."""
    wrong = []
    for name in COLLECTIONS:
        module = importlib.import_module(f"sheldrake.{name}")
        path = SOURCES / "sheldrake" / f"{name.replace('.', '/')}.pyi"
        text = stub_of(module)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            wrong.append(path.relative_to(SOURCES.parent).as_posix())
            if "--check" not in sys.argv:
                path.write_text(text, encoding="utf-8")
    if wrong and "--check" in sys.argv:
        print(f"not up to date: {', '.join(wrong)}; run python tools/make_stubs.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
