"""Evaluators together with the variables they are called with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._names import _MangledName
from sheldrake.common._overloads import dispatch, overload
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions import cone_constraints as cones
from sheldrake.solvers._functions import constraints, costs, evaluators, minimum_value
from sheldrake.solvers._functions import norm_costs as norms
from sheldrake.symbolic._traverse import object_array

if TYPE_CHECKING:
    from sheldrake.symbolic import Variable

Evaluator = TypeVar("Evaluator", bound=evaluators.EvaluatorBase)
Evaluator_co = TypeVar("Evaluator_co", bound=evaluators.EvaluatorBase, covariant=True)


class BindingBase(Generic[Evaluator_co]):
    """An evaluator and its variables; equal to each other binding of the same ones.

    Args:
        c: The evaluator.
        v: Its variables.
    """

    _kind: type[evaluators.EvaluatorBase] = evaluators.EvaluatorBase
    _evaluator: Evaluator_co
    _variables: np.ndarray
    _list: list[Variable]  # the same

    def __init__(self, *args: Any, **kwargs: Any):
        ways = [overload(BindingBase._set, c=instance_of(self._kind), v=_arrays.variable_vector)]
        if self._takes_other:
            ways.append(overload(BindingBase._set_like, other=instance_of(BindingBase)))
        dispatch(type(self).__name__, ways, self, args, kwargs, constructor=True)

    _takes_other = False

    def _set_like(self, other: BindingBase) -> None:
        if not isinstance(other.evaluator(), self._kind):
            raise RuntimeError(f"Unable to cast {other.evaluator()!r} to {self._kind.__name__}.")
        self._evaluator, self._variables = other._evaluator, other._variables

    def _set(self, evaluator: Any, vars: np.ndarray) -> None:
        size = evaluator._num_vars
        if size != len(vars) and size != evaluators.ANY:
            raise RuntimeError(
                f"Binding(): {type(evaluator).__name__} has {size} variables, but {len(vars)} are given."
            )
        self._evaluator, self._variables, self._list = evaluator, vars, vars.tolist()

    def __getattr__(self, name: str) -> Any:
        """The array of the variables from their list, or their list from the array: whichever was not given."""
        given = self.__dict__
        if name == "_variables" and "_list" in given:
            self._variables = found = object_array(self._list)
        elif name == "_list" and "_variables" in given:
            self._list = found = self._variables.tolist()
        else:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return found

    def evaluator(self) -> Evaluator_co:
        """Returns the evaluator."""
        return self._evaluator

    def variables(self) -> np.ndarray:
        """Returns the variables, shape `(n,)`."""
        return self._variables.copy()

    @checked
    def ToLatex(self, precision: int = 3) -> str:
        """Returns LaTeX for the evaluator with its variables."""
        return self._evaluator.ToLatex(self._variables, precision)

    def _identity(self) -> tuple[int, ...]:
        return (id(self._evaluator), *[v._id for v in self._list])

    def __eq__(self, other: object) -> bool:
        return self._identity() == other._identity() if isinstance(other, BindingBase) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._identity())

    def __str__(self) -> str:
        return self._evaluator._display(self._variables)


_KINDS: list[type[evaluators.EvaluatorBase]] = [
    evaluators.EvaluatorBase,
    evaluators.Cost,
    evaluators.Constraint,
    evaluators.VisualizationCallback,
    costs.LinearCost,
    costs.QuadraticCost,
    norms.L1NormCost,
    norms.L2NormCost,
    norms.LInfNormCost,
    norms.PerspectiveQuadraticCost,
    costs.ExpressionCost,
    constraints.LinearConstraint,
    constraints.LinearEqualityConstraint,
    constraints.BoundingBoxConstraint,
    constraints.QuadraticConstraint,
    constraints.LinearComplementarityConstraint,
    constraints.ExpressionConstraint,
    cones.LorentzConeConstraint,
    cones.RotatedLorentzConeConstraint,
    cones.ExponentialConeConstraint,
    cones.PositiveSemidefiniteConstraint,
    cones.LinearMatrixInequalityConstraint,
    minimum_value.MinimumValueLowerBoundConstraint,
    minimum_value.MinimumValueUpperBoundConstraint,
]
_GENERAL = _KINDS[:3]

_template = TemplateClass("Binding")
_template.__doc__ = "An evaluator and its variables: `Binding[LinearCost](cost, vars)`."
if TYPE_CHECKING:
    Binding = BindingBase
else:
    Binding = _template
_classes: dict[type[evaluators.EvaluatorBase], type[BindingBase]] = {}
for _kind in _KINDS:
    _name = _MangledName.mangle(f"Binding[{_kind.__name__}]")
    _attributes = {"_kind": _kind, "_takes_other": _kind in _GENERAL, "__doc__": BindingBase.__doc__}
    _cls = type(_name, (BindingBase,), {**_attributes, "__module__": "sheldrake.solvers"})
    _classes[_kind] = _cls
    _template.add_instantiation((_kind,), _cls, skip_rename=True)


def bind(kind: type[Evaluator], evaluator: Evaluator, vars: np.ndarray) -> BindingBase[Evaluator]:
    """Binding[kind] of an evaluator and a vector of variables."""
    out: BindingBase[Evaluator] = object.__new__(_classes[kind])
    out._set(evaluator, vars)
    return out


def bind_list(kind: type[Evaluator], evaluator: Evaluator, vars: list[Variable]) -> BindingBase[Evaluator]:
    """The same of a list of variables that nobody changes, as many as the evaluator takes."""
    out: BindingBase[Evaluator] = object.__new__(_classes[kind])
    out._evaluator, out._list = evaluator, vars
    return out


def as_kind(kind: type[Evaluator], binding: BindingBase) -> BindingBase[Evaluator]:
    """The same evaluator and variables as Binding[kind]."""
    if type(binding) is _classes[kind]:
        return binding
    return bind_list(kind, binding._evaluator, binding._list)  # asking for its __dict__ would make one
