"""Writes what editors and type checkers read of the modules whose names are collected as they are imported.

`sheldrake.all` and the like collect the public names of other modules (`sheldrake._pydrake.roll_up`), which no type
checker can follow. Beside each this writes a stub that imports every name from where it is defined:

    python tools/make_stubs.py            writes them
    python tools/make_stubs.py --check    says which are not as they should be, and fails
"""

from __future__ import annotations

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
    unknown = []
    for name in sorted(module.__all__):
        home = home_of(name, getattr(module, name))
        if home is None:
            unknown.append(name)
        else:
            imports.setdefault(home[0], []).append(f"    {home[1]} as {name},\n")
    lines = [f'"""{(module.__doc__ or "").strip()}\n\nMade by tools/make_stubs.py.\n"""\n', "from typing import Any\n"]
    for home in sorted(imports):
        lines.append(f"from {home} import (\n{''.join(imports[home])})")
    lines += ["", *(f"{name}: Any" for name in unknown)]
    return "\n".join(lines) + "\n"


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
    """Loaded modules of sheldrake that have a value under a name; public ones first, which stay where they are."""
    modules = [m for m in sys.modules if m.startswith("sheldrake.") and not m.endswith(".all") and "_pydrake" not in m]
    return sorted(
        (m for m in modules if vars(sys.modules[m]).get(name) is value), key=lambda m: ("._" in m, m.count("."), m)
    )


def _says(module: str, name: str) -> bool:
    """Whether a module's text defines or imports a name, so that a type checker finds it there."""
    import ast

    source = _TREES.get(module)
    if source is None:
        text = pathlib.Path(str(importlib.import_module(module).__file__)).read_text(encoding="utf-8")
        source = _TREES[module] = {n for node in ast.parse(text).body for n in _names_of(node)}
    return name in source


_TREES: dict[str, set[str]] = {}


def _names_of(node: Any) -> list[str]:
    import ast

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
