"""Vertices and edges of graphs of convex sets."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._kinds import anything
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import Overload, overload, overloaded
from sheldrake.geometry._ids import _Identifier
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.solvers import Constraint, Cost, MathematicalProgram
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions.bindings import BindingBase, as_kind
from sheldrake.symbolic import MakeVectorContinuousVariable, Variable

if TYPE_CHECKING:
    from sheldrake.solvers import MathematicalProgramResult
    from sheldrake.symbolic import Formula


class VertexId(_Identifier):
    """Names a vertex."""

    __slots__ = ()


class EdgeId(_Identifier):
    """Names an edge."""

    __slots__ = ()


class Transcription(BoundEnum):
    """The programs made of a graph: with binary variables, their relaxation, and that of one path."""

    kMIP = 0
    kRelaxation = 1
    kRestriction = 2


ALL = frozenset(Transcription)
_USE = {"use_in_transcription": (anything, ALL)}
# How costs are given to vertices and edges.
COSTS = (overload(binding=kinds.binding, **_USE), overload(e=kinds.expression, **_USE))


def constraints(name: str) -> tuple[Overload, ...]:
    """How constraints are given to vertices and edges; formulas under one name or another."""
    return overload(binding=kinds.binding, **_USE), overload(**{name: kinds.formula, **_USE})


@no_constructor()
class Element:
    """What vertices and edges have in common: costs and constraints on their variables."""

    _allowed: np.ndarray
    _name: str

    def _set_up(self, name: str, allowed: np.ndarray) -> None:
        self._name, self._allowed = name, allowed
        self._places = {v.get_id(): i for i, v in enumerate(allowed)}
        self._costs: list[tuple[BindingBase, Variable, frozenset]] = []
        self._constraints: list[tuple[BindingBase, frozenset]] = []

    def name(self) -> str:
        """Returns its name."""
        return self._name

    def _checked(self, call: str, binding: BindingBase, transcriptions: Iterable) -> frozenset:
        foreign = [str(v) for v in binding._variables if v.get_id() not in self._places]
        if foreign:
            raise RuntimeError(
                f"{call}(): {', '.join(foreign)} do not belong to {self._name}, whose variables are "
                f"{', '.join(map(str, self._allowed))}."
            )
        chosen = frozenset(transcriptions)
        if not chosen:
            raise RuntimeError(f"{call}(): no transcription is given to use it in.")
        return chosen

    def _parser(self) -> MathematicalProgram:
        prog = MathematicalProgram()
        prog.AddDecisionVariables(self._allowed)
        return prog

    @overloaded(*COSTS)
    def AddCost(self, what: Any, use_in_transcription: Iterable) -> BindingBase[Cost]:
        """Adds a cost and returns it; called as `(e)` or `(binding)`, and `use_in_transcription`.

        Raises:
            RuntimeError: it has other variables, or no transcription to be used in.
        """
        binding = what if isinstance(what, BindingBase) else self._parser().AddCost(what)
        chosen = self._checked("AddCost", binding, use_in_transcription)
        ell = Variable(f"{self._name}ell{len(self._costs)}")
        self._costs.append((binding, ell, chosen))
        return as_kind(Cost, binding)

    @overloaded(*constraints("f"))
    def AddConstraint(
        self, what: Formula | BindingBase[Constraint], use_in_transcription: Iterable
    ) -> BindingBase[Constraint]:
        """Adds a constraint and returns it; called as `(f)` or `(binding)`, and `use_in_transcription`.

        Raises:
            RuntimeError: it has other variables, there are none, or no transcription to be used in.
        """
        if not len(self._allowed):
            raise RuntimeError(f"AddConstraint(): {self._name} has no variables.")
        binding = what if isinstance(what, BindingBase) else self._parser().AddConstraint(what)
        chosen = self._checked("AddConstraint", binding, use_in_transcription)
        self._constraints.append((binding, chosen))
        return as_kind(Constraint, binding)

    def GetCosts(self, used_in_transcription: Iterable = ALL) -> list:
        """Returns the costs used in any of some transcriptions."""
        chosen = frozenset(used_in_transcription)
        return [as_kind(Cost, b) for b, _, use in self._costs if use & chosen]

    def GetConstraints(self, used_in_transcription: Iterable = ALL) -> list:
        """Returns the constraints used in any of some transcriptions."""
        chosen = frozenset(used_in_transcription)
        return [as_kind(Constraint, b) for b, use in self._constraints if use & chosen]

    def _costs_in(self, transcription: Transcription) -> list[tuple[BindingBase, Variable]]:
        return [(b, ell) for b, ell, use in self._costs if transcription in use]

    def _constraints_in(self, transcription: Transcription) -> list[BindingBase]:
        return [b for b, use in self._constraints if transcription in use]

    @checked
    def GetSolutionCost(self, result: MathematicalProgramResult, cost: Any = None) -> float | None:
        """Returns the sum of its costs in a solution, or one of them; zero where it takes no part.

        Raises:
            RuntimeError: the cost is none of its own.
        """
        if cost is not None and not any(cost == b for b, _, _ in self._costs):
            raise RuntimeError(f"GetSolutionCost(): the cost is not associated with {self._name}.")
        wanted = [ell for b, ell, _ in self._costs if cost is None or cost == b]
        return float(sum(result.GetSolution(ell) for ell in wanted if ell.get_id() in result._places))

    def _take(self, other: Element) -> None:
        """Takes over another one's costs and constraints, of its variables in order."""
        mine = dict(zip((v.get_id() for v in other._allowed), self._allowed))

        def renamed(b: BindingBase) -> BindingBase:
            return type(b)(b.evaluator(), np.array([mine[v.get_id()] for v in b._variables], dtype=object))

        for b, _, use in other._costs:
            self.AddCost(renamed(b), use_in_transcription=use)
        for b, use in other._constraints:
            self.AddConstraint(renamed(b), use_in_transcription=use)


