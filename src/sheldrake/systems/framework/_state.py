"""The state of a system, and its parameters: groups of values of all kinds."""

from __future__ import annotations

from typing import Any, overload

from sheldrake.common._checked import checked
from sheldrake.common._copies import Cloned
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework._values import AbstractValues, ContinuousState, DiscreteValues
from sheldrake.systems.framework._vector import BasicVector


class State:
    """Everything that changes in time: continuous, discrete and abstract."""

    _pending: dict[int, list[AbstractValue]]

    def __init__(self) -> None:
        self._continuous, self._discrete, self._abstract = ContinuousState(), DiscreteValues(), AbstractValues()

    @classmethod
    def _view(cls, continuous: ContinuousState, discrete: DiscreteValues, abstract: AbstractValues) -> State:
        state = object.__new__(cls)
        state._continuous, state._discrete, state._abstract = continuous, discrete, abstract
        return state

    def get_continuous_state(self) -> ContinuousState:
        """The continuous state."""
        return self._continuous

    def get_mutable_continuous_state(self) -> ContinuousState:
        """The continuous state, to be changed."""
        self._continuous._vector._wrote()
        return self._continuous

    @overload
    def get_discrete_state(self, index: None = None) -> DiscreteValues: ...
    @overload
    def get_discrete_state(self, index: int) -> BasicVector: ...
    def get_discrete_state(self, index: int | None = None) -> DiscreteValues | BasicVector:
        """The discrete state, or its group `index`."""
        return self._discrete if index is None else self._discrete.get_vector(index)

    @overload
    def get_mutable_discrete_state(self, index: None = None) -> DiscreteValues: ...
    @overload
    def get_mutable_discrete_state(self, index: int) -> BasicVector: ...
    def get_mutable_discrete_state(self, index: int | None = None) -> DiscreteValues | BasicVector:
        """The discrete state, or its group `index`, to be changed."""
        if index is None:
            for group in self._discrete._groups:
                group._wrote()
            return self._discrete
        return self._discrete.get_mutable_vector(index)

    @overload
    def get_abstract_state(self, index: None = None) -> AbstractValues: ...
    @overload
    def get_abstract_state(self, index: int) -> AbstractValue: ...
    def get_abstract_state(self, index: int | None = None) -> AbstractValues | AbstractValue:
        """The abstract states, or number `index`."""
        return self._abstract if index is None else self._abstract.get_value(index)

    @overload
    def get_mutable_abstract_state(self, index: None = None) -> AbstractValues: ...
    @overload
    def get_mutable_abstract_state(self, index: int) -> AbstractValue: ...
    def get_mutable_abstract_state(self, index: int | None = None) -> AbstractValues | AbstractValue:
        """The abstract states, or number `index`, to be changed."""
        if index is None:
            if self._abstract._on_write is not None:
                self._abstract._on_write()
            return self._abstract
        return self._abstract.get_mutable_value(index)

    def SetFrom(self, other: State, /) -> None:
        """Copies another state of the same structure."""
        self._continuous.SetFrom(other._continuous)
        self._discrete.SetFrom(other._discrete)
        self._abstract.SetFrom(other._abstract)

    def Clone(self) -> State:
        """A copy with its own memory."""
        return State._view(self._continuous.Clone(), self._discrete.Clone(), self._abstract.Clone())


@checked
class Parameters(Cloned):
    """What is constant during a simulation: groups of numbers, and abstract values.

    Args:
        numeric: BasicVectors.
        abstract: Abstract values.
    """

    def __init__(
        self,
        numeric: Any = None,
        abstract: Any = None,
        *,
        vec: BasicVector | None = None,
        value: AbstractValue | None = None,
    ):
        if isinstance(numeric, BasicVector) or vec is not None:
            numeric = [numeric if vec is None else vec]
        elif isinstance(numeric, AbstractValue) or value is not None:
            numeric, abstract = None, [numeric if value is None else value]
        elif numeric and isinstance(numeric[0], AbstractValue):
            numeric, abstract = None, numeric
        self._numeric, self._abstract = DiscreteValues(numeric or []), AbstractValues(abstract or [])

    @classmethod
    def _view(cls, numeric: DiscreteValues, abstract: AbstractValues) -> Parameters:
        parameters = object.__new__(cls)
        parameters._numeric, parameters._abstract = numeric, abstract
        return parameters

    def num_numeric_parameter_groups(self) -> int:
        """How many groups of numbers there are."""
        return self._numeric.num_groups()

    def num_abstract_parameters(self) -> int:
        """How many abstract values there are."""
        return self._abstract.size()

    def get_numeric_parameter(self, index: int) -> BasicVector:
        """Group `index`."""
        return self._numeric.get_vector(index)

    def get_mutable_numeric_parameter(self, index: int) -> BasicVector:
        """Group `index`, to be changed."""
        return self._numeric.get_mutable_vector(index)

    def get_numeric_parameters(self) -> DiscreteValues:
        """All groups."""
        return self._numeric

    def set_numeric_parameters(self, numeric_params: DiscreteValues) -> None:
        """Sets all groups."""
        self._numeric.SetFrom(numeric_params)

    def get_abstract_parameter(self, index: int) -> AbstractValue:
        """Abstract value `index`."""
        return self._abstract.get_value(index)

    def get_mutable_abstract_parameter(self, index: int) -> AbstractValue:
        """Abstract value `index`, to be changed."""
        return self._abstract.get_mutable_value(index)

    def get_abstract_parameters(self) -> AbstractValues:
        """All abstract values."""
        return self._abstract

    def set_abstract_parameters(self, abstract_params: AbstractValues) -> None:
        """Sets all abstract values."""
        self._abstract.SetFrom(abstract_params)

    def SetFrom(self, other: Parameters, /) -> None:
        """Copies other parameters of the same structure."""
        self._numeric.SetFrom(other._numeric)
        self._abstract.SetFrom(other._abstract)

    def Clone(self) -> Parameters:
        """A copy with its own memory."""
        return Parameters._view(self._numeric.Clone(), self._abstract.Clone())
