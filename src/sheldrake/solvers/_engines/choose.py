"""Choosing a solver, and solving.

By the kind of program: for each kind a list of solvers, the best first, of which the first that is installed is taken.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common._checked import checked
from sheldrake.common._overloads import incompatible
from sheldrake.common._thread_team import in_parallel, threads_of
from sheldrake.solvers._engines.clarabel import ClarabelSolver, CsdpSolver
from sheldrake.solvers._engines.daqp import DaqpSolver
from sheldrake.solvers._engines.equality import EqualityConstrainedQPSolver, LinearSystemSolver
from sheldrake.solvers._engines.highs import ClpSolver, HighsSolver
from sheldrake.solvers._engines.interface import Engine, SolverInterface
from sheldrake.solvers._engines.ipopt import IpoptSolver
from sheldrake.solvers._engines.lemke import MobyLcpSolver, UnrevisedLemkeSolver
from sheldrake.solvers._engines.nlopt import NloptSolver
from sheldrake.solvers._engines.small_quadratic import ActiveSetSolver
from sheldrake.solvers._engines.snopt import InteriorPointSolver, SnoptSolver
from sheldrake.solvers._engines.splitting import OsqpSolver, ScsSolver
from sheldrake.solvers._engines.unavailable import GurobiSolver, MosekSolver
from sheldrake.solvers._ids import ProgramType, SolverId
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import type_of_program
from sheldrake.solvers._result import MathematicalProgramResult
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common import Parallelism
    from sheldrake.solvers import SolverOptions

_P = ProgramType
_NLP: list[type[Engine]] = [InteriorPointSolver, IpoptSolver, NloptSolver]
_BEST: dict[ProgramType, list[type[Engine]]] = {
    _P.kLP: [GurobiSolver, MosekSolver, ClpSolver, ClarabelSolver, *_NLP, ScsSolver],
    _P.kQP: [GurobiSolver, MosekSolver, ClarabelSolver, OsqpSolver, *_NLP, ScsSolver, DaqpSolver],
    _P.kSOCP: [MosekSolver, GurobiSolver, ClarabelSolver, ScsSolver, *_NLP],
    _P.kSDP: [MosekSolver, ClarabelSolver, ScsSolver],
    _P.kGP: [MosekSolver, ClarabelSolver, ScsSolver],
    _P.kCGP: [MosekSolver, ClarabelSolver, ScsSolver],
    _P.kMILP: [GurobiSolver, MosekSolver, HighsSolver],
    _P.kMIQP: [GurobiSolver, MosekSolver],
    _P.kMISOCP: [GurobiSolver, MosekSolver],
    _P.kMISDP: [MosekSolver],
    _P.kQuadraticCostConicConstraint: [MosekSolver, GurobiSolver, ClarabelSolver, ScsSolver],
    _P.kNLP: _NLP,
    _P.kLCP: [MobyLcpSolver, InteriorPointSolver],
    _P.kUnknown: [],
}
_ALL: list[type[Engine]] = [
    LinearSystemSolver,
    EqualityConstrainedQPSolver,
    MosekSolver,
    GurobiSolver,
    ClarabelSolver,
    OsqpSolver,
    DaqpSolver,
    MobyLcpSolver,
    *_NLP,
    SnoptSolver,
    ClpSolver,
    CsdpSolver,
    ScsSolver,
    UnrevisedLemkeSolver,
    HighsSolver,
]


def _usable(cls: type[Engine]) -> bool:
    return cls._is_available() and cls._is_enabled()


@checked
def GetAvailableSolvers(prog_type: ProgramType) -> list[SolverId]:
    """Returns the solvers for a family of programs that can be used here, the best first."""
    return [cls.id() for cls in _BEST[prog_type] if _usable(cls)]


@checked
def ChooseBestSolver(prog: MathematicalProgram) -> SolverId:
    """Returns the solver to use for a program.

    Raises:
        ValueError: none of those that can be used here can solve it.
    """
    return _best(prog).id()


_FIRST: list[type[Engine]] = [LinearSystemSolver, EqualityConstrainedQPSolver]
_MIXED = {_P.kMILP, _P.kMIQP, _P.kMISOCP, _P.kMISDP}
_CANDIDATES = {
    kind: [*([] if kind in _MIXED else _FIRST), *best, *(_ALL if kind is _P.kUnknown else [])]
    for kind, best in _BEST.items()
}


class _Choice:
    """The solver to use for a program, whatever its bounds, linear costs and constants (see `ChooseBestSolver`)."""

    def __init__(self, prog: MathematicalProgram) -> None:
        self.solver = _first_that_fits(prog)

    def moved(self, prog: MathematicalProgram) -> _Choice:
        """The same for other numbers."""
        return self


def _best(prog: MathematicalProgram) -> type[Engine]:
    return parts_of(prog).form(_Choice, prog).solver


def _first_that_fits(prog: MathematicalProgram) -> type[Engine]:
    has = parts_of(prog).bindings.attributes()
    kind = type_of_program(prog, has)
    for cls in _CANDIDATES[kind]:
        if has <= cls._attributes and _usable(cls) and not cls()._restriction(prog):
            return cls
    if kind in _MIXED:
        raise ValueError(
            "There is no available solver for the optimization program, please manually instantiate "
            "MixedIntegerBranchAndBound and solve the problem if the problem size is small, typically with less than a "
            f"dozen of binary variables. (This is a {kind.name[1:]} with {_number_of_binaries(prog)} of them. For it: "
            f"search = MixedIntegerBranchAndBound(prog, {_relaxed_solver(kind)}.id()); search.Solve(); "
            "search.GetSolution(x).)"
        )
    names = ", ".join(sorted(a.name[1:] for a in has))
    raise ValueError(
        f"There is no available solver for the optimization program, a {kind.name[1:]} with {names}. Convex programs "
        "need the package clarabel (pip install sheldrake[solvers])."
    )


def _number_of_binaries(prog: MathematicalProgram) -> int:
    return sum(v.get_type() is Variable.Type.BINARY for v in prog.decision_variables())


def _relaxed_solver(kind: ProgramType) -> str:
    """Who solves the program without its integers."""
    relaxed = {_P.kMILP: _P.kLP, _P.kMIQP: _P.kQP, _P.kMISOCP: _P.kSOCP, _P.kMISDP: _P.kSDP}[kind]
    return next((cls.__name__ for cls in _BEST[relaxed] if _usable(cls)), "ClarabelSolver")


@checked
def MakeSolver(id: SolverId) -> SolverInterface:
    """Returns a solver of a name.

    Raises:
        ValueError: there is none of that name.
    """
    for cls in _ALL:
        if cls.id() == id:
            return cls()
    raise ValueError(f"MakeSolver: no matching solver {id.name()}")


@checked
def MakeFirstAvailableSolver(solver_ids: list[SolverId]) -> SolverInterface:
    """Returns the first of several solvers that can be used here.

    Raises:
        RuntimeError: none can.
    """
    for solver_id in solver_ids:
        solver = MakeSolver(solver_id)
        if solver.available() and solver.enabled():
            return solver
    names = " ".join(i.name() for i in solver_ids)
    raise RuntimeError(f"MakeFirstAvailableSolver(): none of the solvers {names} is available and enabled.")


@checked
def Solve(
    prog: MathematicalProgram, initial_guess: ArrayLike | None = None, solver_options: SolverOptions | None = None
) -> MathematicalProgramResult:
    """Solves a program with the solver that suits it best.

    Small quadratic programs with one solution are solved to rounding by rows that hold with equality ("Active set").

    Args:
        prog: The program.
        initial_guess: Values of all decision variables to start from; those of the program if absent.
        solver_options: Options on top of those of the program.

    Raises:
        ValueError: no solver that can be used here can solve it.
    """
    if not isinstance(prog, MathematicalProgram):
        accepted = ["(prog: MathematicalProgram, initial_guess = None, solver_options: SolverOptions = None)"]
        raise incompatible("Solve", accepted, (prog, initial_guess, solver_options), {})
    if ActiveSetSolver.may_solve(prog):
        result: MathematicalProgramResult = ActiveSetSolver()._solve(prog, initial_guess, solver_options)
        if result.is_success():
            return result
    return _best(prog)()._solve(prog, initial_guess, solver_options)


def SolveInParallel(
    progs: list[MathematicalProgram],
    initial_guesses: list | None = None,
    solver_options: SolverOptions | None = None,
    solver_ids: list | None = None,
    parallelism: Parallelism | int | bool | None = None,
    dynamic_schedule: bool = False,
    solver_id: SolverId | None = None,
) -> list[MathematicalProgramResult]:
    """Solves several programs, several at a time, and returns their results in order: the same as one by one.

    Solvers leave Python while they work. Programs that are not thread-safe (see `IsThreadSafe`: those with Python
    functions), and a program that is given again, are solved by the calling thread, after the others.

    Args:
        progs: The programs.
        initial_guesses: One for each, or none.
        solver_options: One for all, or a list of one for each.
        solver_ids: A solver for each; None for the best.
        parallelism: How many at a time: a number, a Parallelism, or True for as many threads as this process may use;
            these if not given.
        dynamic_schedule: Accepted, without effect: a thread always takes the next program when it is done with one.
        solver_id: One solver for all.

    Raises:
        ValueError: a list has another length than `progs`.
    """
    if isinstance(solver_ids, SolverId):
        solver_id, solver_ids = solver_ids, None
    each = solver_options if isinstance(solver_options, (list, tuple)) else [solver_options] * len(progs)
    guesses = [None] * len(progs) if initial_guesses is None else initial_guesses
    ids = [solver_id] * len(progs) if solver_ids is None else solver_ids
    for name, items in (("initial_guesses", guesses), ("solver_options", each), ("solver_ids", ids)):
        if len(items) != len(progs):
            raise ValueError(f"SolveInParallel(): {len(progs)} programs, but {len(items)} {name}.")

    def solve(k: int) -> MathematicalProgramResult:
        asked = ids[k]
        return (Solve if asked is None else MakeSolver(asked).Solve)(progs[k], guesses[k], each[k])

    first = {id(prog): k for k, prog in reversed(list(enumerate(progs)))}
    at_once = [k for k, prog in enumerate(progs) if first[id(prog)] == k and prog.IsThreadSafe()]
    found = dict(zip(at_once, in_parallel(solve, at_once, threads_of(parallelism, True))))
    return [found[k] if k in found else solve(k) for k in range(len(progs))]
