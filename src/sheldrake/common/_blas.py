"""How many threads NumPy's and SciPy's linear algebra takes."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

_SPELLINGS = [(prefix, suffix) for prefix in ("scipy_openblas", "openblas") for suffix in ("64_", "")]


class _Library(NamedTuple):
    get: Callable[[], int]
    set: Callable[[int], None]


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Inside, matrices are factored by one thread, where that is up to OpenBLAS.

    For matrices of some 100 rows a second thread gains little when there is a processor for it; on a busy machine, or
    where a container has fewer processors than it sees, each factorisation waits for it: 100 ms instead of 0.5.
    The number is one for the whole process: the first that comes in sets it, the last that leaves sets it back.
    """
    libraries = _libraries()
    with _INSIDE.lock:
        if not _INSIDE.count:
            _INSIDE.before = [library.get() for library in libraries]
            for library in libraries:
                library.set(1)
        _INSIDE.count += 1
    try:
        yield
    finally:
        with _INSIDE.lock:
            _INSIDE.count -= 1
            if not _INSIDE.count:
                for library, count in zip(libraries, _INSIDE.before):
                    library.set(count)


class _Inside:
    """How many threads are inside of `one_thread`, and the numbers from before."""

    def __init__(self) -> None:
        self.lock, self.count, self.before = threading.Lock(), 0, list[int]()


_INSIDE = _Inside()


@functools.cache
def _libraries() -> list[_Library]:
    """OpenBLAS as the wheels of NumPy and SciPy bring it; none where they use something else."""
    import numpy
    import scipy  # whose parts would take long to load, and need not be there for its library to be

    found = []
    for module in (numpy, scipy):
        package = Path(str(module.__file__)).parent
        for folder in (package.parent / f"{package.name}.libs", package / ".dylibs"):
            found += [_functions(path) for path in sorted(folder.glob("*openblas*"))]
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
