"""Derivatives of what kernels compute from the numbers of a context, without converting a system or its context."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils._complex_step import Sweep
from sheldrake.common._native.binding import imaginary_parts
from sheldrake.common._scalars import autodiff_class
from sheldrake.systems.framework._declarations import DERIVATIVES, DISCRETE, OUTPUT, Stages
from sheldrake.systems.framework._engine import complex_rows
from sheldrake.systems.framework._engine.scratch import arrays_of, views_of

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._engine.layout import Row
    from sheldrake.systems.framework._engine.store import Store
    from sheldrake.systems.framework._system import System


def motion_by_rows(
    system: System, context: Context, n: int, i: int | None, j: int | None, period: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """x' or x+ and y, and their derivatives by x and u, from the kernels that compute them.

    Args:
        system: The system, of floats.
        context: Its root context.
        n: How many numbers x has; 0: neither x' nor x+ is wanted.
        i: Number of the input port u, or None.
        j: Number of the output port y, or None.
        period: Whether x is discrete.

    Returns:
        Shapes (n + ny,) and (n + ny, n + nu); None where others than kernels, or kernels not for every scalar, compute
        them.
    """
    found = rows_of_motion(system, context, n, i, j, period)
    return None if found is None else found[0].evaluate(*found[1:])


def rows_of_motion(
    system: System, context: Context, n: int, i: int | None, j: int | None, period: float
) -> tuple[RowDerivatives, np.ndarray, np.ndarray] | None:
    """What `motion_by_rows` evaluates: the rows, and the places of (x, u) and of (x' or x+, y) in the slab."""
    store = context._store
    if store.systems[0] is not system or (i is not None and store.layout.input_slot(0, i).free < 0):
        return None
    kind = None if not n else DISCRETE if period else DERIVATIVES
    rows = linear_rows(store, kind, j)
    if rows is None:
        return None
    layout = store.layout
    x = np.arange(*(layout.xd if period else layout.xc))
    u = np.arange(*layout.input_slot(0, i).span) if i is not None else np.empty(0, int)
    y = np.arange(*layout.output_slot(0, j)[2].span) if j is not None else np.empty(0, int)
    moved = x + layout.plus if period else x + layout.xdot[0] - layout.xc[0]
    return rows, np.concatenate([x, u]), np.concatenate([moved, y])


def linear_rows(store: Store, kind: int | None, output: int | None) -> RowDerivatives | None:
    """The rows of a root context that make x' or x+, and an output port, ready for derivatives.

    Args:
        kind: DERIVATIVES, DISCRETE for the periodic updates, or None for neither.
        output: Number of a port, or None.

    Returns:
        None if they are not all kernels that run on every scalar.
    """
    key = ("linear", kind, output)
    found = store.chains.get(key)
    if found is None:
        numbers = _rows_for(store, kind, output)
        if numbers is None:
            return None
        found = store.chains[key] = ByDuals(store, [store.layout.rows[r] for r in numbers])
    if isinstance(found, ByDuals):
        rows = found.rows
        found = store.chains[key] = complex_rows.on_complex(store, rows, lambda: ByComplexSteps(store, rows)) or found
    return found


def _rows_for(store: Store, kind: int | None, output: int | None) -> list[int] | None:
    layout = store.layout
    program, rows = layout.program, []
    for g, (its_kind, clock, acting, _) in enumerate(layout.group_list):
        if its_kind == kind and (kind == DERIVATIVES or clock >= 0):
            rows += [
                *program.prerequisites[program.prerequisites_begin[g] : program.prerequisites_begin[g + 1]].tolist(),
                *acting,
            ]
    if output is not None:
        slot = layout.output_slot(0, output)[2]
        if not slot.vector:
            return None
        rows += layout.upstream([slot.row])
    for r in rows:
        if r < 0 or not _is_for_every_scalar(store.systems[layout.rows[r].node], layout.rows[r]):
            return None
    return list(dict.fromkeys(rows))


def _is_for_every_scalar(system: Any, row: Row) -> bool:
    if not row.native or row.output in system._float_kernels:
        return False
    declared = row.event.handler if row.event is not None else system._declared_derivatives
    if row.kind != OUTPUT and isinstance(declared, Stages) and declared.only_doubles:
        return False
    return system._complex_rows or (system._scalar_converter is None and system._is_generic())


class RowDerivatives:
    """Kernel rows that run on memory of another scalar, which has the slab's layout.

    Args:
        store: The memory of a context of numbers.
        rows: Kernel rows in the order in which they run.
    """

    _dtype: Any = object

    def __init__(self, store: Store, rows: list[Any]):
        self._store, self.rows = store, rows
        self._T = np.zeros(store.layout.size, self._dtype)
        self._initial: list[tuple[np.ndarray, Any]] = []
        scratch = {n: self._take_scratch(n) for n in {row.node for row in rows}}
        self._bind([store.arguments_of(row, self._T, scratch[row.node]) for row in rows])

    def _take_scratch(self, n: int) -> Any:
        at, prototype = self._store.layout.places[n].work[0], self._store.layout.prototypes[n]
        scratch = views_of(self._T, at, prototype)
        if isinstance(prototype, int):
            self._initial.append((scratch, 0.0))
        else:
            self._initial += zip(arrays_of(scratch), arrays_of(prototype))
        return scratch

    def asks_for_time(self) -> bool:
        """Whether any of the kernels does."""
        return any(row.calc.names[:1] == ("t",) for row in self.rows)

    def _bind(self, arguments: list[tuple]) -> None:
        """Gets ready to call the rows with these; None stands for time."""
        raise NotImplementedError

    def evaluate(self, seeds: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Values of the numbers `wanted` of the slab, and their derivatives by the numbers `seeds`.

        Returns:
            Shapes (len(wanted),) and (len(wanted), len(seeds)); None where a kernel objects to the values.

        Raises:
            RuntimeError: an input without a value is needed.
        """
        for row in self.rows:
            self._store.check_inputs(row)
        return self._evaluate(seeds, wanted)

    def _evaluate(self, seeds: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        raise NotImplementedError

    def _begin(self) -> None:
        self._T[:] = self._store.S
        for view, initial in self._initial:
            view[...] = initial

    def _begin_update(self) -> None:
        """x+ is x to begin with."""
        (a, b), plus = self._store.layout.xd, self._store.layout.plus
        self._T[a + plus : b + plus] = self._T[a:b]


class ByDuals(RowDerivatives):
    """The kernels as Python, on AutoDiffXd."""

    def _bind(self, arguments: list[tuple]) -> None:
        self._arguments = arguments

    def _evaluate(self, seeds: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        AutoDiff, T = autodiff_class(), self._T
        self._begin()
        T[seeds] = [AutoDiff(x, slope) for x, slope in zip(T[seeds], np.eye(len(seeds)))]
        self._begin_update()
        for row, arguments in zip(self.rows, self._arguments):
            if row.calc(*(T[0] if a is None else a for a in arguments)):
                return None
        return split(T[wanted], len(seeds))


class ByComplexSteps(RowDerivatives):
    """The kernels as machine code, on complex numbers: one run for each derivative."""

    _dtype = complex

    def _take_scratch(self, n: int) -> Any:
        layout = self._store.layout
        scratch, initial = complex_rows.complex_scratch(self._T, layout.places[n].work[0], layout.prototypes[n])
        self._initial += initial
        return scratch

    def _bind(self, arguments: list[tuple]) -> None:
        self._made = [
            (row.calc, tuple(0.0 if a is None else a for a in these)) for row, these in zip(self.rows, arguments)
        ]
        self._places = imaginary_parts(self._T)
        self._sweeps: dict[bytes, Sweep] = {}

    def _sweep_for(self, wanted: np.ndarray) -> Sweep:
        found = self._sweeps.get(wanted.tobytes())
        if found is None:
            (a, b), plus = self._store.layout.xd, self._store.layout.plus
            resets = [(view, complex_rows.as_complex(initial, view)) for view, initial in self._initial]
            copies = [(self._T[a + plus : b + plus], self._T[a:b])]
            found = self._sweeps[wanted.tobytes()] = Sweep(self._made, self._places[wanted], resets, copies)
        return found

    def function(self, seeds: np.ndarray, wanted: np.ndarray) -> Callable[[float, np.ndarray, bool], Any]:
        """The numbers `wanted` as a function of time and of the numbers `seeds`; all others are as they are now.

        It gives as `evaluate`, or no derivatives, shape (len(wanted), 0), if its last argument is False.
        """
        for row in self.rows:
            self._store.check_inputs(row)
        T, sweep, places = self._T, self._sweep_for(wanted), self._places[seeds]
        none, unit = places[:0], np.eye(len(seeds))
        others = self._store.S.astype(complex)

        def evaluate(t: float, numbers: np.ndarray, slopes: bool) -> tuple[np.ndarray, np.ndarray] | None:
            T[:] = others
            T[0], T[seeds] = t, numbers
            found = sweep.run(t, places, [unit], len(unit)) if slopes else sweep.run(t, none, [], 0)
            return None if isinstance(found, int) else (T.real[wanted], found)

        return evaluate

    def function_of_points(self, seeds: np.ndarray, wanted: np.ndarray) -> Callable[[np.ndarray, bool], Any]:
        """The same for many points at once and the time that is now; with shapes as those of `Sweep.run_points`."""
        for row in self.rows:
            self._store.check_inputs(row)
        T, sweep, places, t = self._T, self._sweep_for(wanted), self._places[seeds], float(self._store.S[0])
        beginning = sweep.beginning([(T, self._store.S.astype(complex))])

        def evaluate(points: np.ndarray, slopes: bool) -> tuple[np.ndarray, np.ndarray] | None:
            found = sweep.run_points(t, beginning, places, points, slopes)
            return None if isinstance(found, int) else found

        return evaluate

    def _evaluate(self, seeds: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        n, S = len(seeds), self._store.S
        self._T[:] = S
        slopes = self._sweep_for(wanted).run(float(S[0]), self._places[seeds], [np.eye(n)], n)
        return None if isinstance(slopes, int) else (self._T.real[wanted], slopes)


def split(duals: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Values of numbers or duals, shape (n,), and their derivatives, shape (n, size)."""
    values, slopes = np.zeros(len(duals)), np.zeros((len(duals), size))
    for k, x in enumerate(duals):
        if hasattr(x, "derivatives"):
            values[k], slope = x.value(), x.derivatives()
            slopes[k] = slope if len(slope) else 0.0
        else:
            values[k] = x
    return values, slopes
