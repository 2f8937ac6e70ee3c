"""Writes one page of API reference for each public module, as reStructuredText that Sphinx's autodoc fills.

What is public is what the modules list in `__all__`. `tools/make_docs.py` calls this.
"""

from __future__ import annotations

import enum
import importlib
import inspect
import pathlib
import pkgutil
import re
import types

HIDDEN = {"sheldrake.__main__", "sheldrake.all", "sheldrake.as_pydrake", "sheldrake.cli"}
"""Modules that act when they are imported, or only repeat the others."""


def public_modules() -> list[types.ModuleType]:
    """Returns the modules with public names of their own, by name."""
    import sheldrake

    names = [m.name for m in pkgutil.walk_packages(sheldrake.__path__, "sheldrake.")]
    names = [n for n in names if not n.endswith(".all") and not any(p.startswith("_") for p in n.split("."))]
    modules = [importlib.import_module(n) for n in sorted(names) if n not in HIDDEN]
    return [m for m in modules if getattr(m, "__all__", None)]


def public_classes(modules: list[types.ModuleType]) -> dict[type, str]:
    """Returns {class: the place where it is documented}: of several modules that list it, the most special one."""
    homes: dict[type, str] = {}
    for module in sorted(modules, key=lambda m: len(m.__all__)):
        for name in module.__all__:
            if inspect.isclass(getattr(module, name)):
                homes.setdefault(getattr(module, name), f"{module.__name__}.{name}")
    return homes


def first_lines(thing: object) -> str:
    """Returns the first paragraph of a docstring; nothing for numbers and strings, which have their type's."""
    own = inspect.isclass(thing) or inspect.isroutine(thing) or inspect.ismodule(thing)
    text = (inspect.getdoc(thing) or "").partition("\n\n")[0] if own else ""
    return as_prose(" ".join(text.split()).removesuffix("::"))


def as_prose(line: str) -> str:
    """Returns a line of a docstring in which |x|, name_ and *args mean themselves, as reStructuredText has it."""
    parts = re.split(r"(`+[^`]*`+)", line)
    return "".join(part if k % 2 else re.sub(r"[|*]|(?<=\w)_(?!\w)", r"\\\g<0>", part) for k, part in enumerate(parts))


def signature(cls: type) -> str:
    """Returns what a class is called with, `(a, b=1)`, where it says so; families of classes hide it from autodoc."""
    if issubclass(cls, (enum.Enum, BaseException)) or cls.__init__ is object.__init__:
        return ""
    parameters = list(inspect.signature(cls.__init__).parameters.values())[1:]
    text = str(inspect.Signature([p.replace(annotation=p.empty) for p in parameters]))
    return "" if "<" in text else text


def methods(cls: type, homes: dict[type, str]) -> list[str]:
    """Returns the public attributes of a class that no public base class documents, as they stand in the source.

    A class may be put together from private ones, a file a subject: what these define is the class's own.
    """
    documented = [base for base in cls.__mro__[1:-1] if base in homes]
    own = [base for base in cls.__mro__[:-1] if not any(issubclass(other, base) for other in documented)]
    own = [base for base in own if base.__module__.startswith("sheldrake")]
    return list(dict.fromkeys(name for base in own for name in vars(base) if not name.startswith("_")))


def class_entry(path: str, cls: type, homes: dict[type, str]) -> list[str]:
    """Returns the directives of a class."""
    bases = [f":py:class:`{homes[b]}`" for b in cls.__bases__ if b in homes]
    lines = [f".. autoclass:: {path}{signature(cls)}"]
    if issubclass(cls, enum.Enum):
        return [*lines, "   :members:", "   :undoc-members:", ""]
    documented = [m for m in methods(cls, homes) if inspect.getdoc(getattr(cls, m, None)) or m in _annotated(cls)]
    lines += [f"   :members: {', '.join(documented)}"] if documented else []
    return [*lines, "", *([f"   Bases: {', '.join(bases)}", ""] if bases else [])]


