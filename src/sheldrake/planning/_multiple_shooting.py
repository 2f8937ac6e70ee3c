"""Trajectories as states and inputs at samples of time: what all transcriptions have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import overload, overloaded
from sheldrake.solvers import (
    BoundingBoxConstraint,
    Constraint,
    LinearConstraint,
    LinearEqualityConstraint,
    MathematicalProgram,
    _arrays,
)
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions.bindings import as_kind, bind
from sheldrake.solvers._parse.costs import cost
from sheldrake.solvers._parse.formulas import formula_constraint
from sheldrake.solvers._program.parts import parts_of
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _build as build
from sheldrake.symbolic import _traverse as traverse

if TYPE_CHECKING:
    from sheldrake.common._types import Symbolic
    from sheldrake.solvers import Binding, MathematicalProgramResult
    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.solvers._functions.evaluators import Cost, VisualizationCallback
    from sheldrake.symbolic import Formula
    from sheldrake.trajectories import PiecewisePolynomial

_UNKNOWN = 0.003  # Initial guess of a trajectory that is not given; zero is often singular.


def _placeholders(rows: int, name: str) -> np.ndarray:
    return traverse.object_array([Variable(f"{name}({i})") for i in range(rows)])


@checked
@no_constructor()
class MultipleShooting:
    """Decision variables for states, inputs and, maybe, time steps at N samples, and costs and constraints on them.

    Not made directly. The variables that `time`, `state` and `input` return are placeholders: in costs and constraints
    that are added here they stand for the decision variables of each sample.
    """

    def _set_up(
        self,
        num_inputs: int,
        num_states: int,
        N: int,
        fixed_time_step: float | None,
        prog: MathematicalProgram | None,
    ) -> None:
        if N < 2:
            raise RuntimeError(f"{type(self).__name__}: num_time_samples must be at least 2, got {N}.")
        self._prog = MathematicalProgram() if prog is None else prog
        self._N, self._nx, self._nu = N, num_states, num_inputs
        self._dt = fixed_time_step
        self._x_vars = self._prog.NewContinuousVariables(num_states * N, "x")
        self._u_vars = self._prog.NewContinuousVariables(num_inputs * N, "u")
        self._h_vars = traverse.object_array([])
        if fixed_time_step is None:
            self._h_vars = self._prog.NewContinuousVariables(N - 1, "h")
        self._time = _placeholders(1, "t") if fixed_time_step is not None else traverse.object_array([Variable("t")])
        self._state, self._input = _placeholders(num_states, "x"), _placeholders(num_inputs, "u")
        # The steps before and after a sample. Placeholders are as old, compared with each other, as what they stand
        # for: evaluators have their variables in this order.
        self._steps_around = Variable("h0"), Variable("h1")
        self._sequences: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self._at_samples: dict[Variable, np.ndarray] = {}
        self._stand_for(self._state, self._x_vars.reshape(N, num_states).T)
        self._stand_for(self._input, self._u_vars.reshape(N, num_inputs).T)

    def _stand_for(self, placeholders: np.ndarray, vars: np.ndarray) -> None:
        """Says which decision variables placeholders are, one row each, one column a sample."""
        self._at_samples.update(zip(placeholders.tolist(), vars))

    # Variables

    def prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    def time(self) -> np.ndarray:
        """Returns the placeholder of time [s], shape (1,)."""
        return self._time.copy()

    def _sample(self, vars: np.ndarray, rows: int, index: int) -> np.ndarray:
        if not 0 <= index < self._N:
            raise RuntimeError(f"{type(self).__name__}: there is no sample {index}; there are {self._N}.")
        return vars[rows * index : rows * (index + 1)].copy()

    def state(self, index: int | None = None) -> np.ndarray:
        """Returns the placeholders of the state, or the decision variables of one sample, shape (nx,)."""
        return self._state.copy() if index is None else self._sample(self._x_vars, self._nx, index)

    def input(self, index: int | None = None) -> np.ndarray:
        """Returns the placeholders of the input, or the decision variables of one sample, shape (nu,)."""
        return self._input.copy() if index is None else self._sample(self._u_vars, self._nu, index)

    def initial_state(self) -> np.ndarray:
        """Returns the decision variables of the first state, shape (nx,)."""
        return self.state(0)

    def final_state(self) -> np.ndarray:
        """Returns the decision variables of the last state, shape (nx,)."""
        return self.state(self._N - 1)

    def time_step(self, index: int) -> np.ndarray:
        """Returns the decision variable of one time step [s], shape (1,).

        Raises:
            RuntimeError: time steps are fixed, or there is none of that index.
        """
        self._free_steps("time_step")
        if not 0 <= index < self._N - 1:
            raise RuntimeError(f"time_step(): there is no step {index}; there are {self._N - 1}.")
        return self._h_vars[index : index + 1].copy()

    def _free_steps(self, call: str) -> None:
        if self._dt is not None:
            raise RuntimeError(f"{call}(): the time steps are fixed, they are no decision variables.")

    def fixed_time_step(self) -> float:
        """Returns the time step [s].

        Raises:
            RuntimeError: time steps are decision variables.
        """
        if self._dt is None:
            raise RuntimeError("fixed_time_step(): the time steps are decision variables.")
        return self._dt

    def NewSequentialVariable(self, rows: int, name: str) -> np.ndarray:
        """Returns placeholders of new variables that each sample has, shape (rows,)."""
        if name in self._sequences:
            raise RuntimeError(f"NewSequentialVariable(): {name!r} is there already.")
        vars = self._prog.NewContinuousVariables(rows, self._N, name)
        vars = vars.reshape(rows, self._N)
        self._sequences[name] = (_placeholders(rows, name), vars)
        self._stand_for(*self._sequences[name])
        return self._sequences[name][0].copy()

    def GetSequentialVariableAtIndex(self, name: str, index: int) -> np.ndarray:
        """Returns the decision variables of a sequential variable at one sample, shape (rows,)."""
        return self._sequence(name)[1][:, index].copy()

    def _sequence(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        if name not in self._sequences:
            raise RuntimeError(f"There is no sequential variable {name!r}; there are {sorted(self._sequences)}.")
        return self._sequences[name]

    # Substitution

    def _time_at(self, index: int) -> Expression:
        if self._dt is not None:
            return Expression(index * self._dt)
        return build.sum_of(Expression(h) for h in self._h_vars[:index])

    def _at(self, index: int, wanted: set[Variable]) -> dict[Variable, Any]:
        """What each placeholder that is wanted stands for at a sample."""
        out: dict[Variable, Any] = {self._time[0]: self._time_at(index)} if self._time[0] in wanted else {}
        out.update((v, self._at_samples[v][index]) for v in wanted if v in self._at_samples)
        return out

    def _substituted(self, e: Expression, index: int) -> Expression:
        return e.Substitute(self._at(index, set(traverse.variables_of(e))))

    def _copies(self, template: BindingBase, at: Mapping[Variable, np.ndarray]) -> list:
        """Adds a cost or constraint of placeholders once for each sample, having been parsed once for all.

        Args:
            template: The cost or constraint.
            at: What its variables stand for, one decision variable a sample.
        """
        bindings, evaluator = parts_of(self._prog).bindings, template._evaluator
        out = []
        for vars in np.stack([at[v] for v in template._variables], axis=1):
            out.append(bindings.add(bind(template._kind, evaluator._of_others(vars), vars)))
        return out

    def _add_costs(self, e: Expression, samples: Sequence[int], steps: Mapping[Variable, np.ndarray]) -> None:
        """Adds an expression of placeholders as a cost at some samples.

        Args:
            e: The expression.
            samples: The samples.
            steps: What placeholders of steps stand for, one decision variable a sample.
        """
        wanted = set(traverse.variables_of(e))
        at = {v: vars[list(samples)] for v, vars in self._at_samples.items()} | dict(steps)
        if wanted and wanted <= at.keys():
            self._copies(cost(e), at)
            return
        for k, i in enumerate(samples):
            here = {v: vars[k] for v, vars in steps.items()}
            self._prog.AddCost(e.Substitute(self._at(i, wanted) | here))

    # Costs and constraints

    def AddRunningCost(self, g: Symbolic | np.ndarray) -> None:
        """Adds the integral of an expression of placeholders over time."""
        e = np.asarray(g, dtype=object)
        if e.size != 1:
            raise RuntimeError(f"AddRunningCost(): expected one expression, got shape {e.shape}.")
        self._add_running_cost(_arrays.expression(e.reshape(-1)[0]))

    def _add_running_cost(self, g: Expression) -> None:
        raise NotImplementedError

    def AddFinalCost(self, e: Any = None, *, matrix: Any = None) -> Binding[Cost]:
        """Adds the cost of an expression of placeholders (or a matrix of one) at the last sample."""
        e = np.asarray(matrix if e is None else e, dtype=object)
        if e.size != 1:
            raise RuntimeError(f"AddFinalCost(): expected one expression, got shape {e.shape}.")
        return self._prog.AddCost(self._substituted(_arrays.expression(e.reshape(-1)[0]), self._N - 1))

    @overloaded(
        overload(lambda self, f: self._formula_to_all(f), f=kinds.formula),
        overload(lambda self, fs: [b for f in fs for b in self.AddConstraintToAllKnotPoints(f)], f=kinds.formulas),
        overload(constraint=instance_of(Constraint), vars=kinds.vars),
    )
    def AddConstraintToAllKnotPoints(self, constraint: Constraint, vars: np.ndarray) -> list:
        """Adds a constraint at each sample; called with a formula of placeholders, an array of them, or
        `(constraint, vars)`.
        """
        classes = (BoundingBoxConstraint, LinearEqualityConstraint, LinearConstraint, Constraint)
        cls = next(c for c in classes if isinstance(constraint, c))
        out = []
        for i in range(self._N):
            places = self._at(i, set(vars))
            found = [places.get(v, v) for v in vars]
            binding = bind(cls, constraint, _arrays.variable_vector(traverse.object_array(found)))
            out.append(as_kind(cls, self._prog.AddConstraint(binding)))
        return out

    def _formula_to_all(self, f: Formula) -> list:
        wanted = set(f.GetFreeVariables())
        if wanted and wanted <= self._at_samples.keys():
            return self._copies(formula_constraint(f), self._at_samples)
        bindings = parts_of(self._prog).bindings
        return [bindings.add(formula_constraint(f._substitute(self._at(i, wanted)))) for i in range(self._N)]

    def AddTimeIntervalBounds(self, lower_bound: float, upper_bound: float) -> Binding[Constraint]:
        """Adds bounds on all time steps [s]."""
        self._free_steps("AddTimeIntervalBounds")
        return self._prog.AddBoundingBoxConstraint(float(lower_bound), float(upper_bound), self._h_vars)

    def AddEqualTimeIntervalsConstraints(self) -> list:
        """Adds that all time steps are equal."""
        self._free_steps("AddEqualTimeIntervalsConstraints")
        h = self._h_vars
        if len(h) < 2:
            return []
        equal = LinearEqualityConstraint._of_row([1.0, -1.0], 0.0, 0.0)
        return self._copies(bind(LinearEqualityConstraint, equal, h[:2]), {h[0]: h[:-1], h[1]: h[1:]})

    def AddDurationBounds(self, lower_bound: float, upper_bound: float) -> Binding[Constraint]:
        """Adds bounds on the duration [s]."""
        self._free_steps("AddDurationBounds")
        ones = np.ones((1, len(self._h_vars)))
        return self._prog.AddLinearConstraint(ones, [float(lower_bound)], [float(upper_bound)], self._h_vars)

    # Callbacks

    def _callback(self, vars: list[np.ndarray], show: Callable[[np.ndarray], None]) -> Binding[VisualizationCallback]:
        everything = np.concatenate((self._h_vars, *vars)) if self._dt is None else np.concatenate(vars)
        return self._prog.AddVisualizationCallback(show, everything)

    def _times(self, h: np.ndarray) -> np.ndarray:
        steps = h if self._dt is None else np.full(self._N - 1, self._dt)
        return np.concatenate(([0.0], np.cumsum(steps)))

    def _unpack(self, values: np.ndarray, rows: list[int]) -> tuple[np.ndarray, list[np.ndarray]]:
        at = len(self._h_vars)
        times, out = self._times(values[:at]), []
        for r in rows:
            out.append(values[at : at + r * self._N].reshape(self._N, r).T)
            at += r * self._N
        return times, out

    def AddInputTrajectoryCallback(self, callback: Callable) -> Binding[VisualizationCallback]:
        """Has `callback(times, inputs)` called with iterates; inputs of shape (nu, N)."""

        def show(values: np.ndarray) -> None:
            times, (u,) = self._unpack(values, [self._nu])
            callback(times, u)

        return self._callback([self._u_vars], show)

    def AddStateTrajectoryCallback(self, callback: Callable) -> Binding[VisualizationCallback]:
        """Has `callback(times, states)` called with iterates; states of shape (nx, N)."""

        def show(values: np.ndarray) -> None:
            times, (x,) = self._unpack(values, [self._nx])
            callback(times, x)

        return self._callback([self._x_vars], show)

    def AddCompleteTrajectoryCallback(self, callback: Callable, names: list[str]) -> Binding[VisualizationCallback]:
        """Has `callback(times, states, inputs, values)` called with iterates, values of the named variables."""
        more = [self._sequence(name)[1] for name in names]

        def show(values: np.ndarray) -> None:
            times, found = self._unpack(values, [self._nx, self._nu, *(len(m) for m in more)])
            callback(times, found[0], found[1], found[2:])

        return self._callback([self._x_vars, self._u_vars, *(m.ravel(order="F") for m in more)], show)

    # Guesses and results

    def SetInitialTrajectory(self, traj_init_u: PiecewisePolynomial, traj_init_x: PiecewisePolynomial) -> None:
        """Sets the initial guess to samples of two trajectories; an empty one gives a small constant.

        Raises:
            RuntimeError: both are empty and the time steps are free.
        """
        given = [t for t in (traj_init_u, traj_init_x) if t.get_number_of_segments()]
        if not given and self._dt is None:
            raise RuntimeError("SetInitialTrajectory(): both trajectories are empty.")
        start = max((t.start_time() for t in given), default=0.0)
        if self._dt is not None:
            h = self._dt
        else:
            h = (given[0].end_time() - given[0].start_time()) / (self._N - 1)
            self._prog.SetInitialGuess(self._h_vars, np.full(self._N - 1, h))
        for trajectory, vars, rows in (
            (traj_init_u, self._u_vars, self._nu),
            (traj_init_x, self._x_vars, self._nx),
        ):
            if not rows:
                continue
            values = np.full((self._N, rows), _UNKNOWN)
            if trajectory.get_number_of_segments():
                found = trajectory.vector_values(start + h * np.arange(self._N))
                values[:] = found.T if trajectory.cols() == 1 else found
            self._prog.SetInitialGuess(vars, values.ravel())

    def GetSampleTimes(self, result: MathematicalProgramResult) -> np.ndarray:
        """Returns the times of the samples [s], shape (N,)."""
        return self._times(result.GetSolution(self._h_vars) if self._dt is None else np.zeros(0))

    def _samples(self, result: MathematicalProgramResult, vars: np.ndarray, rows: int) -> np.ndarray:
        return result.GetSolution(vars).reshape(self._N, rows).T if rows else np.zeros((0, self._N))

    def GetStateSamples(self, result: MathematicalProgramResult) -> np.ndarray:
        """Returns the states of the samples, shape (nx, N)."""
        return self._samples(result, self._x_vars, self._nx)

    def GetInputSamples(self, result: MathematicalProgramResult) -> np.ndarray:
        """Returns the inputs of the samples, shape (nu, N)."""
        return self._samples(result, self._u_vars, self._nu)

    def GetSequentialVariableSamples(self, result: MathematicalProgramResult, name: str) -> np.ndarray:
        """Returns the values of a sequential variable, shape (rows, N)."""
        return result.GetSolution(self._sequence(name)[1])

    def ReconstructInputTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the inputs as a PiecewisePolynomial."""
        raise NotImplementedError

    def ReconstructStateTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the states as a PiecewisePolynomial."""
        raise NotImplementedError