class Vertex(Element):
    """A vertex: a convex set, a point in it, and costs and constraints on that point."""

    @classmethod
    def _make(cls, set: ConvexSet, name: str) -> Vertex:
        out = cls.__new__(cls)
        out._id, out._set = VertexId.get_new_id(), set.Clone()
        out._x = MakeVectorContinuousVariable(set.ambient_dimension(), name)
        out._set_up(name, out._x)
        out._in, out._out = [], []
        return out

    _id: VertexId
    _set: ConvexSet
    _x: np.ndarray
    _in: list[Edge]
    _out: list[Edge]

    def id(self) -> VertexId:
        """Returns its identifier."""
        return self._id

    def ambient_dimension(self) -> int:
        """Returns the dimension of its set's space."""
        return self._set.ambient_dimension()

    def x(self) -> np.ndarray:
        """Returns the variables of its point, for costs and constraints, shape (n,)."""
        return self._x.copy()

    def set(self) -> ConvexSet:
        """Returns its set."""
        return self._set

    def incoming_edges(self) -> list[Edge]:
        """Returns the edges that end here."""
        return list(self._in)

    def outgoing_edges(self) -> list[Edge]:
        """Returns the edges that start here."""
        return list(self._out)

    @checked
    def GetSolution(self, result: MathematicalProgramResult) -> np.ndarray | None:
        """Returns its point in a solution, shape (n,); None where it takes no part."""
        if any(v.get_id() not in result._places for v in self._x):
            return None
        x = result.GetSolution(self._x)
        return None if np.isnan(x).any() else x


class Edge(Element):
    """An edge: costs and constraints on the points of two vertices, and whether a path takes it."""

    @classmethod
    def _make(cls, u: Vertex, v: Vertex, name: str) -> Edge:
        out = cls.__new__(cls)
        out._id, out._u, out._v, out._fixed = EdgeId.get_new_id(), u, v, None
        out._phi = Variable(f"{name}phi", Variable.Type.BINARY)
        out._y = MakeVectorContinuousVariable(u.ambient_dimension(), f"{name}y")
        out._z = MakeVectorContinuousVariable(v.ambient_dimension(), f"{name}z")
        out._set_up(name, np.concatenate((u._x, v._x)))
        return out

    _id: EdgeId
    _u: Vertex
    _v: Vertex
    _phi: Variable
    _fixed: bool | None
    _y: np.ndarray
    _z: np.ndarray

    def id(self) -> EdgeId:
        """Returns its identifier."""
        return self._id

    def u(self) -> Vertex:
        """Returns the vertex where it starts."""
        return self._u

    def v(self) -> Vertex:
        """Returns the vertex where it ends."""
        return self._v

    def phi(self) -> Variable:
        """Returns the binary variable that says whether it is taken."""
        return self._phi

    def xu(self) -> np.ndarray:
        """Returns the variables of the point where it starts."""
        return self._u.x()

    def xv(self) -> np.ndarray:
        """Returns the variables of the point where it ends."""
        return self._v.x()

    @checked
    def AddPhiConstraint(self, phi_value: bool) -> None:
        """Says that it is taken, or that it is not."""
        self._fixed = bool(phi_value)

    def ClearPhiConstraints(self) -> None:
        """Leaves open whether it is taken."""
        self._fixed = None

    def _flow_times(self, result: MathematicalProgramResult, vars: np.ndarray) -> np.ndarray | None:
        if any(v.get_id() not in result._places for v in vars):
            return None
        return result.GetSolution(vars)

    @checked
    def GetSolutionPhiXu(self, result: MathematicalProgramResult) -> np.ndarray | None:
        """Returns phi times the point where it starts; None in a solution without these products."""
        return self._flow_times(result, self._y)

    @checked
    def GetSolutionPhiXv(self, result: MathematicalProgramResult) -> np.ndarray | None:
        """Returns phi times the point where it ends; None in a solution without these products."""
        return self._flow_times(result, self._z)
