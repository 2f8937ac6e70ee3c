"""How many threads NumPy's and SciPy's linear algebra takes."""

from __future__ import annotations

import contextlib
import ctypes
import dataclasses
import functools
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

_SPELLINGS = [(prefix, suffix) for prefix in ("scipy_openblas", "openblas") for suffix in ("64_", "")]


@dataclasses.dataclass(frozen=True, eq=False)
class _Library:
    get: Callable[[], int]
    set: Callable[[int], None]


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Inside, matrices are factored by one thread, where that is up to OpenBLAS.

    For matrices of some 100 rows a second thread gains little when there is a processor for it; on a busy machine, or
    where a container has fewer processors than it sees, each factorisation waits for it: 100 ms instead of 0.5.
    The number is one for the whole process: the first that comes in sets it, the last that leaves sets it back. SciPy's
    linear algebra counts if it is loaded.
    """
    with _INSIDE.lock:
        for library in _libraries():
            if library not in _INSIDE.before:
                _INSIDE.before[library] = library.get()
                library.set(1)
        _INSIDE.count += 1
    try:
        yield
    finally:
        with _INSIDE.lock:
            _INSIDE.count -= 1
            if not _INSIDE.count:
                for library, count in _INSIDE.before.items():
                    library.set(count)
                _INSIDE.before.clear()


class _Inside:
    """How many threads are inside of `one_thread`, and the numbers from before."""

    def __init__(self) -> None:
        self.lock, self.count, self.before = threading.Lock(), 0, dict[_Library, int]()


_INSIDE = _Inside()


def _libraries() -> list[_Library]:
    """OpenBLAS as the wheels of NumPy and SciPy bring it, if they are loaded; none where they use something else."""
    return [library for name, part in _PARTS.items() if part in sys.modules for library in _libraries_of(name)]


_PARTS = {"numpy": "numpy", "scipy": "scipy.linalg"}


@functools.cache
def _libraries_of(name: str) -> list[_Library]:
    package = Path(str(sys.modules[name].__file__)).parent
    folders = package.parent / f"{name}.libs", package / ".dylibs"
    found = [_functions(path) for folder in folders for path in sorted(folder.glob("*openblas*"))]
    return [library for library in found if library is not None]


def _functions(path: Path) -> _Library | None:
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        return None
    for prefix, suffix in _SPELLINGS:
        get = getattr(library, f"{prefix}_get_num_threads{suffix}", None)
        set_ = getattr(library, f"{prefix}_set_num_threads{suffix}", None)
        if get is not None and set_ is not None:
            return _Library(get, set_)
    return None
