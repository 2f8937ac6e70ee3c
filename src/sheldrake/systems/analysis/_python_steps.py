"""Integrators whose steps are made in Python, and the simplest of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.analysis._rates import Rates
from sheldrake.systems.analysis._schemes import SCHEMES
from sheldrake.systems.framework._kernels import integrate as _integrate
from sheldrake.systems.framework._kernels import loop as _loop

if TYPE_CHECKING:
    from sheldrake.systems.analysis._span import Span
    from sheldrake.systems.framework import Context, System
    from sheldrake.systems.framework._engine.store import Store


class PythonIntegrator(IntegratorBase):
    """A step is made by `_step`, which may evaluate derivatives; the event loop does the rest."""

    _scheme = _integrate.PYTHON
    _rates_there: Rates | None = None

    def __init__(self, system: System, context: Context | None = None):
        self._set_up(system, context)

    def _rates_in(self, store: Store) -> Rates:
        """How velocities change positions in this context."""
        if self._rates_there is None or self._rates_there.memory is not store.S:
            self._rates_there = Rates(store)
        return self._rates_there

    def _derivatives(self, span: Span, t: float, x: np.ndarray) -> np.ndarray:
        """f(t, x)."""
        store = span.store
        store.S[slice(*store.layout.xc)] = x
        span.inside(_loop.derivatives_in_step, t)
        if store.side.status:
            raise _Stopped
        return store.S[slice(*store.layout.xdot)].copy()

    def _make_step(self, span: Span) -> None:
        """Steps by `h_try` [s], or less if that fails; leaves the state in the slab, length and error in `_numbers`."""
        store, numbers = span.store, self._numbers
        t, h = float(store.S[0]), float(numbers.h_try)
        x = store.S[slice(*store.layout.xc)].copy()
        try:
            found = self._step(span, t, x, h)
            while found is None:
                h = self._shorter(t, h)
                found = self._step(span, t, x, h)
        except _Stopped:  # a derivative failed: its error is kept already
            return
        store.S[slice(*store.layout.xc)], numbers.h_error = found
        numbers.h_try = h

    def _shorter(self, t: float, h: float) -> float:
        """The step [s] to try at t [s] after one of h [s] failed.

        Raises:
            RuntimeError: it is too short.
        """
        h *= 0.5
        if h < self.get_working_minimum_step_size():
            raise RuntimeError(f"{type(self).__name__}: the step at time {t} s fails even when it is {2 * h:g} s long.")
        self._run.failures += 1
        self._run.shrinks_failure += 1
        return h

    def _step(self, span: Span, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float] | None:
        """State after h [s] and the norm of its estimated error; None if the step is too long to be made."""
        raise NotImplementedError


class _Stopped(Exception):
    pass


class SemiExplicitEulerIntegrator(PythonIntegrator):
    """Velocities and other variables by explicit Euler, then positions with the new velocities."""

    _name, _order, _supports_error_estimation = "semi_explicit_euler", 1.0, False

    def __init__(self, system: System, max_step_size: float, context: Context | None = None):
        self._set_up(system, context)
        self.set_maximum_step_size(max_step_size)

    def _step(self, span: Span, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float] | None:
        rates = self._rates_in(span.store)
        f, x0 = self._derivatives(span, t, x), span.layout.rk[0]
        span.store.S[x0 + len(x) : x0 + 2 * len(x)] = f  # where dense output looks for it
        moved = x + h * f
        moved[rates.q] = x[rates.q] + h * rates.qdot(x[rates.q], moved[rates.v])
        return moved, 0.0


SCHEMES[SemiExplicitEulerIntegrator._name] = SemiExplicitEulerIntegrator
