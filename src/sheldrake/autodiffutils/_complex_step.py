"""Dual numbers as complex numbers, one direction at a time, for kernels compiled on complex arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.autodiffutils._matrices import alike
from sheldrake.common._kernels import sweep as sweep_kernel
from sheldrake.common._native.binding import HERE, arguments, imaginary_parts, join
from sheldrake.common.chain import bound_to_all_memory
from sheldrake.common.kernel import Kernel

PATIENCE = 200
"""Calls as Python before machine code is made."""

Copies = Sequence[tuple[np.ndarray, np.ndarray]]

_MOST_PLANS = 16
_NONE = np.zeros((0, 0))


class Source:
    """Duals that kernels read, and the complex numbers that stand for them.

    Args:
        duals: AutoDiffXd or numbers.
        counter: Changes whenever the duals may have, shape (1,); None: they are read every time.
        numbers: Where the complex numbers go, C-contiguous; None: an array of their own.

    Attributes:
        n: How many derivatives the duals have; -1: not all the same number.
        places: Where the imaginary parts of those with derivatives are, as addresses by eight.
        slopes: Their derivatives, one row each.
    """

    def __init__(self, duals: np.ndarray, counter: np.ndarray | None = None, numbers: np.ndarray | None = None):
        self.duals, self.counter = duals, counter
        self.numbers = np.zeros(duals.shape, complex) if numbers is None else numbers
        self.seen: Any = None
        self.n, self.slopes = 0, _NONE
        self._all_places = imaginary_parts(self.numbers)
        self.places = self._all_places[:0]

    def read(self) -> int:
        """Reads the duals if they may have changed; gives `n`."""
        if self.counter is not None:
            now = self.counter.item()
            if self.seen == now:
                return self.n
            self.seen = now
        found = self.duals.ravel().tolist()
        if self.duals.dtype != object:
            self._set(found, _NONE, self._all_places[:0])
            return 0
        same = alike(found)
        if same is not None:
            self._set(*same, self._all_places)
            return self.n
        having = [i for i, a in enumerate(found) if type(a) is AutoDiffXd and a._d is not None]
        slopes = [found[i]._d for i in having]
        as_many = len(set(map(len, slopes))) < 2
        gradient = np.array(slopes) if as_many and having else _NONE
        self._set([getattr(a, "_v", a) for a in found], gradient, self._all_places[having])
        if not as_many:
            self.n = -1
        return self.n

    def _set(self, values: list[float], slopes: np.ndarray, places: np.ndarray) -> None:
        self.numbers.reshape(-1)[:] = values
        self.places, self.slopes, self.n = places, slopes, slopes.shape[1]


class Sweep:
    """Rows of machine code on complex numbers, run for all derivatives at once.

    Args:
        rows: Kernels on complex arrays and their arguments, in the order in which they run.
        outputs: Imaginary parts of the numbers whose derivatives are wanted (`imaginary_parts`).
        resets: Pairs of arrays: the second is copied to the first before the first direction. (What rows leave in
            scratch in one direction is nothing to the next, as what one step leaves is nothing to the next step.)
        copies: The same, before each direction.
    """

    def __init__(
        self,
        rows: list[tuple[Kernel, tuple]],
        outputs: np.ndarray,
        resets: Copies = (),
        copies: Copies = (),
    ):
        blocks: dict = {}
        words, at = join(arguments(kernel.on_complex, given, blocks, HERE)[0] for kernel, given in rows)
        self._rows = np.array([HERE.address(kernel.on_complex) for kernel, _ in rows], np.int64)
        self._words, self._at = words.words, np.array(at[:-1], np.int64)
        self._resets, self._copies = _table(resets), _table(copies)
        self._outputs = outputs
        self._keep, self._resets_of_arrays = (rows, copies), resets
        self._beginnings: list[Copies] = []
        self._plans: dict[Any, tuple[Any, np.ndarray, np.ndarray]] = {}
        self._point_plans: dict[Any, tuple[Any, np.ndarray, np.ndarray, np.ndarray]] = {}

    def run(self, t: float, places: np.ndarray, by_inputs: list[np.ndarray], n: int) -> np.ndarray | int:
        """Derivatives of the outputs, one row each, shape (outputs, n); or a status that is not 0.

        Args:
            t: Time.
            places: Imaginary parts of the inputs (`imaginary_parts`).
            by_inputs: Derivatives of the inputs: arrays of n columns, one below the other.
            n: How many derivatives there are.
        """
        key = places.tobytes(), n
        plan = self._plans.get(key) or self._plan(key, places, n)
        call, given, slopes = plan
        if len(by_inputs) == 1:
            given[:] = by_inputs[0]
        elif by_inputs:
            np.concatenate(by_inputs, out=given)
        return call.func(t, *call.args[1:]) or slopes.copy()

    def beginning(self, copies: Copies) -> np.ndarray:
        """What `run_points` copies before the first point: this, and what is reset; the arrays are kept alive."""
        self._beginnings.append(copies)
        return _table([*copies, *self._resets_of_arrays])

    def run_points(
        self, t: float, beginning: np.ndarray, places: np.ndarray, points: np.ndarray, with_slopes: bool
    ) -> tuple[np.ndarray, np.ndarray] | int:
        """Values of the outputs at many points and, if wanted, their derivatives; or a status that is not 0.

        Args:
            t: Time.
            beginning: Made by `beginning`.
            places: Imaginary parts of the inputs (`imaginary_parts`).
            points: Values of the inputs, shape (points, inputs).
            with_slopes: Whether derivatives are wanted.

        Returns:
            Shapes (points, outputs) and (points, outputs, inputs), the latter (points, 0, inputs) if not wanted.
        """
        outputs, inputs = len(self._outputs) if with_slopes else 0, len(places)
        key = id(beginning), places.tobytes(), len(points), with_slopes
        plan = self._point_plans.get(key)
        if plan is None:
            if len(self._point_plans) >= _MOST_PLANS:
                self._point_plans.clear()
            given, values = np.zeros((len(points), inputs)), np.zeros((len(points), len(self._outputs)))
            slopes = np.zeros((len(points), outputs * inputs))
            table = self._rows, self._words, self._at, beginning, self._copies
            call = bound_to_all_memory(sweep_kernel.sweep_points, *table, places, given, self._outputs, values, slopes)
            plan = self._point_plans[key] = call, given, values, slopes
        call, given, values, slopes = plan
        given[:] = points
        status = call.func(t, *call.args[1:])
        return status or (values.copy(), slopes.reshape(len(points), outputs, inputs).copy())

    def _plan(self, key: Any, places: np.ndarray, n: int) -> tuple[Any, np.ndarray, np.ndarray]:
        if len(self._plans) >= _MOST_PLANS:
            self._plans.clear()
        given, slopes = np.zeros((len(places), n)), np.zeros((len(self._outputs), n))
        table = self._rows, self._words, self._at, self._resets, self._copies
        call = bound_to_all_memory(sweep_kernel.sweep, *table, places, given, self._outputs, slopes)
        plan = self._plans[key] = call, given, slopes
        return plan


def sweep_sources(sweep: Sweep, sources: list[Source], t: float = 0.0) -> np.ndarray | int | None:
    """Derivatives of a sweep's outputs by what its sources' duals are functions of.

    Returns:
        As `Sweep.run`; None, and nothing has run, where the duals' derivatives are not all as many.
    """
    n = 0
    having = []
    for source in sources:
        count = source.read()
        if count:
            if count < 0 or n not in (0, count):
                return None
            n = count
            having.append(source)
    if len(having) == 1:
        places = having[0].places
    else:
        places = np.concatenate([s.places for s in having]) if having else np.zeros(0, np.int64)
    return sweep.run(t, places, [s.slopes for s in having], n)


def _table(copies: Copies) -> np.ndarray:
    rows = [(HERE.place(to) >> 3, HERE.place(start) >> 3, to.nbytes >> 3) for to, start in copies]
    return np.array(rows, np.int64).reshape(-1, 3)
