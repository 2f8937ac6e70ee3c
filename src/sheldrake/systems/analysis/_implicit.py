"""Integrators whose steps are made in Python: implicit ones, for stiff systems, and the semi-explicit Euler."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.systems.analysis._integrator import _SCHEMES, IntegratorBase
from sheldrake.systems.framework._kernels import loop as _loop

NEWTON_STEPS = 10
NEWTON_TOLERANCE = 1e-10
DEEPEST_SPLIT = 12


class PythonIntegrator(IntegratorBase):
    """A step is made by `_step`, which may evaluate derivatives; the event loop does the rest."""

    _scheme = int(_loop.PYTHON)

    def __init__(self, system: Any, context: Any = None):
        self._set_up(system, context)

    def _derivatives(self, span: Any, t: float, x: np.ndarray) -> np.ndarray:
        """f(t, x)."""
        store = span.store
        store.S[0] = t
        store.S[slice(*store.layout.xc)] = x
        span.interpreted(_derivatives)
        if store.I[_loop.STATUS]:
            raise _Stopped
        return store.S[slice(*store.layout.xdot)].copy()

    def _make_step(self, span: Any) -> None:
        """Steps by Z[H_TRY] [s]; leaves the state in the slab and the norm of the error estimate in Z[H_ERROR]."""
        store, Z = span.store, self._Z
        t, h = float(store.S[0]), float(Z[_loop.H_TRY])
        x = store.S[slice(*store.layout.xc)].copy()
        try:
            x, error = self._split(span, t, x, h, 0)
        except _Stopped:  # a derivative failed: its error is kept already
            return
        store.S[slice(*store.layout.xc)] = x
        Z[_loop.H_ERROR] = error

    def _split(self, span: Any, t: float, x: np.ndarray, h: float, depth: int) -> tuple[np.ndarray, float]:
        """One step, or two halves of it where it does not converge."""
        if h == 0.0:
            return x, 0.0
        found = self._step(span, t, x, h)
        if found is not None:
            return found
        self._N[_loop.FAILURES] += 1
        self._N[_loop.SHRINKS_FAILURE] += 1
        if depth == DEEPEST_SPLIT:
            raise RuntimeError(
                f"{type(self).__name__}: Newton's method does not converge at time {t} even for steps of {h:g} s."
            )
        half, first = self._split(span, t, x, 0.5 * h, depth + 1)
        whole, second = self._split(span, t + 0.5 * h, half, 0.5 * h, depth + 1)
        return whole, first + second

    def _step(self, span: Any, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float] | None:
        raise NotImplementedError

    def _jacobian(self, span: Any, t: float, x: np.ndarray, f: np.ndarray) -> np.ndarray:
        """df/dx by forward differences."""
        J = np.empty((len(x), len(x)))
        for i in range(len(x)):
            d = 1.5e-8 * max(1.0, abs(x[i]))
            moved = x.copy()
            moved[i] += d
            J[:, i] = (self._derivatives(span, t, moved) - f) / (moved[i] - x[i])
        return J

    def _newton(self, residual: Any, matrix: np.ndarray, guess: np.ndarray) -> np.ndarray | None:
        """A zero of `residual` by Newton's method with a constant matrix; None if it does not converge."""
        z, last = guess.copy(), np.inf
        for _ in range(NEWTON_STEPS):
            dz = np.linalg.solve(matrix, -residual(z))
            z = z + dz
            size = np.max(np.abs(dz) / (1.0 + np.abs(z)), initial=0.0)
            if not np.isfinite(size) or size > 2.0 * last:
                return None
            if size < NEWTON_TOLERANCE:
                return z
            last = size
        return None


class _Stopped(Exception):
    pass


def _derivatives(P: Any, N: Any, S: Any, I: Any, L: Any, rows: Any) -> None:
    _loop.derivatives(P, N, S, I, L, rows, P.size[_loop.XDOT])


