"""Linear quadratic regulators.

Of matrices, of a linear system, or of any system about a point: `Linearize`, then a Riccati equation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, SupportsIndex
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, called, instance_of
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.common._scalars import any_array
from sheldrake.math._matrix_equations import require_stable, small_regulator, stabilizing_solution
from sheldrake.systems.framework import Context, InputPortSelection, OutputPortSelection, System
from sheldrake.systems.primitives import AffineSystem, Linearize, LinearSystem

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@kind("float array of shape (m, n)")
def matrix(value: ArrayLike) -> np.ndarray:
    """Kind: a matrix; one list of numbers is a column, as for Eigen."""
    array = any_array(float, value)
    if array.ndim not in (1, 2):
        raise Mismatch
    return array[:, np.newaxis] if array.ndim == 1 else array


_WEIGHTS: dict[str, Any] = {"Q": matrix, "R": matrix, "N": (matrix, None)}


def symmetric_matrix(call: str, name: str, value: ArrayLike, n: int) -> np.ndarray:
    """A symmetric matrix of shape (n, n).

    Raises:
        RuntimeError: it is another.
    """
    array = matrix(value)
    if array.shape != (n, n):
        raise RuntimeError(f"{call}(): {name} must be {n} x {n}, it is {array.shape}.")
    if np.abs(array - array.T).max(initial=0.0) > 1e-10 * max(1.0, np.abs(array).max(initial=0.0)):
        raise RuntimeError(f"{call}(): {name} must be symmetric.")
    return array


def _check(call: str, A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, N: np.ndarray | None) -> np.ndarray:
    """Checks sizes and signs; returns N, zero where it is not given."""
    if A.shape[0] != A.shape[1] or B.shape[0] != A.shape[0]:
        raise RuntimeError(f"{call}(): A must be n x n and B n x m; they are {A.shape} and {B.shape}.")
    n, m = B.shape
    symmetric_matrix(call, "Q", Q, n)
    if np.linalg.eigvalsh(symmetric_matrix(call, "R", R, m)).min(initial=np.inf) <= 0.0:
        raise RuntimeError(f"{call}(): R must be positive definite")
    N = np.zeros((n, m)) if N is None or N.size == 0 else N
    if N.shape != (n, m):
        raise RuntimeError(f"{call}(): N must be {n} x {m}, it is {N.shape}.")
    return N


def _quick(
    A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, N: np.ndarray | None, *, discrete: bool
) -> tuple[np.ndarray, np.ndarray] | None:
    """K and S by a kernel, or None: then what comes behind it finds them, or what is wrong."""
    n, m = B.shape
    fits = A.shape == Q.shape == (n, n) and R.shape == (m, m) and (N is None or N.shape == (n, m))
    made = small_regulator(A, B, Q, R, N, discrete=discrete) if fits else None
    return None if made is None else made[::-1]


def _riccati(call: str, A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, *, discrete: bool) -> np.ndarray:
    try:
        S = stabilizing_solution(A, B, Q, R, discrete=discrete)
        _check_stable(A, B, R, S, discrete)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise RuntimeError(
            f"{call}(): the Riccati equation has no stabilizing solution ({error}). Either (A, B) is not stabilizable, "
            "or (Q, A) is not detectable."
        ) from None
    return S


def _check_stable(A: np.ndarray, B: np.ndarray, R: np.ndarray, S: np.ndarray, discrete: bool) -> None:
    """Raises a LinAlgError where a solution leaves a mode that does not decay at all: Q does not see it."""
    if discrete:
        modes = 1.0 - abs(np.linalg.eigvals(A - B @ np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A)))
    else:
        modes = -np.linalg.eigvals(A - B @ np.linalg.solve(R, B.T @ S)).real
    if modes.min(initial=np.inf) <= 1e-7 * np.abs(A).max(initial=0.0):  # on the axis they are exact to half the digits
        raise np.linalg.LinAlgError("a mode of the closed loop does not decay")


def _regulator(
    call: str, A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, N: np.ndarray | None, *, discrete: bool
) -> tuple[np.ndarray, np.ndarray]:
    """K and S."""
    if (made := _quick(A, B, Q, R, N, discrete=discrete)) is not None:
        return made
    N = _check(call, A, B, Q, R, N)
    R_inverse = np.linalg.inv(R)
    # Completing the square in u takes N away (Bertsekas 2017, section 3.1).
    A1, Q1 = A - B @ R_inverse @ N.T, Q - N @ R_inverse @ N.T
    S = _riccati(call, A1, B, Q1, R, discrete=discrete)
    K = np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A + N.T) if discrete else R_inverse @ (B.T @ S + N.T)
    require_stable(call, A - B @ K, discrete=discrete)
    return K, S


def _gain(system: LinearSystem, Q: np.ndarray, R: np.ndarray, N: np.ndarray | None) -> np.ndarray:
    if system.time_period() > 0.0:
        return DiscreteTimeLinearQuadraticRegulator(system.A(), system.B(), Q, R, N)[0]
    return LinearQuadraticRegulator(system.A(), system.B(), Q, R, N)[0]


def _of_linear_system(system: LinearSystem, Q: np.ndarray, R: np.ndarray, N: np.ndarray | None) -> LinearSystem:
    K = _gain(system, Q, R, N)
    m, n = K.shape
    empty = np.zeros
    return LinearSystem(empty((0, 0)), empty((0, n)), empty((m, 0)), -K, system.time_period())


def _of_system_at(
    system: System,
    context: Context,
    Q: np.ndarray,
    R: np.ndarray,
    N: np.ndarray | None,
    input_port_index: InputPortSelection | SupportsIndex,
) -> AffineSystem:
    linear = Linearize(system, context, input_port_index, OutputPortSelection.kNoOutput)
    K = _gain(linear, Q, R, N)
    index = 0 if isinstance(input_port_index, InputPortSelection) else int(input_port_index)
    u0 = np.array(system.get_input_port(index).Eval(context), dtype=float)
    if linear.time_period() > 0.0:
        x0 = np.array(context.get_discrete_state_vector().CopyToVector(), dtype=float)
    else:
        x0 = np.array(context.get_continuous_state_vector().CopyToVector(), dtype=float)
    m, n = K.shape
    empty = np.zeros
    return AffineSystem(empty((0, 0)), empty((0, n)), empty(0), empty((m, 0)), -K, u0 + K @ x0, linear.time_period())


@typing_overload
def LinearQuadraticRegulator(
    A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None = None, F: ArrayLike | None = None
) -> tuple[np.ndarray, np.ndarray]: ...
@typing_overload
def LinearQuadraticRegulator(
    system: LinearSystem, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None = None
) -> LinearSystem: ...
@typing_overload
def LinearQuadraticRegulator(
    system: System,
    context: Context,
    Q: ArrayLike,
    R: ArrayLike,
    N: ArrayLike | None = None,
    input_port_index: InputPortSelection | SupportsIndex = InputPortSelection.kUseFirstInputIfItExists,
) -> AffineSystem: ...
@overloaded(
    overload(
        _of_system_at,
        system=instance_of(System),
        context=instance_of(Context),
        **_WEIGHTS,
        input_port_index=(anything, InputPortSelection.kUseFirstInputIfItExists),
    ),
    overload(_of_linear_system, system=instance_of(LinearSystem), **_WEIGHTS),
    overload(A=matrix, B=matrix, **_WEIGHTS, F=(called("float array of shape (k, n)"), None)),
)
def LinearQuadraticRegulator(
    A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, N: np.ndarray | None, F: ArrayLike | None
) -> Any:
    """Returns the linear feedback that minimizes ∫ x'Qx + u'Ru + 2x'Nu.

    Called as

    - `LinearQuadraticRegulator(A, B, Q, R, N=None, F=None)`: for x' = A x + B u, where F x = 0 always; returns K and S
      with u = -K x and the cost x'Sx;
    - `LinearQuadraticRegulator(system, Q, R, N=None)` with a LinearSystem: returns the regulator, a LinearSystem;
    - `LinearQuadraticRegulator(system, context, Q, R, N=None, input_port_index=...)`: for any system, linearized at an
      equilibrium; returns the regulator about it, an AffineSystem.

    Raises:
        RuntimeError: sizes do not fit, R is not positive definite, or there is no stabilizing feedback.
    """
    call = "LinearQuadraticRegulator"
    if F is None or not np.size(F):
        return _regulator(call, A, B, Q, R, N, discrete=False)
    from scipy.linalg import null_space

    N = _check(call, A, B, Q, R, N)
    basis = null_space(np.atleast_2d(np.array(F, dtype=float)))
    K, S = _regulator(call, basis.T @ A @ basis, basis.T @ B, basis.T @ Q @ basis, R, basis.T @ N, discrete=False)
    return K @ basis.T, basis @ S @ basis.T


@checked
def DiscreteTimeLinearQuadraticRegulator(
    A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Returns K and S: u = -K x minimizes Σ x'Qx + u'Ru + 2x'Nu for x[k+1] = A x[k] + B u[k], at the cost x'Sx.

    Raises:
        RuntimeError: sizes do not fit, R is not positive definite, or there is no stabilizing feedback.
    """
    A, B, Q, R = (matrix(x) for x in (A, B, Q, R))
    N = None if N is None else matrix(N)
    return _regulator("DiscreteTimeLinearQuadraticRegulator", A, B, Q, R, N, discrete=True)
