"""Quadratic programs as semidefinite ones that are no harder to satisfy (Shor, 1987)."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._options import Options
from sheldrake.common._overloads import overload, overloaded
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import LinearConstraint, QuadraticConstraint
from sheldrake.solvers._functions.costs import QuadraticCost, is_semidefinite
from sheldrake.solvers._ids import ProgramAttribute
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _build as build


class SemidefiniteRelaxationOptions(Options):
    """What a relaxation also says of products of constraints.

    Args:
        add_implied_linear_equality_constraints: Products of equations with variables.
        add_implied_linear_constraints: Products of inequalities with each other.
        preserve_convex_quadratic_constraints: Convex quadratic constraints of the program hold for y as they are, as
            rotated Lorentz cones, and not for the products alone.
    """

    add_implied_linear_equality_constraints: bool = True
    add_implied_linear_constraints: bool = True
    preserve_convex_quadratic_constraints: bool = False

    def set_to_strongest(self) -> None:
        """Says all that is implied."""
        for name in self._defaults:
            setattr(self, name, True)

    def set_to_weakest(self) -> None:
        """Says nothing that is implied: Shor's relaxation."""
        for name in self._defaults:
            setattr(self, name, False)


_RELAXED = {
    ProgramAttribute.kLinearCost,
    ProgramAttribute.kQuadraticCost,
    ProgramAttribute.kLinearConstraint,
    ProgramAttribute.kLinearEqualityConstraint,
    ProgramAttribute.kQuadraticConstraint,
    ProgramAttribute.kCallback,
    ProgramAttribute.kBinaryVariable,  # as a variable that may be anything
}


@overloaded(
    overload(prog=instance_of(MathematicalProgram), options=(instance_of(SemidefiniteRelaxationOptions), None)),
    overload(
        lambda prog, groups, options: _relaxed(prog, options, _distinct(groups)),
        prog=instance_of(MathematicalProgram),
        variable_groups=instance_of(list, tuple),
        options=(instance_of(SemidefiniteRelaxationOptions), None),
    ),
)
def MakeSemidefiniteRelaxation(
    prog: MathematicalProgram, options: SemidefiniteRelaxationOptions | None
) -> MathematicalProgram:
    """Returns a program in y and Y, with [Y, y; y', 1] positive semidefinite, where products y_i y_j are Y_ij.

    Called as `(prog, variable_groups, options=...)` with a list of Variables it has such a matrix for each group, for
    the costs and constraints of the group's variables alone; the matrices agree where groups overlap.

    Args:
        prog: A program with linear and quadratic costs and constraints.
        options: What is added beyond the relaxation itself.

    Raises:
        RuntimeError: the program has other costs or constraints, or ones that are not convex and belong to no group.
    """
    return _relaxed(prog, options, [list(prog.decision_variables())])


def _distinct(groups: Iterable[Sequence[Variable]]) -> list[list[Variable]]:
    return list({tuple(v.get_id() for v in group): list(group) for group in groups}.values())


def _relaxed(
    prog: MathematicalProgram, options: SemidefiniteRelaxationOptions | None, groups: list[list[Variable]]
) -> MathematicalProgram:
    for attribute in sorted(prog.required_capabilities() - _RELAXED, key=lambda a: a.value):
        words = re.sub("(?=[A-Z])", " ", attribute.name.removeprefix("k")).strip().lower()
        raise RuntimeError(
            "MakeSemidefiniteRelaxation() does not (yet) support this program: it has "
            f"{words}s, and only linear and quadratic costs and constraints can be relaxed."
        )
    return _Relaxation(prog, options or SemidefiniteRelaxationOptions(), groups).program


class _Group:
    """Variables y and the matrix Y of their products."""

    def __init__(self, variables: list[Variable], program: MathematicalProgram):
        self.y = np.array(variables, dtype=object)
        self.Y = program.NewSymmetricContinuousVariables(len(variables), "Y")
        self._number = {v.get_id(): k for k, v in enumerate(variables)}

    def has(self, binding: BindingBase) -> bool:
        """Whether all variables of a cost or constraint are of the group."""
        return all(v.get_id() in self._number for v in binding._variables)

    def numbers(self, variables: Iterable[Variable]) -> list[int]:
        """Where variables are among those of the group."""
        return [self._number[v.get_id()] for v in variables]

    def product(self, u: Variable, v: Variable) -> Variable:
        """The element of Y that stands for a product."""
        i, j = self.numbers((u, v))
        return self.Y[i, j]

    def common(self, other: _Group) -> list[Variable]:
        """Variables that another group has too."""
        return [v for v in self.y if v.get_id() in other._number]

    def lifted(self, Q: np.ndarray, b: np.ndarray, at: Sequence[int] | np.ndarray) -> Expression:
        """1/2 x' Q x + b' x with Y in the place of products."""
        terms = [0.5 * Q[i, j] * self.Y[at[i], at[j]] for i, j in zip(*np.nonzero(Q))]
        terms += [value * self.y[k] for k, value in zip(at, b) if value]
        return build.sum_of([build.expect("MakeSemidefiniteRelaxation", t) for t in terms])


