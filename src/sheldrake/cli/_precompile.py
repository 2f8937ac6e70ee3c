"""`sheldrake precompile`: compiles every entry kernel into the user's cache folder."""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
from collections.abc import Iterator
from typing import Any

import sheldrake
from sheldrake.cli._output import reporting


def run(args: argparse.Namespace) -> int:
    """Compiles what is not compiled yet, with a progress bar, and says what failed."""
    kernels = list(entry_kernels())
    names = [f"{kernel.__module__}.{kernel.__qualname__}" for kernel in kernels]
    with reporting(args) as told:
        failures = [] if args.list else _compile(kernels)
        for line in names if args.list else failures:
            print(line)
        told |= {"kernels": names, "failures": failures}
    return 1 if failures else 0


def _compile(kernels: list[Any]) -> list[str]:
    """Compiles kernels with a progress bar; what failed, and why."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    os.environ["SHELDRAKE_QUIET"] = "1"
    console = Console()
    failures = []
    columns = (TextColumn("{task.description:<32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("", total=len(kernels))
        for kernel in kernels:
            progress.update(task, description=kernel.__name__)
            try:
                _ = kernel.address  # asking for it compiles
            except Exception as error:  # One kernel that fails must not keep the others from being ready.
                failures.append(f"{kernel!r}: {type(error).__name__}: {error}")
            progress.advance(task)
        progress.update(task, description="done")
    return failures


def entry_kernels() -> Iterator[Any]:
    """Every entry kernel of the package."""
    from sheldrake.common.kernel import Kernel

    seen: set[int] = set()
    for module in _modules():
        for value in vars(module).values():
            if isinstance(value, Kernel) and value.top and id(value) not in seen:
                seen.add(id(value))
                yield value


def _modules() -> Iterator[Any]:
    for info in pkgutil.walk_packages(sheldrake.__path__, "sheldrake."):
        parts = info.name.split(".")
        if "cli" not in parts and "as_pydrake" not in parts and "__main__" not in parts and "all" not in parts:
            yield importlib.import_module(info.name)
