"""Fingerprints of the package's kernels, kept on disk for as long as none of the files that decide them has changed.

To hash a kernel with all that it calls takes as long as to load its machine code.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import json
import os
import pathlib
import time
from typing import TYPE_CHECKING

from sheldrake.common._native import disk_cache, sanitizer
from sheldrake.common._native.source import PACKAGE, source_files, stamps

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

_BEGAN = time.time_ns()  # before any kernel is asked for; files that are younger may be others than those imported
_SURE = 2_000_000_000  # [ns] by which clocks of file systems may be behind


def is_kept(kernel: Kernel) -> bool:
    """Whether a kernel's code is that of a file of the package, compiled as usual."""
    usual = os.environ.get("SHELDRAKE_BOUNDSCHECK", "0") == "0" and not sanitizer.SANITIZED
    return usual and kernel.py_func.__code__.co_filename.startswith(f"{PACKAGE}{os.sep}")


class Fingerprints:
    """By the kernels' qualified names; those that are added are written when the process ends.

    Args:
        path: The file.
    """

    def __init__(self, path: pathlib.Path):
        self._path, self._is_new = path, False
        self._known: dict[str, str] = {}
        try:
            kept = json.loads(disk_cache.read(path) or b"{}")
            if kept and stamps(f"{PACKAGE}/{name}" for name in kept["files"]) == list(kept["files"].values()):
                self._known = kept["fingerprints"]
        except (OSError, ValueError):
            pass  # a file is gone

    def get(self, name: str) -> str | None:
        """The fingerprint of a kernel, if it is known."""
        return self._known.get(name)

    def add(self, name: str, fingerprint: str) -> str:
        """Notes a fingerprint, and gives it back."""
        self._known[name] = fingerprint
        if not self._is_new:
            self._is_new = True
            atexit.register(self.write)
        return fingerprint

    def write(self) -> None:
        """Keeps what is known, unless a file was written since this process began: it may have imported it before."""
        try:
            files = source_files()
            found = stamps(files)
            if max(max(times[:2]) for times in found) > _BEGAN - _SURE:
                return
        except OSError:
            return
        names = (file.relative_to(PACKAGE).as_posix() for file in files)
        kept = {"files": dict(zip(names, found)), "fingerprints": self._known}
        disk_cache.write(self._path, json.dumps(kept).encode())


@functools.cache
def of_files(folder: pathlib.Path) -> Fingerprints:
    """Those that a cache folder keeps of this installation."""
    return Fingerprints(folder / f"fingerprints-{hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:20]}.json")
