"""Arrays that take long to make, kept on disk by what they are made of."""

from __future__ import annotations

import functools
import hashlib
import io
import pathlib
from collections.abc import Callable, Iterable

import numpy as np

from sheldrake.common._native import disk_cache, private_files


def cached_arrays(
    name: str,
    made_by: tuple[str, ...],
    made_of: Iterable[bytes],
    make: Callable[[], tuple[np.ndarray, ...]],
) -> tuple[np.ndarray, ...]:
    """The arrays that `make` gives, from the user's cache folder where a process has made them of the same before.

    Args:
        name: What they are, the beginning of the file's name.
        made_by: Files of source whose change makes other arrays.
        made_of: All else that they depend on.
        make: Is called when they are not kept yet, or what was kept is damaged.
    """
    digest = hashlib.sha256(repr((np.__version__, _hash_of(made_by))).encode())
    for part in made_of:
        digest.update(len(part).to_bytes(8, "little") + part)
    path = private_files.root() / "arrays" / f"{name}-{digest.hexdigest()[:32]}"
    data = disk_cache.read(path)
    if data is not None:
        return _unpacked(data)
    arrays = make()
    disk_cache.write(path, _packed(arrays))
    return arrays


@functools.cache
def _hash_of(files: tuple[str, ...]) -> str:
    return hashlib.sha256(b"".join(pathlib.Path(file).read_bytes() for file in files)).hexdigest()


def _packed(arrays: tuple[np.ndarray, ...]) -> bytes:
    file = io.BytesIO()
    for array in arrays:
        np.save(file, array, allow_pickle=False)
    return file.getvalue()


def _unpacked(data: bytes) -> tuple[np.ndarray, ...]:
    file, arrays = io.BytesIO(data), []
    while file.tell() < len(data):
        arrays.append(np.load(file, allow_pickle=False))
    return tuple(arrays)