class ImplicitEulerIntegrator(PythonIntegrator):
    """x1 = x0 + h f(t1, x1), in two steps of half the length; one of the whole length gives the error estimate."""

    _name, _order = "implicit_euler", 2.0
    _default_accuracy, _loosest_accuracy, _first_step = 0.1, 0.5, 1.0

    def _step(self, span: Any, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float] | None:
        f0 = self._derivatives(span, t, x)
        J = self._jacobian(span, t, x, f0)
        whole = self._euler(span, t, x, h, J, x + h * f0)
        if whole is None:
            return None
        middle = self._euler(span, t, x, 0.5 * h, J, 0.5 * (x + whole))
        end = None if middle is None else self._euler(span, t + 0.5 * h, middle, 0.5 * h, J, whole)
        return None if end is None else (end, float(np.max(np.abs(end - whole))))

    def _euler(
        self, span: Any, t: float, x: np.ndarray, h: float, J: np.ndarray, guess: np.ndarray
    ) -> np.ndarray | None:
        """One implicit Euler step; None if Newton's method converges neither from the guess nor from x."""

        def residual(z: np.ndarray) -> np.ndarray:
            return z - x - h * self._derivatives(span, t + h, z)

        matrix = np.eye(len(x)) - h * J
        end = self._newton(residual, matrix, guess)
        return self._newton(residual, matrix, x) if end is None else end


class VelocityImplicitEulerIntegrator(ImplicitEulerIntegrator):
    """The implicit Euler step under the name of Drake's variant of it, which solves for velocities first."""

    _name = "velocity_implicit_euler"


class _RadauIntegrator(PythonIntegrator):
    """A Radau step, whose error is estimated by the implicit trapezoid."""

    _first_step = 1.0

    def _step(self, span: Any, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float] | None:
        f0 = self._derivatives(span, t, x)
        J = self._jacobian(span, t, x, f0)
        end = self._radau(span, t, x, h, f0, J)
        if end is None:
            return None
        lower = self._newton(
            lambda z: z - x - 0.5 * h * (f0 + self._derivatives(span, t + h, z)), np.eye(len(x)) - 0.5 * h * J, end
        )
        return None if lower is None else (end, float(np.max(np.abs(lower - end))))

    def _radau(self, span: Any, t: float, x: np.ndarray, h: float, f0: np.ndarray, J: np.ndarray) -> np.ndarray | None:
        raise NotImplementedError


class Radau1Integrator(_RadauIntegrator):
    """Radau IIA with one stage: the implicit Euler step, first order."""

    _name, _order = "radau1", 2.0
    _default_accuracy, _loosest_accuracy = 0.1, 0.5

    def _radau(self, span: Any, t: float, x: np.ndarray, h: float, f0: np.ndarray, J: np.ndarray) -> np.ndarray | None:
        def residual(z: np.ndarray) -> np.ndarray:
            return z - x - h * self._derivatives(span, t + h, z)

        matrix = np.eye(len(x)) - h * J
        end = self._newton(residual, matrix, x + h * f0)
        return self._newton(residual, matrix, x) if end is None else end


class Radau3Integrator(_RadauIntegrator):
    """Radau IIA with two stages, third order (Hairer and Wanner, 1996, IV.5)."""

    _name, _order = "radau3", 3.0
    _loosest_accuracy = 0.01

    def _radau(self, span: Any, t: float, x: np.ndarray, h: float, f0: np.ndarray, J: np.ndarray) -> np.ndarray | None:
        n = len(x)
        A = np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]])

        def residual(z: np.ndarray) -> np.ndarray:
            stages = z.reshape(2, n)
            f = np.stack([self._derivatives(span, t + c * h, x + s) for c, s in zip((1 / 3, 1.0), stages)])
            return (stages - h * A @ f).ravel()

        guess = np.concatenate([h / 3 * f0, h * f0])
        stages = self._newton(residual, np.eye(2 * n) - h * np.kron(A, J), guess)
        return None if stages is None else x + stages[n:]


class SemiExplicitEulerIntegrator(PythonIntegrator):
    """Velocities and other variables by explicit Euler, then positions with the new velocities."""

    _name, _order, _supports_error_estimation = "semi_explicit_euler", 1.0, False

    def __init__(self, system: Any, max_step_size: float, context: Any = None):
        self._set_up(system, context)
        self.set_maximum_step_size(max_step_size)

    def _step(self, span: Any, t: float, x: np.ndarray, h: float) -> tuple[np.ndarray, float] | None:
        parts = span.layout.places[0].parts
        moved = x + h * self._derivatives(span, t, x)
        for a, b in parts[0]:
            moved[a:b] = x[a:b]
        if any(b > a for a, b in parts[0]):
            f = self._derivatives(span, t, moved)
            for a, b in parts[0]:
                moved[a:b] = x[a:b] + h * f[a:b]
        return moved, 0.0


_SCHEMES.update(
    {
        cls._name: cls
        for cls in (
            ImplicitEulerIntegrator,
            Radau1Integrator,
            Radau3Integrator,
            SemiExplicitEulerIntegrator,
            VelocityImplicitEulerIntegrator,
        )
    }
)
