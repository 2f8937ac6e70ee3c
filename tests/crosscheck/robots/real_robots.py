"""Where the real robots are that the tests read: the package example-robot-data (`python dev.py robots`)."""

from __future__ import annotations

import importlib.metadata
import os
import pathlib


def robots_folder() -> pathlib.Path | None:
    """The folder of robots of example-robot-data (or SHELDRAKE_ROBOTS), None without them."""
    if "SHELDRAKE_ROBOTS" in os.environ:
        return pathlib.Path(os.environ["SHELDRAKE_ROBOTS"])
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        return None
    for file in files:
        parts = file.parts
        if "example-robot-data" in parts and "robots" in parts:
            return pathlib.Path(file.locate()).parents[len(parts) - parts.index("robots") - 2]
    return None


def robot_files(*kinds: str) -> list[pathlib.Path]:
    """All descriptions of real robots that are installed, of some kinds of file."""
    folder = robots_folder()
    return sorted(path for kind in kinds for path in folder.rglob(f"*.{kind}")) if folder else []
