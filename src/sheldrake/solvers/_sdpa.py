"""Programs as semidefinite programs in the SDPA file format: max tr(C X) with tr(A_i X) = g_i and X >= 0."""

from __future__ import annotations

import logging
from collections import defaultdict
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.solvers._ids import ProgramAttribute
from sheldrake.solvers._program.program import MathematicalProgram

if TYPE_CHECKING:
    from sheldrake.solvers._functions.bindings import BindingBase

_log = logging.getLogger("drake")
_P = ProgramAttribute
_ACCEPTED = {
    _P.kLinearCost,
    _P.kLinearConstraint,
    _P.kLinearEqualityConstraint,
    _P.kLorentzConeConstraint,
    _P.kRotatedLorentzConeConstraint,
    _P.kPositiveSemidefiniteConstraint,
}


class RemoveFreeVariableMethod(BoundEnum):
    """How free variables s, which the format does not have, are removed.

    kTwoSlackVariables: s = p - q with p, q >= 0. kNullspace: by the nullspace of their equations in the dual.
    kLorentzConeSlack: by a further t >= |s|.
    """

    kTwoSlackVariables = 1
    kNullspace = 2
    kLorentzConeSlack = 3


class _Entry(NamedTuple):
    """The element (i, j), i <= j, of a block of X; counted from zero."""

    block: int
    i: int
    j: int


class _Sum:
    """A linear function of elements of X and of free variables, and a constant."""

    def __init__(self) -> None:
        self.entries: dict[_Entry, float] = defaultdict(float)
        self.free: dict[int, float] = defaultdict(float)
        self.constant = 0.0

    def add(self, other: _Sum, factor: float) -> None:
        """Adds a multiple of another one."""
        for entry, value in other.entries.items():
            self.entries[entry] += factor * value
        for k, value in other.free.items():
            self.free[k] += factor * value
        self.constant += factor * other.constant


def _element(entry: _Entry) -> _Sum:
    out = _Sum()
    out.entries[entry] = 1.0
    return out


