"""`sheldrake info`: what one needs to know to help, or to report a fault."""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import sys
from typing import Any

from sheldrake.cli._output import print_json

_PACKAGES = (
    "numpy",
    "scipy",
    "llvmlite",
    "viser",
    "trimesh",
    "matplotlib",
    "rich",
    "PyYAML",
    "sympy",
    "drake",
)
_VARIABLES = (
    "SHELDRAKE_CACHE_DIR",
    "SHELDRAKE_JIT",
    "SHELDRAKE_BOUNDSCHECK",
    "SHELDRAKE_SANITIZE",
    "SHELDRAKE_PREBUILT",
    "SHELDRAKE_QUIET",
)


def run(args: argparse.Namespace) -> int:
    """Prints versions, cache folder, compiled kernels and threads."""
    facts = collect()
    if args.json:
        print_json(facts)
        return 0
    width = max(map(len, facts))
    for name, value in facts.items():
        text = ", ".join(f"{k} {v}" for k, v in value.items()) or "none" if isinstance(value, dict) else str(value)
        print(f"{name:<{width}}  {text}")
    return 0


def collect() -> dict[str, Any]:
    """Everything `sheldrake info` tells, as JSON takes it."""
    from sheldrake import __version__
    from sheldrake.common.kernel import jit_enabled

    return {
        "sheldrake": __version__,
        "installed in": os.path.dirname(os.path.dirname(__file__)),
        "python": f"{platform.python_version()} ({sys.executable})",
        "platform": f"{platform.system()} {platform.release()} {platform.machine()}",
        "packages": {name: version for name in _PACKAGES if (version := _version(name))},
        "kernels": "compiled" if jit_enabled() else "plain Python (SHELDRAKE_JIT=0)",
        "prebuilt kernels": _prebuilt(),
        **_cache(),
        "threads": _threads(),
        "settings": {name: os.environ[name] for name in _VARIABLES if name in os.environ},
    }


def _prebuilt() -> str:
    """What the library that came with the wheel serves, or why there is none in use."""
    from sheldrake.common._native.prebuilt import library

    found, reason = library()
    return reason if found is None else f"{len(found.entries)}, processor level {found.level}"


def _cache() -> dict[str, Any]:
    """What this machine has compiled; needs llvmlite."""
    if _version("llvmlite") is None:
        return {"cache folder": "none: llvmlite is not installed (pip install 'sheldrake[kernels]' to compile kernels)"}
    from sheldrake.common._native.store import cache_folder

    folder = cache_folder()
    objects = list(folder.glob("*.o")) if folder.is_dir() else []
    return {
        "cache folder": str(folder),
        "compiled kernels": len(objects),
        "compiled size [MB]": round(sum(o.stat().st_size for o in objects) / 1e6, 1),
    }


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _threads() -> int:
    """Processor threads this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
