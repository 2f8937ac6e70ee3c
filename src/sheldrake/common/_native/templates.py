"""Blocks of queries that were bound before, for other arrays of the same shapes: only addresses are written anew.

Contexts of systems that are built alike ask the same kernels of memory that is laid out alike. Their blocks
(`builtin`) differ in where that memory is: a template has all else, and what stands at each address relative to the
array it belongs to.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sheldrake.common._native.binding import HERE, Words

_MOST = 512
"""How many templates are kept of systems that are built alike; what is bound beyond them is bound the long way."""
_MOST_KINDS = 64
"""Of how many kinds of systems they are kept."""


class Packed:
    """A NamedTuple of arrays as one memory, of which a copy costs one copy.

    Args:
        blank: What copies hold at first, C-contiguous arrays of floats.
    """

    def __init__(self, blank: Any) -> None:
        self._cls = type(blank)
        self._memory = np.concatenate([array.ravel() for array in blank])
        ends = np.cumsum([array.size for array in blank]).tolist()
        self._parts = [(end - array.size, end, array.shape) for end, array in zip(ends, blank)]

    @property
    def size(self) -> int:
        """Numbers in a copy."""
        return self._memory.size

    def new(self) -> tuple[Any, np.ndarray]:
        """A copy, and its memory."""
        memory = self._memory.copy()
        return self._cls(*[memory[begin:end].reshape(shape) for begin, end, shape in self._parts]), memory


class Sites(NamedTuple):
    """Arguments of a call: what another call must have in common, and the arrays it may have elsewhere."""

    common: tuple
    begins: list[int]
    """Addresses of those arrays [doubles]."""
    owners: list[int]
    """Of all arrays, in order: which of `begins` they are relative to."""


class _Template(NamedTuple):
    words: np.ndarray
    at: np.ndarray
    of: np.ndarray
    scale: np.ndarray
    """8 where an address is in bytes, 1 where in doubles."""


_kinds: dict[tuple, dict[tuple, _Template]] = {}
"""What is known, by the shapes of models; the oldest go first."""


def _templates_of(kind: tuple) -> dict[tuple, _Template]:
    known = _kinds.get(kind)
    if known is None:
        if len(_kinds) >= _MOST_KINDS:
            _kinds.pop(next(iter(_kinds)), None)  # another thread may have taken it out
        known = _kinds[kind] = {}
    return known


def _form(a: np.ndarray) -> tuple:
    return a.dtype, a.shape, a.flags.c_contiguous and a.flags.aligned


class Templates:
    """What was bound for one context of a system, for all others, and for those of systems with models of its shapes.

    Args:
        fixed: NamedTuples that are the same for all contexts of a system: models. They are kept.
    """

    def __init__(self, *fixed: Any) -> None:
        self._fixed = {id(model): (k, model, [HERE.place(a) >> 3 for a in model]) for k, model in enumerate(fixed)}
        self._known = _templates_of(tuple((type(model), *map(_form, model)) for model in fixed))

    def __reduce__(self) -> tuple:
        return Templates, tuple(model for _, model, _ in self._fixed.values())  # a copy has its own addresses

    def sites(self, args: tuple, packed: tuple[Any, np.ndarray]) -> Sites | None:
        """Where the arguments of a call are; None if an array cannot be written or is not in order.

        Args:
            args: The arguments.
            packed: A NamedTuple that may be among them, and the memory in which all its arrays are, as in `Packed`.
        """
        common: list[Any] = []
        begins: list[int] = []
        owners: list[int] = []
        for arg in args:
            if type(arg) is np.ndarray:
                parts: tuple = (arg,)
            elif (fixed := self._fixed.get(id(arg))) is not None:
                number, _, places = fixed
                common.append(number)
                owners += range(len(begins), len(begins) + len(places))
                begins += places
                continue
            elif arg is packed[0]:
                owners += [len(begins)] * len(arg)
                common.append(type(arg))
                begins.append(HERE.place(packed[1]) >> 3)
                continue
            elif isinstance(arg, tuple):
                parts = arg
                common.append(type(arg))
            else:
                parts = (arg,)
            for part in parts:
                if not isinstance(part, np.ndarray):
                    common.append(part.hex() if isinstance(part, float) else part)  # -0.0 is not 0.0
                    continue
                if not part.flags.carray:
                    return None
                common += part.dtype, part.shape
                owners.append(len(begins))
                begins.append(HERE.place(part) >> 3)
        return Sites(tuple(common), begins, owners)

    def filled(self, key: tuple, begins: list[int]) -> np.ndarray | None:
        """New words of what was kept by `key`, for arrays that begin there; None if nothing was."""
        found = self._known.get(key)
        if found is None:
            return None
        words = found.words.copy()
        words[found.at] += np.array(begins)[found.of] * found.scale
        return words

    def keep(self, key: tuple, words: np.ndarray, described: Words, sites: Sites) -> None:
        """Keeps words for others.

        Args:
            key: What those have in common with this one, `Sites.common` among it.
            words: Complete; those of the kernel's arguments are the last.
            described: These, with a relocation for each array.
            sites: Of the same call.
        """
        if len(self._known) >= _MOST:
            return
        first = len(words) - len(described.words)
        at = np.array([first + r.at for r in described.relocations], np.int64)
        scale = np.array([8 if r.absolute else 1 for r in described.relocations], np.int64)
        of = np.array(sites.owners, np.int64)
        relative = words.copy()
        relative[at] -= np.array(sites.begins, np.int64)[of] * scale
        self._known[key] = _Template(relative, at, of, scale)
