"""Kernels from text, as cells of notebooks are: the source is in `linecache` alone."""

from __future__ import annotations

import itertools
import linecache

import numpy as np
from tools.fuzz_kernels import Both, Options, Table, compiled

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, Vectors, kernel

_count = itertools.count()


def module_of(text, **names):
    """What a text defines, with the names of kernels' parameters in it."""
    path = f"<cell {next(_count)}>"
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    known = (IntMatrix, IntVector, Matrix, Vector, Vectors, kernel, Both, Options, Table, np)
    titles = "IntMatrix IntVector Matrix Vector Vectors kernel Both Options Table np".split()
    scope = {"__name__": "cell", **dict(zip(titles, known)), **names}
    exec(compile(text, path, "exec", dont_inherit=True), scope)
    return scope


def run(kernel_, *args):
    """Status of a kernel that is compiled now, on arrays."""
    from sheldrake.common._native.binding import arguments

    words = arguments(kernel_, args)[0].placed()
    return compiled(kernel_)(0.0, None, words.ctypes.data)


def value_of(expression, *, ints=(), floats=(), strict=True):
    """Value of an expression of n[0], n[1] ... and x[0], x[1] ...: an int or float."""
    text = f"@kernel(top=True, strict={strict})\ndef entry(n: IntVector, x: Vector, N: IntVector, X: Vector):\n"
    of_ints, of_floats = np.array([*ints, 0], np.int64), np.array([*floats, 0.0])
    for whole in (True, False):
        scope = module_of(f"{text}    {'N' if whole else 'X'}[0] = {expression}\n")
        N, X = np.zeros(1, np.int64), np.zeros(1)
        try:
            run(scope["entry"], of_ints, of_floats, N, X)
        except TypeError as error:
            if not whole or "is stored where there is room for int" not in str(error):
                raise
        else:
            return int(N[0]) if whole else float(X[0])
    raise AssertionError
