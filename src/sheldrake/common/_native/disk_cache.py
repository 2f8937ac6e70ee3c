"""Files in the user's cache folder that prove to be whole: each begins with a hash of the rest.

They are written beside their place and renamed, so processes may race; a folder that cannot be written only costs time.
"""

from __future__ import annotations

import functools
import hashlib
import pathlib
import time
import warnings

from sheldrake.common._native import private_files

DAY, UNUSED = 86_400.0, 90 * 86_400.0  # [s]
FOLDERS = ("abi*", "arrays", "seals")
"""What the cache folder holds: kernels by Python, compiler and processor; arrays; what was found of libraries."""
MOST_IN_A_FOLDER = 1 << 29
"""Bytes that a folder may hold when a process begins to write to it; what was not used for longest goes first."""


def read(path: pathlib.Path) -> bytes | None:
    """What was written to `path`, or None when there is nothing or it is damaged."""
    try:
        data = private_files.read(path)
        if data is not None and time.time() - path.stat().st_mtime > DAY:
            path.touch()  # what is in use does not grow old
    except OSError:
        return None
    if data is None:
        return None
    return data[32:] if hashlib.sha256(data[32:]).digest() == data[:32] else None


def write(path: pathlib.Path, data: bytes) -> None:
    """Keeps data in a file; where that fails, a warning says so once."""
    if not private_files.is_trusted(path.parent):
        return
    try:
        private_files.write(path, hashlib.sha256(data).digest() + data)
    except OSError as error:
        _warn_once(str(path.parent), str(error))
    else:
        prune(path.parents[1])


@functools.cache
def prune(root: pathlib.Path) -> None:
    """Removes what no process has read for three months (other versions' kernels, files that a crash left), and of
    folders that hold too much what was not read for longest.
    """
    for pattern in FOLDERS:
        for folder in root.glob(pattern):
            _prune_folder(folder)


def _prune_folder(folder: pathlib.Path) -> None:
    now, held = time.time(), 0
    for age, size, file in sorted(_files(folder, now)):
        held += size
        if age > UNUSED or held > MOST_IN_A_FOLDER:
            try:
                file.unlink()
                folder.rmdir()  # refuses while files are left
            except OSError:
                continue


def _files(folder: pathlib.Path, now: float) -> list[tuple[float, int, pathlib.Path]]:
    """Age [s] and size [bytes] of each file."""
    found = []
    for file in folder.iterdir():
        try:
            status = file.stat()
        except OSError:
            continue  # another process removed it
        found.append((now - status.st_mtime, status.st_size, file))
    return found


@functools.cache
def _warn_once(folder: str, reason: str) -> None:
    warnings.warn(
        f"Compiled kernels and hulls cannot be kept in {folder} ({reason}): each process makes them anew.", stacklevel=2
    )