class SdpaForm:
    """A program in the form max tr(C X) + d s with tr(A_i X) + b_i s = g_i, X >= 0 and s free.

    Raises:
        ValueError: it has other costs or constraints than linear and conic ones, or binary variables.
    """

    def __init__(self, prog: MathematicalProgram):
        if not set(prog.required_capabilities()) <= _ACCEPTED:
            raise ValueError("SdpaFreeFormat(): the program cannot be formulated as an SDP in the standard form.")
        self._prog = prog
        self.blocks: list[int] = []  # Size of a matrix, or minus that of a diagonal one.
        self.rows: list[tuple[_Sum, float]] = []
        self._variables: dict[Any, _Sum] = {}
        self.num_free = 0
        self._matrix_variables()
        self._bounds()
        for v in prog.decision_variables():
            if v.get_id() not in self._variables:
                free = self._variables[v.get_id()] = _Sum()
                free.free[self.num_free] = 1.0
                self.num_free += 1
        self._linear()
        self._cones()
        self.cost = _Sum()
        for binding in prog.linear_costs():
            self.cost.add(self._row(binding.evaluator().a(), binding.variables()), -1.0)

    def _block(self, size: int) -> int:
        self.blocks.append(size)
        return len(self.blocks) - 1

    def _nonnegative(self, block: int) -> _Sum:
        """A new element of a diagonal block."""
        k = -self.blocks[block]
        self.blocks[block] -= 1
        return _element(_Entry(block, k, k))

    def _equal(self, left: _Sum, right: float) -> None:
        self.rows.append((left, right - left.constant))

    def _row(self, a: np.ndarray, x: np.ndarray) -> _Sum:
        out = _Sum()
        for value, v in zip(np.asarray(a, dtype=float).ravel(), x):
            if value != 0.0:
                out.add(self._variables[v.get_id()], value)
        return out

    def _matrix_variables(self) -> None:
        for binding in self._prog.positive_semidefinite_constraints():
            n = binding.evaluator().matrix_rows()
            X, block = np.asarray(binding.variables()).reshape(n, n), self._block(n)
            for j in range(n):
                for i in range(j + 1):
                    entry, known = _element(_Entry(block, i, j)), self._variables.get(X[i, j].get_id())
                    if known is None:
                        self._variables[X[i, j].get_id()] = entry
                    else:
                        same = _Sum()
                        same.add(known, 1.0)
                        same.add(entry, -1.0)
                        self._equal(same, 0.0)

    def _bounds(self) -> None:
        bounds: dict[Any, list[float]] = {}
        for binding in self._prog.bounding_box_constraints():
            e = binding.evaluator()
            for v, low, high in zip(binding.variables(), e.lower_bound(), e.upper_bound()):
                old = bounds.setdefault(v.get_id(), [-np.inf, np.inf])
                bounds[v.get_id()] = [max(old[0], low), min(old[1], high)]
        block = self._block(0)
        for v in self._prog.decision_variables():
            if v.get_id() not in bounds:
                continue
            low, high = bounds[v.get_id()]
            if v.get_id() in self._variables:
                self._between(self._variables[v.get_id()], low, high, block)
            elif np.isfinite(low) or np.isfinite(high):
                self._variables[v.get_id()] = self._bounded(low, high, block)
        self._drop_if_empty(block)

    def _bounded(self, low: float, high: float, block: int) -> _Sum:
        """A variable as a constant and what it is above its lower bound, or below its upper one."""
        out = _Sum()
        out.constant = low if np.isfinite(low) else high
        if low == high:
            return out
        out.add(self._nonnegative(block), 1.0 if np.isfinite(low) else -1.0)
        if np.isfinite(low) and np.isfinite(high):
            both = _Sum()
            both.add(out, 1.0)
            both.add(self._nonnegative(block), 1.0)
            self._equal(both, high)
        return out

    def _between(self, value: _Sum, low: float, high: float, block: int) -> None:
        """Adds low <= value <= high by slacks of a diagonal block."""
        ends = [(low, 0.0)] if low == high else [(low, -1.0), (high, 1.0)]
        for end, slack in ends:
            if np.isfinite(end):
                row = _Sum()
                row.add(value, 1.0)
                if slack:
                    row.add(self._nonnegative(block), slack)
                self._equal(row, end)

    def _drop_if_empty(self, block: int) -> None:
        if self.blocks[block] == 0:
            del self.blocks[block]

    def _linear(self) -> None:
        for binding in self._prog.linear_equality_constraints():
            for a, end in zip(binding.evaluator().GetDenseA(), binding.evaluator().lower_bound()):
                self._equal(self._row(a, binding.variables()), end)
        block = self._block(0)
        for inequality in self._prog.linear_constraints():
            e = inequality.evaluator()
            for a, low, high in zip(e.GetDenseA(), e.lower_bound(), e.upper_bound()):
                self._between(self._row(a, inequality.variables()), low, high, block)
        self._drop_if_empty(block)

    def _cones(self) -> None:
        prog = self._prog
        for binding in prog.linear_matrix_inequality_constraints():
            F = np.array(binding.evaluator().F())
            block, n = self._block(F.shape[1]), F.shape[1]
            for j in range(n):
                for i in range(j + 1):
                    self._make(_Entry(block, i, j), F[1:, i, j], F[0, i, j], binding.variables())
        for cone in prog.lorentz_cone_constraints():
            self._arrow(cone, lambda n: [(i, i, 0) for i in range(n)] + [(0, j, j) for j in range(1, n)], 0)
        for rotated in prog.rotated_lorentz_cone_constraints():
            self._arrow(
                rotated,
                lambda n: [(0, 0, 0)] + [(0, j, j + 1) for j in range(1, n - 1)] + [(i, i, 1) for i in range(1, n - 1)],
                1,
            )

    def _arrow(self, binding: BindingBase, places: Any, fewer: int) -> None:
        """A cone as a matrix with z in its first row, on its diagonal, and nowhere else.

        `places(n)` lists i, j and k: the element (i, j) is z_k.
        """
        A, b = binding.evaluator().A(), binding.evaluator().b()
        A = A.toarray() if hasattr(A, "toarray") else np.asarray(A)
        size = len(b) - fewer
        block = self._block(size)
        for i, j, k in places(len(b)):
            self._make(_Entry(block, i, j), A[k], b[k], binding.variables())
        for i in range(1, size):
            for j in range(i + 1, size):
                self._equal(_element(_Entry(block, i, j)), 0.0)

    def _make(self, entry: _Entry, a: np.ndarray, constant: float, x: np.ndarray) -> None:
        """Adds that an element of X is a x + constant."""
        row = self._row(a, x)
        row.add(_element(entry), -1.0)
        self._equal(row, -constant)

    # Free variables

    def without_free(self, method: RemoveFreeVariableMethod) -> bool:
        """Removes the free variables; tells whether that could be done."""
        if self.num_free == 0:
            return True
        if method is RemoveFreeVariableMethod.kNullspace:
            return self._take_nullspace()
        k = self.num_free
        if method is RemoveFreeVariableMethod.kTwoSlackVariables:
            block = self._block(-2 * k)
            parts = [[(_Entry(block, i, i), 1.0), (_Entry(block, k + i, k + i), -1.0)] for i in range(k)]
        else:
            block = self._block(k + 1)
            parts = [[(_Entry(block, 0, i + 1), 1.0)] for i in range(k)]
        for row in (self.cost, *(row for row, _ in self.rows)):
            for i, value in row.free.items():
                for entry, sign in parts[i]:
                    row.entries[entry] += sign * value
            row.free.clear()
        if method is RemoveFreeVariableMethod.kLorentzConeSlack:
            self._make_arrow(block, k + 1)
        self.num_free = 0
        return True

    def _make_arrow(self, block: int, size: int) -> None:
        for i in range(1, size):
            same = _element(_Entry(block, i, i))
            same.add(_element(_Entry(block, 0, 0)), -1.0)
            self._equal(same, 0.0)
            for j in range(i + 1, size):
                self._equal(_element(_Entry(block, i, j)), 0.0)

    def _take_nullspace(self) -> bool:
        """With B' y = d the dual of the free variables: y = y0 + N t, N the nullspace of B'."""
        B, d = np.zeros((len(self.rows), self.num_free)), np.zeros(self.num_free)
        for i, (row, _) in enumerate(self.rows):
            for k, value in row.free.items():
                B[i, k] = value
        for k, value in self.cost.free.items():
            d[k] = value
        y0, _, rank, _ = np.linalg.lstsq(B.T, d, rcond=None)
        if not np.allclose(B.T @ y0, d, atol=1e-9 * max(1.0, np.abs(d).max())):
            return False
        N = np.linalg.svd(B, full_matrices=True)[0][:, rank:]
        cost = _Sum()
        cost.add(self.cost, 1.0)
        for (row, _), y in zip(self.rows, y0):
            cost.add(row, -y)
        rows = []
        for column in N.T:
            combined = _Sum()
            for (row, _), weight in zip(self.rows, column):
                combined.add(row, weight)
            rows.append((combined, float(column @ [g for _, g in self.rows])))
        self.cost, self.rows, self.num_free = cost, rows, 0
        return True

    def text(self) -> str:
        """The lines of the file."""
        lines = [str(len(self.rows)), str(len(self.blocks)), "".join(f"{size} " for size in self.blocks)]
        lines.append(" ".join(repr(float(g)) for _, g in self.rows))
        for number, row in enumerate((self.cost, *(row for row, _ in self.rows))):
            for entry, value in sorted(row.entries.items(), key=lambda item: (item[0].block, item[0].j, item[0].i)):
                if value != 0.0:
                    half = value if entry.i == entry.j else 0.5 * value
                    lines.append(f"{number} {entry.block + 1} {entry.i + 1} {entry.j + 1} {float(half)!r}")
        return "\n".join(lines) + "\n"


@checked
def GenerateSDPA(
    prog: MathematicalProgram,
    file_name: str,
    method: RemoveFreeVariableMethod = RemoveFreeVariableMethod.kNullspace,
) -> bool:
    """Writes a program of linear costs, linear and conic constraints to a file that solvers such as CSDP read.

    Args:
        prog: The program.
        file_name: Name of the file, without `.dat-s`.
        method: How free variables are removed.

    Returns:
        Whether the file was written.

    Raises:
        ValueError: the program has other costs or constraints, or binary variables.
    """
    form = SdpaForm(prog)
    if not form.without_free(method):
        _log.warning("GenerateSDPA(): the program is unbounded in its free variables; no file is written.")
        return False
    try:
        with open(f"{file_name}.dat-s", "w", encoding="ascii") as file:
            file.write(form.text())
    except OSError:
        _log.warning("GenerateSDPA(): Cannot open the file %s.dat-s", file_name)
        return False
    return True
