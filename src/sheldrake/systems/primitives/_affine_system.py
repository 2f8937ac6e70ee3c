"""Affine and linear systems, in continuous or discrete time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.primitives._kernels import blocks
from sheldrake.systems.primitives._state_space import StateSpace

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.memory import RootView


@checked
class AffineSystem(StateSpace):
    """x' = A x + B u + f0 (or the next x), y = C x + D u + y0.

    Args:
        A: Shape (n, n).
        B: Shape (n, m).
        f0: Shape (n,).
        C: Shape (k, n).
        D: Shape (k, m).
        y0: Shape (k,).
        time_period: Period of the discrete update [s]; 0: continuous.
    """

    _generic = True
    _complex_rows = True

    def __init__(
        self,
        A: ArrayLike | None = None,
        B: ArrayLike | None = None,
        f0: ArrayLike | None = None,
        C: ArrayLike | None = None,
        D: ArrayLike | None = None,
        y0: ArrayLike | None = None,
        time_period: float = 0.0,
    ):
        super().__init__()
        self._set_up(_sized(A, B, f0, C, D, y0), float(time_period))

    @classmethod
    def _of(
        cls, A: np.ndarray, B: np.ndarray, f0: np.ndarray, C: np.ndarray, D: np.ndarray, y0: np.ndarray, period: float
    ) -> Any:
        """A system of arrays of doubles that fit, which it keeps where they are contiguous."""
        system = object.__new__(cls)
        LeafSystem.__init__(system)
        system._set_up(blocks.Affine(*map(np.ascontiguousarray, (A, B, f0, C, D, y0))), period)
        return system

    def _set_up(self, coefficients: blocks.Affine, period: float) -> None:
        if not period >= 0:
            raise RuntimeError(f"{type(self).__name__}: time_period must not be negative, got {period}.")
        self._coefficients, self._period = coefficients, period
        k, m = coefficients.D.shape
        n = len(coefficients.f0)
        if m:
            self.DeclareVectorInputPort("u0", m)
        if n and period > 0:
            self.DeclareDiscreteState(n)
            update = blocks.affine_next if m else blocks.autonomous_next
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, update)
        elif n:
            self.DeclareContinuousState(n)
            self.DeclareTimeDerivatives(blocks.affine_derivatives if m else blocks.autonomous_derivatives)
        if k:
            through = coefficients.D.any()
            self.DeclareVectorOutputPort("y0", k, blocks.affine_output if through else blocks.affine_output_of_state)

    def _kernel_models(self, root: RootView) -> dict:
        return {"model": self._coefficients}

    def _motion_and_slopes(
        self, context: Context, x: np.ndarray, u: np.ndarray, i: int | None, j: int | None
    ) -> tuple[np.ndarray, np.ndarray]:
        A, B, f0, C, D, y0 = self._coefficients
        if i is None and B.size + D.size:
            u = self.get_input_port(0).Eval(context) if B.any() or D.any() else np.zeros(D.shape[1])
        n, end = len(x), len(x) + (len(y0) if j is not None else 0)
        slopes, values = np.empty((end, n + len(u))), np.empty(end)
        slopes[:n, :n], slopes[:n, n:], values[:n] = A, B, f0
        if j is not None:
            slopes[n:, :n], slopes[n:, n:], values[n:] = C, D, y0
        values += slopes @ np.concatenate((x, u))
        return values, slopes if i is not None else slopes[:, :n]

    def _copy(self) -> Self:
        new = super()._copy()
        new._coefficients = type(self._coefficients)(*(value.copy() for value in self._coefficients))
        return new

    def UpdateCoefficients(
        self,
        A: ArrayLike | None = None,
        B: ArrayLike | None = None,
        f0: ArrayLike | None = None,
        C: ArrayLike | None = None,
        D: ArrayLike | None = None,
        y0: ArrayLike | None = None,
    ) -> None:
        """Replaces coefficients; those not given stay zero. Sizes and feedthrough stay as they are.

        Raises:
            RuntimeError: a size differs, or one is not given that is not zero.
        """
        old, new = self._coefficients, []
        for name, target, value in zip(old._fields, old, (A, B, f0, C, D, y0)):
            if value is None and target.size and target.any():
                raise RuntimeError(f"{type(self).__name__}.UpdateCoefficients(): {name} is missing; give all of them.")
            value = np.zeros(target.shape) if value is None else np.asarray(value, float)
            if target.ndim == 1 and value.shape == (len(target), 1):
                value = value[:, 0]
            if value.shape != target.shape:
                raise RuntimeError(
                    f"{type(self).__name__}.UpdateCoefficients(): {name} has shape {target.shape}, got {value.shape}."
                )
            new.append(value)
        for target, value in zip(old, new):
            target[...] = value
        through = np.any(old.D != 0)
        if self._outputs and old.D.shape[1]:
            calc = blocks.affine_output if through else blocks.affine_output_of_state
            if self._outputs[0].calc is not calc:
                self._outputs[0].calc = calc
                self._changed()

    def _discrete_time_approximation(self, period: float) -> AffineSystem:
        """The same system as seen every `period` [s], its input held between."""
        from scipy.linalg import expm

        if self._period != 0:
            raise RuntimeError("DiscreteTimeApproximation(): the system is discrete already.")
        n, m = self.num_states(), self.num_inputs()
        M = np.zeros((n + m + 1, n + m + 1))
        M[:n, :n], M[:n, n : n + m], M[:n, n + m] = self.A(), self.B(), self.f0()
        E = expm(M * period)
        A, B, f0 = E[:n, :n], E[:n, n : n + m], E[:n, n + m]
        if isinstance(self, LinearSystem):
            sampled: AffineSystem = LinearSystem(A, B, self.C(), self.D(), period)
        else:
            sampled = AffineSystem(A, B, f0, self.C(), self.D(), self.y0(), period)
        return sampled if self._scalar is float else sampled._convert(self._scalar)

    def A(self) -> np.ndarray:
        """Shape (n, n)."""
        return self._coefficients.A.copy()

    def B(self) -> np.ndarray:
        """Shape (n, m)."""
        return self._coefficients.B.copy()

    def C(self) -> np.ndarray:
        """Shape (k, n)."""
        return self._coefficients.C.copy()

    def D(self) -> np.ndarray:
        """Shape (k, m)."""
        return self._coefficients.D.copy()

    def f0(self) -> np.ndarray:
        """Shape (n,)."""
        return self._coefficients.f0.copy()

    def y0(self) -> np.ndarray:
        """Shape (k,)."""
        return self._coefficients.y0.copy()

    def num_states(self) -> int:
        """n."""
        return len(self._coefficients.f0)

    def num_inputs(self) -> int:
        """m."""
        return self._coefficients.D.shape[1]

    def num_outputs(self) -> int:
        """k."""
        return self._coefficients.D.shape[0]


class LinearSystem(AffineSystem):
    """x' = A x + B u (or the next x), y = C x + D u.

    Args:
        A: Shape (n, n).
        B: Shape (n, m).
        C: Shape (k, n).
        D: Shape (k, m).
        time_period: Period of the discrete update [s]; 0: continuous.
    """

    @checked
    def __init__(
        self,
        A: ArrayLike | None = None,
        B: ArrayLike | None = None,
        C: ArrayLike | None = None,
        D: ArrayLike | None = None,
        time_period: float = 0.0,
    ):
        super().__init__(A, B, None, C, D, None, time_period)


class MatrixGain(LinearSystem):
    """y = D u.

    Args:
        D: Shape (k, m).
    """

    def __init__(self, D: ArrayLike):
        if np.ndim(D) not in (1, 2):
            raise Mismatch(f"MatrixGain(): incompatible constructor arguments: D must be a matrix, got {D!r}")
        super().__init__(D=D)


def _sized(
    A: ArrayLike | None,
    B: ArrayLike | None,
    f0: ArrayLike | None,
    C: ArrayLike | None,
    D: ArrayLike | None,
    y0: ArrayLike | None,
) -> blocks.Affine:
    """Coefficients of consistent sizes; what is not given is zero."""
    given = {k: None if v is None else np.asarray(v, float) for k, v in zip("ABfCDy", (A, B, f0, C, D, y0))}
    for name in "ABCD":
        m = given[name]
        if m is not None and m.ndim == 1:
            given[name] = m.reshape(-1, 1) if m.size else m.reshape(0, 0)
    axes = {"A": "nn", "B": "nm", "f": "n", "C": "kn", "D": "km", "y": "k"}
    sizes: dict[str, int] = {}
    for name, dims in axes.items():
        m = given[name]
        if m is None or m.size == 0:
            continue
        for axis, size in zip(dims, m.shape):
            if sizes.setdefault(axis, size) != size:
                shapes = {k: v.shape for k, v in given.items() if v is not None}
                raise RuntimeError(f"AffineSystem: the sizes of the coefficients do not fit: {shapes}.")
    for name, dims in axes.items():  # an empty matrix may still tell a size, as (0, 2) does
        m = given[name]
        if m is not None and m.ndim == len(dims):
            for axis, size in zip(dims, m.shape):
                sizes.setdefault(axis, size)
    out = []
    for name, dims in axes.items():
        m = given[name]
        shape = tuple(sizes.get(axis, 0) for axis in dims)
        out.append(np.zeros(shape) if m is None or m.size == 0 else np.ascontiguousarray(m.reshape(shape)).copy())
    return blocks.Affine(*out)