def _annotated(cls: type) -> set[str]:
    return {name for base in cls.__mro__ for name in getattr(base, "__annotations__", {})}


def entry(module: types.ModuleType, name: str, homes: dict[type, str]) -> list[str]:
    """Returns the directives of one public name."""
    thing, path = getattr(module, name), f"{module.__name__}.{name}"
    if inspect.isclass(thing):
        if homes[thing] != path:
            return [f".. py:class:: {name}", "   :no-index:", "", f"   The same as :py:class:`{homes[thing]}`.", ""]
        return class_entry(path, thing, homes)
    if isinstance(thing, (bool, int, float, str)):
        return [f".. py:data:: {name}", "", f"   ``{thing!r}``", ""]
    return [f".. autofunction:: {path}", ""] if hasattr(thing, "__name__") else [f".. py:data:: {name}", ""]


def families_entry(names: list[str]) -> list[str]:
    """Returns a sentence about families of classes over scalar types, with a place for each."""
    places = [line for name in names for line in (f".. py:data:: {name}", "   :no-typesetting:", "")]
    listed = ", ".join(f"``{name}``" for name in names)
    return [*places, f"``Name_[T]`` is the class for the scalar type T (float, AutoDiffXd, Expression): {listed}.", ""]


def summary(module: types.ModuleType, names: list[str], homes: dict[type, str]) -> list[str]:
    """Returns a table of names and what they are."""
    lines = [".. list-table::", "   :widths: 30 70", ""]
    for name in names:
        thing = getattr(module, name)
        path = homes[thing] if inspect.isclass(thing) else f"{module.__name__}.{name}"
        lines += [f"   * - :py:obj:`{name} <{path}>`", f"     - {first_lines(thing)}"]
    return [*lines, ""]


def page(module: types.ModuleType, homes: dict[type, str]) -> str:
    """Returns the page of a module."""
    title = module.__name__
    names = sorted(module.__all__, key=str.lower)
    families = [n for n in names if n.endswith("_")]
    classes = [n for n in names if inspect.isclass(getattr(module, n)) and n not in families]
    others = [n for n in names if n not in classes and n not in families]
    lines = [title, "=" * len(title), "", f".. automodule:: {title}", "   :no-members:", ""]
    for heading, some in (("Classes", classes), ("Functions and constants", others)):
        if some:
            lines += [heading, "-" * len(heading), "", *summary(module, some, homes)]
            lines += [line for name in some for line in entry(module, name, homes)]
    if families:
        lines += ["Other scalars", "-------------", "", *families_entry(families)]
    return "\n".join(lines) + "\n"


def shorter(text: str | None) -> str | None:
    """Returns a signature, or what a call returns, without annotations that say nothing."""
    if text is None or re.fullmatch(r"~?(typing\.)?(Any|None)", text):
        return None
    # A nested `Config` is one of many: its name alone would lead to any of them.
    return re.sub(r"(: ~?[\w.]*\b(Any|Config)(?=[,)\s])| = <[^>]*>)", "", text).replace("*args, **kwargs", "...")


def write(folder: pathlib.Path) -> list[str]:
    """Writes the pages and their index into a folder; returns the names of the modules."""
    modules = public_modules()
    homes = public_classes(modules)
    folder.mkdir(parents=True, exist_ok=True)
    rows = [".. list-table::", "   :widths: 35 65", ""]
    for module in modules:
        (folder / f"{module.__name__}.rst").write_text(page(module, homes), encoding="utf-8")
        rows += [f"   * - :doc:`{module.__name__}`", f"     - {first_lines(module)}"]
    names = [module.__name__ for module in modules]
    toctree = [".. toctree::", "   :hidden:", "", *(f"   {name.partition('.')[2]} <{name}>" for name in names), ""]
    text = ["API reference", "=============", "", *rows, "", *toctree]
    (folder / "index.rst").write_text("\n".join(text), encoding="utf-8")
    return names
