"""Large cliques of graphs, covers by them, and the graph of configurations that see each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.solvers import MathematicalProgram, Solve, SolverOptions

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike

    from sheldrake.common import Parallelism
    from sheldrake.planning import CollisionChecker


def _matrix(call: str, adjacency_matrix: ArrayLike) -> np.ndarray:
    """A symmetric boolean matrix, dense.

    Raises:
        RuntimeError: it is not symmetric.
    """
    A = adjacency_matrix.toarray() if hasattr(adjacency_matrix, "toarray") else np.asarray(adjacency_matrix)
    A = A.astype(bool)
    if A.ndim != 2 or A.shape[0] != A.shape[1] or not np.array_equal(A, A.T):
        raise RuntimeError(f"{call}(): the adjacency matrix must be square and symmetric.")
    return A


@checked
class MaxCliqueSolverBase:
    """Finds large cliques; derived classes write `DoSolveMaxClique(adjacency_matrix)`."""

    def DoSolveMaxClique(self, adjacency_matrix: ArrayLike) -> np.ndarray:
        """Returns which vertices are in the clique."""
        raise NotImplementedError(f"{type(self).__name__} has no DoSolveMaxClique().")

    def SolveMaxClique(self, adjacency_matrix: ArrayLike) -> np.ndarray:
        """Returns which vertices are in a large clique, shape (n,), bool.

        Args:
            adjacency_matrix: Symmetric, shape (n, n), sparse or dense.

        Raises:
            RuntimeError: the matrix is not symmetric.
        """
        _matrix("SolveMaxClique", adjacency_matrix)
        return np.asarray(self.DoSolveMaxClique(adjacency_matrix), dtype=bool)


@checked
class MaxCliqueSolverViaGreedy(MaxCliqueSolverBase):
    """Takes the vertex with the most neighbours among the candidates, and keeps its neighbours as candidates."""

    def DoSolveMaxClique(self, adjacency_matrix: ArrayLike) -> np.ndarray:
        A = _matrix("SolveMaxClique", adjacency_matrix)
        np.fill_diagonal(A, False)
        chosen, candidates = np.zeros(len(A), dtype=bool), np.ones(len(A), dtype=bool)
        while candidates.any():
            degrees = np.where(candidates, A[:, candidates].sum(axis=1), -1)
            best = int(degrees.argmax())
            chosen[best] = True
            candidates &= A[best]
        return chosen


@checked
class MaxCliqueSolverViaMip(MaxCliqueSolverBase):
    """Finds a largest clique with whole numbers: max sum x, x_i + x_j <= 1 where there is no edge.

    Args:
        initial_guess: Which vertices to start from, shape (n,); or None.
        solver_options: Of the solver.
    """

    def __init__(self, initial_guess: ArrayLike | None = None, solver_options: SolverOptions | None = None):
        self._options = SolverOptions() if solver_options is None else solver_options
        self.SetInitialGuess(initial_guess)

    def SetSolverOptions(self, solver_options: SolverOptions) -> None:
        """Sets options of the solver."""
        self._options = solver_options

    def GetSolverOptions(self) -> SolverOptions:
        """Returns the options of the solver."""
        return self._options

    def SetInitialGuess(self, initial_guess: ArrayLike | None) -> None:
        """Sets which vertices to start from, or None."""
        self._guess = None if initial_guess is None else np.array(initial_guess, dtype=float).ravel()

    def GetInitialGuess(self) -> np.ndarray | None:
        """Returns which vertices to start from, or None."""
        return None if self._guess is None else self._guess.copy()

    def DoSolveMaxClique(self, adjacency_matrix: ArrayLike) -> np.ndarray:
        """Returns which vertices are in the clique.

        Raises:
            RuntimeError: the solver fails.
        """
        A = _matrix("SolveMaxClique", adjacency_matrix)
        n = len(A)
        prog = MathematicalProgram()
        x = prog.NewBinaryVariables(n, "x")
        prog.AddLinearCost(-np.ones(n), 0.0, x)
        apart = [(i, j) for i in range(n) for j in range(i) if not A[i, j]]
        if apart:
            rows = np.zeros((len(apart), n))
            for k, pair in enumerate(apart):
                rows[k, list(pair)] = 1.0
            prog.AddLinearConstraint(rows, np.full(len(apart), -np.inf), np.ones(len(apart)), x)
        result = Solve(prog, self._guess, self._options)
        if not result.is_success():
            raise RuntimeError(f"SolveMaxClique(): the solver failed: {result.get_solution_result().name}.")
        return result.GetSolution(x) > 0.5


@checked
class MinCliqueCoverSolverBase:
    """Covers graphs by cliques; derived classes write `DoSolveMinCliqueCover(adjacency_matrix, partition)`."""

    def DoSolveMinCliqueCover(self, adjacency_matrix: ArrayLike, partition: bool) -> list[set[int]]:
        """Returns the cliques."""
        raise NotImplementedError(f"{type(self).__name__} has no DoSolveMinCliqueCover().")

    def SolveMinCliqueCover(self, adjacency_matrix: ArrayLike, partition: bool = False) -> list[set[int]]:
        """Returns few cliques that cover a graph.

        Args:
            adjacency_matrix: Symmetric, shape (n, n), sparse or dense.
            partition: Whether each vertex is to be in one clique only.

        Raises:
            RuntimeError: the matrix is not symmetric.
        """
        _matrix("SolveMinCliqueCover", adjacency_matrix)
        return self.DoSolveMinCliqueCover(adjacency_matrix, partition)


@checked
class MinCliqueCoverSolverViaGreedy(MinCliqueCoverSolverBase):
    """Takes large cliques of what is not yet covered, one after the other.

    Args:
        max_clique_solver: Finds cliques.
        min_clique_size: Smaller ones are not taken.
    """

    def __init__(self, max_clique_solver: MaxCliqueSolverBase, min_clique_size: int = 1):
        self._solver = max_clique_solver
        self.set_min_clique_size(min_clique_size)

    def get_min_clique_size(self) -> int:
        """Returns the least size of cliques."""
        return self._least

    def set_min_clique_size(self, min_clique_size: int) -> None:
        """Sets the least size of cliques.

        Raises:
            RuntimeError: it is not positive.
        """
        if min_clique_size < 1:
            raise RuntimeError(f"set_min_clique_size(): the size must be positive, got {min_clique_size}.")
        self._least = int(min_clique_size)

    def DoSolveMinCliqueCover(self, adjacency_matrix: ArrayLike, partition: bool) -> list[set[int]]:
        """Returns the cliques; without partition a vertex may be in several, but no edge is."""
        from scipy.sparse import csc_matrix

        A = _matrix("SolveMinCliqueCover", adjacency_matrix)
        np.fill_diagonal(A, True)  # The diagonal: what is not yet covered.
        out: list[set[int]] = []
        while A.any():
            left = np.flatnonzero(A.any(axis=1))
            part = A[np.ix_(left, left)].copy()
            np.fill_diagonal(part, False)
            clique = left[self._solver.SolveMaxClique(csc_matrix(part))]
            if clique.size < self._least or not clique.size:
                break
            out.append({int(i) for i in clique})
            if partition:
                A[clique, :] = A[:, clique] = False
            else:
                A[np.ix_(clique, clique)] = False
        return out


@checked
def VisibilityGraph(
    checker: CollisionChecker, points: np.ndarray, parallelize: Parallelism | int | bool = True
) -> scipy.sparse.csc_matrix:
    """Returns which configurations see each other: the edge between them is free; a symmetric csc_matrix of bools.

    Args:
        checker: A collision checker.
        points: Configurations, columns.
        parallelize: How many threads, see `CollisionChecker.CheckConfigsCollisionFree`.

    Raises:
        RuntimeError: configurations have another size.
    """
    from scipy.sparse import csc_matrix

    points = np.array(points, dtype=float)
    if points.ndim != 2 or points.shape[0] != checker.plant().num_positions():
        raise RuntimeError(
            f"VisibilityGraph(): points must have {checker.plant().num_positions()} rows, got shape {points.shape}."
        )
    count = points.shape[1]
    free = np.array(checker.CheckConfigsCollisionFree(list(points.T), parallelize), dtype=bool)
    seen = np.diag(free)
    pairs = [(i, j) for i in range(count) for j in range(i) if free[i] and free[j]]
    edges = [(points[:, i], points[:, j]) for i, j in pairs]
    for (i, j), sees in zip(pairs, checker.CheckEdgesCollisionFree(edges, parallelize)):
        seen[i, j] = seen[j, i] = bool(sees)
    return csc_matrix(seen)