class _Relaxation:
    def __init__(self, prog: MathematicalProgram, options: SemidefiniteRelaxationOptions, groups: list[list[Variable]]):
        self._prog = prog
        self.program = prog.Clone()
        one = Variable("one")
        self.program.AddDecisionVariables(np.array([one], dtype=object))
        self._groups = [_Group(variables, self.program) for variables in groups]
        for group in self._groups:
            n = len(group.y)
            X = np.empty((n + 1, n + 1), dtype=object)
            X[:n, :n], X[:n, n], X[n, :n], X[n, n] = group.Y, group.y, group.y, one
            self.program.AddPositiveSemidefiniteConstraint(X)
        self.program.AddLinearEqualityConstraint(one == 1)
        self._costs()
        self._quadratic_constraints()
        if options.preserve_convex_quadratic_constraints:
            self._convex_constraints()
        for group in self._groups:
            if options.add_implied_linear_constraints:
                self._inequalities(group)
            if options.add_implied_linear_equality_constraints:
                self._equations(group)
        self._agree()

    def _groups_of(self, binding: BindingBase[QuadraticCost] | BindingBase[QuadraticConstraint]) -> list[_Group]:
        found = [group for group in self._groups if group.has(binding)]
        if not found and not binding._evaluator.is_convex():
            raise RuntimeError(
                f"MakeSemidefiniteRelaxation(): {binding} is not convex, and no group has all its variables."
            )
        return found

    def _costs(self) -> None:
        for binding in self._prog.quadratic_costs():
            for group in self._groups_of(binding)[:1]:
                self.program.RemoveCost(binding)
                c = binding._evaluator
                self.program.AddLinearCost(group.lifted(c._Q, c._b, group.numbers(binding._variables)) + c._c)

    def _quadratic_constraints(self) -> None:
        for binding in self._prog.quadratic_constraints():
            for k, group in enumerate(self._groups_of(binding)):
                if k == 0:
                    self.program.RemoveConstraint(binding)
                c = binding._evaluator
                e = group.lifted(c._Q, c._b, group.numbers(binding._variables))
                self.program.AddLinearConstraint(e, c._lower[0], c._upper[0])

    def _convex_constraints(self) -> None:
        """1/2 y' Q y + b' y <= c of y itself, where it is convex; those of no group are there already."""
        for binding in self._prog.quadratic_constraints():
            c = binding._evaluator
            if not any(group.has(binding) for group in self._groups):
                continue
            for sign, bound in ((1.0, c._upper[0]), (-1.0, -c._lower[0])):
                if np.isfinite(bound) and c._Q.any() and is_semidefinite(sign * c._Q):
                    self.program.AddQuadraticAsRotatedLorentzConeConstraint(
                        sign * c._Q, sign * c._b, -bound, binding._variables
                    )

    def _agree(self) -> None:
        """Products of variables that are in two groups are the same in both."""
        for one, other in itertools.combinations(self._groups, 2):
            for u, v in itertools.combinations_with_replacement(one.common(other), 2):
                self.program.AddLinearEqualityConstraint(one.product(u, v) - other.product(u, v), 0.0)

    def _rows(
        self, bindings: Sequence[BindingBase[LinearConstraint]], group: _Group
    ) -> Iterator[tuple[np.ndarray, float, float]]:
        """Rows of linear constraints over all variables of a group, with their bounds."""
        for binding in filter(group.has, bindings):
            c = binding._evaluator
            block = c._jacobian(np.zeros(len(binding._variables)))
            A = np.zeros((len(block), len(group.y)))
            np.add.at(A.T, group.numbers(binding._variables), block.T)
            yield from zip(A, c._lower, c._upper)

    def _equations(self, group: _Group) -> None:
        """(a' y - b) y_j = 0."""
        rows = list(self._rows(self._prog.linear_equality_constraints(), group))
        for j in range(len(group.y)):
            for a, b, _ in rows:
                terms = [a[i] * group.Y[i, j] for i in np.flatnonzero(a)]
                e = build.sum_of([build.expect("MakeSemidefiniteRelaxation", t) for t in terms]) - b * group.y[j]
                self.program.AddLinearEqualityConstraint(e, 0.0)

    def _inequalities(self, group: _Group) -> None:
        """Products of c_i - a_i' y >= 0, each pair once."""
        rows = []
        linear = [*self._prog.bounding_box_constraints(), *self._prog.linear_constraints()]
        for a, low, high in self._rows(linear, group):
            rows += [(-a, -low)] if np.isfinite(low) else []
            rows += [(a, high)] if np.isfinite(high) else []
        es, lower = [], []
        for i, (a, c) in enumerate(rows):
            for b, d in rows[i:]:
                M = np.outer(a, b)
                es.append(group.lifted(M + M.T, -d * a - c * b, np.arange(len(group.y))))
                lower.append(-c * d)
        kept = [k for k, e in enumerate(es) if len(e.GetVariables())]
        if kept:
            array = np.array([es[k] for k in kept], dtype=object)
            self.program.AddLinearConstraint(array, np.array(lower)[kept], np.full(len(kept), np.inf))
