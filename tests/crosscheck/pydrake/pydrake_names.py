"""Lists the public names of every module of an installed pydrake.

    python tests/crosscheck/pydrake/pydrake_names.py --write

writes them to the table from which sheldrake tells a name that Drake has from a misspelt one.
"""

import contextlib
import importlib
import inspect
import io
import json
import pathlib
import pkgutil
import sys
import warnings

TABLE = pathlib.Path(__file__).parents[3] / "src" / "sheldrake" / "_pydrake" / "names.json"
SKIPPED = ("pydrake.all", "pydrake.tutorials", "pydrake.lib", "pydrake.share", "pydrake.doc")
FROM_TYPING = {"Dict", "List", "Optional", "Union"}


def modules():
    """Names of the modules of pydrake, without `pydrake.` in front; bindings hide their modules from pkgutil."""
    import pydrake

    found = {"pydrake"}
    root = pathlib.Path(pydrake.__file__).parent
    for info in pkgutil.walk_packages([str(root)], "pydrake."):
        found.add(info.name)
    for stub in root.rglob("*.pyi"):
        parts = stub.relative_to(root).with_suffix("").parts
        found.add(".".join(["pydrake", *(p for p in parts if p != "__init__")]))
    return sorted(
        name
        for name in found
        if not name.startswith(SKIPPED)
        and not name.endswith(".all")
        and not any(part.startswith("_") for part in name.split("."))
    )


def public_names(module):
    """What a user gets from the module: its classes, functions and constants, not what it imported."""
    names = []
    for name, value in vars(module).items():
        if name.startswith("_") or not name.isascii() or name in FROM_TYPING or inspect.ismodule(value):
            continue
        if not str(getattr(value, "__module__", None) or "pydrake").startswith("pydrake"):
            continue
        if module.__name__.endswith("jupyter_widgets") and value.__module__ != module.__name__:
            continue  # Python modules without a list of their own names
        if isinstance(value, (int, float, str)) and not name[0].isupper() and not name.startswith("k"):
            continue
        names.append(name)
    return sorted(names)


def table():
    out = {}
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        for name in modules():
            try:
                out[name] = public_names(importlib.import_module(name))
            except ImportError:  # It needs something that is not installed (gym, ipywidgets).
                out[name] = []
    return out


if __name__ == "__main__":
    text = json.dumps(table(), indent=0, separators=(",", ":")).replace('",\n"', '", "')
    if "--write" in sys.argv:
        TABLE.write_text(text + "\n")
    else:
        print(text)
