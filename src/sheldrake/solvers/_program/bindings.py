"""The costs and constraints of a program, by kind, and their values.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything
from sheldrake.common._overloads import expect, overload, overloaded
from sheldrake.solvers import _arrays
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions.bindings import Binding, BindingBase, as_kind
from sheldrake.solvers._functions.cone_constraints import (
    ExponentialConeConstraint,
    LinearMatrixInequalityConstraint,
    LorentzConeConstraint,
    PositiveSemidefiniteConstraint,
    RotatedLorentzConeConstraint,
)
from sheldrake.solvers._functions.constraints import (
    BoundingBoxConstraint,
    LinearComplementarityConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    QuadraticConstraint,
)
from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost
from sheldrake.solvers._functions.evaluators import Constraint, Cost, EvaluatorBase, VisualizationCallback
from sheldrake.solvers._functions.norm_costs import L2NormCost
from sheldrake.solvers._ids import ProgramAttribute
from sheldrake.solvers._program.variables import ProgramVariables
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Kind = TypeVar("Kind", bound=EvaluatorBase)
_A = ProgramAttribute

# Kinds in the order in which a program lists them, and what a solver must know for each. An evaluator belongs to the
# most special kind that it is of: subclasses are looked for first.
COSTS: dict[type[EvaluatorBase], ProgramAttribute] = {
    Cost: _A.kGenericCost,
    LinearCost: _A.kLinearCost,
    QuadraticCost: _A.kQuadraticCost,
    L2NormCost: _A.kL2NormCost,
}
CONSTRAINTS: dict[type[EvaluatorBase], ProgramAttribute] = {
    Constraint: _A.kGenericConstraint,
    QuadraticConstraint: _A.kQuadraticConstraint,
    LinearConstraint: _A.kLinearConstraint,
    LinearEqualityConstraint: _A.kLinearEqualityConstraint,
    BoundingBoxConstraint: _A.kLinearConstraint,
    LorentzConeConstraint: _A.kLorentzConeConstraint,
    RotatedLorentzConeConstraint: _A.kRotatedLorentzConeConstraint,
    LinearMatrixInequalityConstraint: _A.kPositiveSemidefiniteConstraint,
    PositiveSemidefiniteConstraint: _A.kPositiveSemidefiniteConstraint,
    LinearComplementarityConstraint: _A.kLinearComplementarityConstraint,
    ExponentialConeConstraint: _A.kExponentialConeConstraint,
}
_BINARY = frozenset({_A.kBinaryVariable})
_FLAT = (QuadraticCost, LinearCost, LinearConstraint, LinearEqualityConstraint, BoundingBoxConstraint)
_AFFINE = (L2NormCost, LorentzConeConstraint, RotatedLorentzConeConstraint, ExponentialConeConstraint)
_FIXED = (LinearMatrixInequalityConstraint, PositiveSemidefiniteConstraint)  # whose numbers never change
_CONVEX = frozenset((*_FLAT, *_AFFINE, *_FIXED))
ATTRIBUTES: dict[type[EvaluatorBase], ProgramAttribute] = {**COSTS, **CONSTRAINTS, VisualizationCallback: _A.kCallback}


class ProgramBindings:
    """Costs, constraints and callbacks of a program: each in the list of its kind.

    Args:
        variables: The program's variables, to which they are bound.
    """

    def __init__(self, variables: ProgramVariables) -> None:
        self._variables = variables
        self._lists: dict[type[EvaluatorBase], list[BindingBase]] = {}  # of the kinds there are
        self._attributes: frozenset[ProgramAttribute] | None = None  # of the costs and constraints, once known
        self.version = object()  # another one when there are other bindings
        self._flat: tuple[tuple[object, object], tuple[list[Any], list[Any], list[Any], np.ndarray]] | None = None

    def copy(self, variables: ProgramVariables) -> ProgramBindings:
        """The same evaluators in lists of their own, bound to a copy of the variables."""
        out = ProgramBindings(variables)
        out._lists = {kind: list(bindings) for kind, bindings in self._lists.items()}
        return out

    def add(self, binding: BindingBase[Kind]) -> BindingBase[Kind]:
        """Keeps a cost, constraint or callback in the list of its kind; returns it as a binding of that kind.

        A constraint without rows says nothing, and is not kept.

        Raises:
            RuntimeError: one of its variables is no decision variable.
        """
        self._variables.check_decisions(binding._list)
        evaluator = binding._evaluator
        kind = _kind_of(evaluator.__class__)  # type: ignore[arg-type]
        out = as_kind(kind, binding)
        if evaluator._num_outputs or not isinstance(evaluator, Constraint):
            known = self._lists.get(kind)
            if known is None:
                known = self._lists[kind] = []
            known.append(out)
            self._attributes, self.version = None, object()
        return cast("BindingBase[Kind]", out)

    def of(self, kind: type[Kind]) -> list[BindingBase[Kind]]:
        """All of one kind, in the order they were added. Of `Cost` and `Constraint`: those of no more special kind."""
        return list(self._lists.get(kind, ()))

    def _of_all(self, kinds: Iterable[type[EvaluatorBase]]) -> list[BindingBase]:
        """All of some kinds, one kind after the other."""
        return [b for kind in kinds if kind in self._lists for b in self._lists[kind]]

    def all_costs(self) -> list[BindingBase]:
        """All costs, each as of its kind."""
        return self._of_all(COSTS)

    def all(self) -> list[BindingBase]:
        """All costs, constraints and callbacks."""
        return self._of_all(ATTRIBUTES)

    def have_contents(self) -> bool:
        """Whether there are linear and quadratic costs, lengths, linear constraints and cones alone."""
        return not any([bindings for kind, bindings in self._lists.items() if bindings and kind not in _CONVEX])

    def are_at_most_quadratic(self) -> bool:
        """Whether there are linear and quadratic costs and linear constraints alone."""
        return not any([bindings for kind, bindings in self._lists.items() if bindings and kind not in _FLAT])

    def flat(self) -> tuple[list[Any], list[Any], list[Any], np.ndarray]:
        """Quadratic costs, linear ones and linear constraints; the places of their variables in this order."""
        seen = self.version, self._variables.decisions()
        if self._flat is None or self._flat[0][0] is not seen[0] or self._flat[0][1] is not seen[1]:
            quadratic, linear, *rows = (self._lists.get(kind, []) for kind in _FLAT)
            all_rows = [b for some in rows for b in some]
            at = self.places(*quadratic, *linear, *all_rows)
            self._flat = seen, (quadratic, linear, all_rows, at)
        return self._flat[1]

    def contents(self) -> tuple[list[object], list[object]]:
        """What costs and constraints are made of, where `have_contents()`.

        First matrices, then bounds, linear costs and constants. As arrays of evaluators never change in place, whatever
        was made of these bindings still fits while these are the very same objects.
        """
        found = ([b._evaluator for b in self._lists.get(kind, ())] for kind in _FLAT)
        quadratic, linear, rows, equations, boxes = found
        rows += equations
        matrices = [e._numbers or e._Q for e in quadratic] + [e._row or e._A for e in rows]
        for b in self._of_all(_AFFINE):
            matrices += (b._evaluator._A, b._evaluator._b)  # type: ignore[attr-defined]
        costs = (
            [e._numbers or e._b for e in quadratic]
            + [e._b for e in linear]
            + [e._c for e in quadratic]
            + [e._a for e in linear]
        )
        rows += boxes
        bounds = [e._row or e._lower for e in rows] + [e._row or e._upper for e in rows]
        return matrices, costs + bounds

    def are_convex(self) -> bool:
        """Whether each quadratic cost is convex."""
        return QuadraticCost.are_convex([b._evaluator for b in self._lists.get(QuadraticCost, ())])

    def places(self, *bindings: BindingBase) -> np.ndarray:
        """Places of the variables of bindings among the decision variables, one binding after the other, shape (n,)."""
        return self._variables.places_in(bindings)

    # What there is

    def generic_costs(self) -> list[Binding[Cost]]:
        """Returns the bindings of the generic costs, in the order they were added."""
        return self.of(Cost)

    def linear_costs(self) -> list[Binding[LinearCost]]:
        """Returns the bindings of the linear costs, in the order they were added."""
        return self.of(LinearCost)

    def quadratic_costs(self) -> list[Binding[QuadraticCost]]:
        """Returns the bindings of the quadratic costs, in the order they were added."""
        return self.of(QuadraticCost)

    def l2norm_costs(self) -> list[Binding[L2NormCost]]:
        """Returns the bindings of the l2norm costs, in the order they were added."""
        return self.of(L2NormCost)

    def generic_constraints(self) -> list[Binding[Constraint]]:
        """Returns the bindings of the generic constraints, in the order they were added."""
        return self.of(Constraint)

    def quadratic_constraints(self) -> list[Binding[QuadraticConstraint]]:
        """Returns the bindings of the quadratic constraints, in the order they were added."""
        return self.of(QuadraticConstraint)

    def linear_constraints(self) -> list[Binding[LinearConstraint]]:
        """Returns the bindings of the linear constraints, in the order they were added."""
        return self.of(LinearConstraint)

    def linear_equality_constraints(self) -> list[Binding[LinearEqualityConstraint]]:
        """Returns the bindings of the linear equality constraints, in the order they were added."""
        return self.of(LinearEqualityConstraint)

    def bounding_box_constraints(self) -> list[Binding[BoundingBoxConstraint]]:
        """Returns the bindings of the bounding box constraints, in the order they were added."""
        return self.of(BoundingBoxConstraint)

    def lorentz_cone_constraints(self) -> list[Binding[LorentzConeConstraint]]:
        """Returns the bindings of the lorentz cone constraints, in the order they were added."""
        return self.of(LorentzConeConstraint)

    def rotated_lorentz_cone_constraints(self) -> list[Binding[RotatedLorentzConeConstraint]]:
        """Returns the bindings of the rotated lorentz cone constraints, in the order they were added."""
        return self.of(RotatedLorentzConeConstraint)

    def linear_matrix_inequality_constraints(self) -> list[Binding[LinearMatrixInequalityConstraint]]:
        """Returns the bindings of the linear matrix inequality constraints, in the order they were added."""
        return self.of(LinearMatrixInequalityConstraint)

    def positive_semidefinite_constraints(self) -> list[Binding[PositiveSemidefiniteConstraint]]:
        """Returns the bindings of the positive semidefinite constraints, in the order they were added."""
        return self.of(PositiveSemidefiniteConstraint)

    def linear_complementarity_constraints(self) -> list[Binding[LinearComplementarityConstraint]]:
        """Returns the bindings of the linear complementarity constraints, in the order they were added."""
        return self.of(LinearComplementarityConstraint)

    def exponential_cone_constraints(self) -> list[Binding[ExponentialConeConstraint]]:
        """Returns the bindings of the exponential cone constraints, in the order they were added."""
        return self.of(ExponentialConeConstraint)

    def visualization_callbacks(self) -> list[Binding[VisualizationCallback]]:
        """Returns the bindings of the visualization callbacks, in the order they were added."""
        return self.of(VisualizationCallback)

    def GetAllCosts(self) -> list[Binding[Cost]]:
        """Returns the bindings of all costs."""
        return [as_kind(Cost, b) for b in self._of_all(COSTS)]

    def GetAllConstraints(self) -> list[Binding[Constraint]]:
        """Returns the bindings of all constraints."""
        return [as_kind(Constraint, b) for b in self._of_all(CONSTRAINTS)]

    def GetLinearConstraints(self) -> list[Binding[LinearConstraint]]:
        """Returns the bindings of linear constraints, then of linear equalities; bounding boxes do not count."""
        linear = (LinearConstraint, LinearEqualityConstraint)
        return [as_kind(LinearConstraint, b) for b in self._of_all(linear)]

    def required_capabilities(self) -> set[ProgramAttribute]:
        """Returns what a solver must know how to handle."""
        return set(self.attributes())

    def attributes(self) -> frozenset[ProgramAttribute]:
        """The same, found out once for the costs and constraints there are."""
        if self._attributes is None:
            self._attributes = frozenset([ATTRIBUTES[kind] for kind, bindings in self._lists.items() if bindings])
        return self._attributes | _BINARY if self._variables.has_binaries() else self._attributes

    def IsThreadSafe(self) -> bool:
        """Tells whether several threads may evaluate it at once; not with Python functions."""
        return all(b.evaluator().is_thread_safe() for b in self.all())

    # Taking out

    @checked
    def RemoveDecisionVariable(self, var: Variable) -> int:
        """Takes out a variable that no cost or constraint has, and returns the place it had.

        Raises:
            ValueError: it is in use.
            ValueError: it is none of the decision variables.
        """
        if not self._variables.is_decision(var):
            raise ValueError(f"RemoveDecisionVariable: {var} is not a decision variable of this MathematicalProgram.")
        for binding in self.all():
            if any(v is var for v in binding.variables()):
                text = str(binding).rstrip("\n")
                raise ValueError(f"RemoveDecisionVariable: {var} is associated with a {text}.")
        return self._variables.remove(var)

    @checked
    def RemoveCost(self, cost: BindingBase) -> int:
        """Takes out a cost and returns how many times it was there."""
        return self._remove(cost)

    @checked
    def RemoveConstraint(self, constraint: BindingBase) -> int:
        """Takes out a constraint and returns how many times it was there."""
        return self._remove(constraint)

    @checked
    def RemoveVisualizationCallback(self, callback: BindingBase) -> int:
        """Takes out a callback and returns how many times it was there."""
        return self._remove(callback)

    def _remove(self, binding: BindingBase) -> int:
        removed, self._attributes, self.version = 0, None, object()
        for kind, bindings in self._lists.items():
            kept = [b for b in bindings if b != binding]
            removed += len(bindings) - len(kept)
            self._lists[kind] = kept
        return removed

    # Values

    @checked
    def GetBindingVariableValues(self, binding: BindingBase, prog_var_vals: ArrayLike) -> np.ndarray:
        """Returns the values of the variables of a binding from those of all decision variables.

        Raises:
            RuntimeError: the number of values is another than that of decision variables, or a variable is none.
        """
        return self._own_values(binding, self._all_values(prog_var_vals))

    def _all_values(self, prog_var_vals: ArrayLike) -> np.ndarray:
        """Values of all decision variables as a vector."""
        values = np.asarray(prog_var_vals)
        if values.dtype != object:
            values = values.astype(float, copy=False)
        if values.ndim == 2 and 1 in values.shape:
            values = values.ravel()
        count = self._variables.num_vars()
        if values.shape != (count,):
            raise RuntimeError(
                f"GetBindingVariableValues(): expected {count} values of decision variables, got shape {values.shape}."
            )
        return values

    def _own_values(self, binding: BindingBase, values: np.ndarray) -> np.ndarray:
        """Those of the variables of a binding."""
        try:
            return values[self._variables.places_in((binding,))]
        except KeyError:
            self._variables.FindDecisionVariableIndices(binding.variables())  # says which one is none
            raise

    def EvalBinding(self, binding: BindingBase, prog_var_vals: ArrayLike) -> np.ndarray:
        """Returns the value of a cost or constraint for values of all decision variables."""
        found: BindingBase = expect("EvalBinding", binding, BindingBase)
        return found.evaluator().Eval(self.GetBindingVariableValues(binding, prog_var_vals))

    def EvalBindings(self, bindings: Iterable[BindingBase], prog_var_vals: ArrayLike) -> np.ndarray:
        """Returns the values of several, one after the other."""
        return _arrays.joined([self.EvalBinding(b, prog_var_vals) for b in bindings], float)

    def EvalBindingVectorized(self, binding: BindingBase, prog_var_vals: ArrayLike) -> np.ndarray:
        """Returns the values as columns for values of all decision variables as columns."""
        return np.stack([self.EvalBinding(binding, c) for c in np.asarray(prog_var_vals, dtype=float).T], axis=1)

    def EvalBindingAtInitialGuess(self, binding: BindingBase) -> np.ndarray:
        """Returns the value at the initial guess."""
        return self.EvalBinding(binding, self._variables.initial_guess())

    @overloaded(
        overload(binding=kinds.binding, prog_var_vals=kinds.values, tol=(kinds.number, 1e-6)),
        overload(bindings=anything, prog_var_vals=kinds.values, tol=(kinds.number, 1e-6)),
    )
    def CheckSatisfied(
        self, bindings: BindingBase[Constraint] | Iterable[BindingBase[Constraint]], values: ArrayLike, tol: float
    ) -> bool:
        """Tells whether one or several constraints are satisfied; called as `(binding(s), prog_var_vals, tol=1e-6)`."""
        found: Iterable[BindingBase[Constraint]] = [bindings] if isinstance(bindings, BindingBase) else bindings
        all_values = self._all_values(values)
        return all(bool(b.evaluator().CheckSatisfied(self._own_values(b, all_values), tol)) for b in found)

    @overloaded(
        overload(binding=kinds.binding, tol=(kinds.number, 1e-6)),
        overload(bindings=anything, tol=(kinds.number, 1e-6)),
    )
    def CheckSatisfiedAtInitialGuess(
        self, bindings: BindingBase[Constraint] | Iterable[BindingBase[Constraint]], tol: float
    ) -> bool:
        """Tells whether one or several constraints are satisfied at the guess; called as `(binding(s), tol=1e-6)`."""
        return self.CheckSatisfied(bindings, self._variables.initial_guess(), tol)


@functools.cache
def _kind_of(cls: type) -> type[EvaluatorBase]:
    """The most special kind that evaluators of a class are of."""
    return next(base for base in cls.__mro__ if base in ATTRIBUTES)
