"""`sheldrake run`: a script written for pydrake, as it is.

Installs the alias (`as_pydrake`), then runs the script as Python itself would.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import io
import os
import sys
import traceback
from types import CodeType, ModuleType, TracebackType

from sheldrake.cli import _spelling

_MODELS = (".urdf", ".sdf", ".xml", ".dmd.yaml", ".obj", ".stl")


def run(args: argparse.Namespace) -> int:
    """Runs the script under the pydrake alias and returns its exit status."""
    import sheldrake.as_pydrake  # noqa: F401  (what makes `import pydrake` mean sheldrake)

    _hints_on_one_line()
    try:
        code, filename, path, package = _module(args.script) if args.is_module else _script(args.script)
    except OSError as error:
        print(f"sheldrake {args.command}: {error}", file=sys.stderr)
        return 2
    except (ImportError, SyntaxError) as error:
        _say(error)
        return 2
    sys.argv = [filename, *args.arguments]
    sys.path.insert(0, path)
    return _execute(code, filename, package)


def _hints_on_one_line() -> None:
    """Warnings about retired names are printed without the source line, which the reader has."""
    import warnings

    from sheldrake.common.deprecation import DrakeDeprecationWarning

    standard = warnings.formatwarning

    def format_warning(
        message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
    ) -> str:
        if issubclass(category, DrakeDeprecationWarning):
            return f"{filename}:{lineno}: hint: {message}\n"
        return standard(message, category, filename, lineno, line)

    warnings.formatwarning = format_warning  # type: ignore[assignment]


def _script(name: str) -> tuple[CodeType, str, str, str | None]:
    """Code, file name and folder of a script, which is in no package."""
    if name == "-":
        return compile(sys.stdin.read(), "<stdin>", "exec", dont_inherit=True), "-", "", None
    if not os.path.isfile(name):
        raise FileNotFoundError(f"there is no file {name!r} (looked from {os.getcwd()}).")
    if name.lower().endswith(_MODELS):
        raise OSError(f"{name!r} is a model, not a script: `sheldrake view {name}` shows it, `demo` drops it.")
    with io.open_code(os.path.abspath(name)) as file:
        code = compile(file.read(), name, "exec", dont_inherit=True)  # not the annotations of here
    return code, name, os.path.dirname(os.path.abspath(name)), None


def _module(name: str) -> tuple[CodeType, str, str, str | None]:
    """Code, file name, the folder to import from, and the package of a module; of a package, its `__main__`."""
    if name.startswith("pydrake."):  # a tool of Drake's that is a module, such as pydrake.multibody.fix_inertia
        name = f"sheldrake.{name.removeprefix('pydrake.')}"
    sys.path.insert(0, os.getcwd())
    try:
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.submodule_search_locations is not None:
            spec = importlib.util.find_spec(f"{name}.__main__")
    finally:
        sys.path.pop(0)
    if spec is None or spec.loader is None or spec.origin is None:
        raise ImportError(f"sheldrake run: there is no module {name!r} that can be run.")
    code = spec.loader.get_code(spec.name)  # type: ignore[attr-defined]
    return code, spec.origin, os.getcwd(), spec.parent


def _execute(code: CodeType, filename: str, package: str | None) -> int:
    main = ModuleType("__main__")
    vars(main).update(__file__=filename, __builtins__=__builtins__, __spec__=None, __package__=package)
    previous = sys.modules["__main__"]
    sys.modules["__main__"] = main
    try:
        exec(code, vars(main))
    except KeyboardInterrupt as error:
        _say_where_interrupted(error.__traceback__)
        return 130
    except Exception as error:
        _say(error)
        return 1
    finally:
        sys.modules["__main__"] = previous
    return 0


def _say(error: BaseException) -> None:
    """Prints the error as Python does, from the script's own first line on, with a hint where one helps."""
    trace = _below_here(error.__traceback__)
    sys.stdout.flush()
    text = "".join(traceback.format_exception(type(error), error, trace))
    print(text, end="", file=sys.stderr)
    hint = _hint(error) or (None if "Did you mean" in text else _spelling.did_you_mean(error))
    if hint:
        print(f"Hint: {hint}", file=sys.stderr)


def _below_here(trace: TracebackType | None) -> TracebackType | None:
    """The part of a traceback below this file."""
    last = None
    step = trace
    while step is not None:
        if step.tb_frame.f_code.co_filename == __file__:
            last = step
        step = step.tb_next
    return trace if last is None else last.tb_next


def _hint(error: BaseException) -> str | None:
    """For a name of pydrake that the script uses but has not: where it is to be had, or that sheldrake lacks it."""
    from sheldrake._pydrake import alias, names

    name = (getattr(error, "name", None) or "") if isinstance(error, NameError) else ""
    modules = names.modules_with(name)
    for module in modules:
        try:
            found = hasattr(importlib.import_module(module), name)
        except ImportError:
            found = False
        if found:
            return f"write `from {module} import {name}`."
    return alias.missing_name(modules[0] if modules else "", name)


def _say_where_interrupted(trace: TracebackType | None) -> None:
    frames = traceback.extract_tb(_below_here(trace))
    where = f" at {frames[0].filename}:{frames[0].lineno}" if frames else ""
    print(f"\nInterrupted{where}.", file=sys.stderr)
