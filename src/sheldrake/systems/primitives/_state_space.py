"""What linear and affine systems have in common: one state, continuous or sampled, where it begins, how it moves."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._distributions import gaussian_pairs
from sheldrake.common._overloads import Mismatch
from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._declarations import on_doubles
from sheldrake.systems.framework._vector import as_vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common import RandomGenerator
    from sheldrake.common.kernel import Kernel
    from sheldrake.systems.framework import Context


@checked
class StateSpace(LeafSystem):
    """A system of at most one state, which is continuous or sampled."""

    _period: float
    _covariance: np.ndarray | None = None

    def time_period(self) -> float:
        """Period of the discrete update [s]; 0: continuous."""
        return self._period

    def configure_default_state(self, x0: ArrayLike) -> None:
        """Sets the default state, in numbers of the scalar of the system, or floats.

        Raises:
            RuntimeError: there are more or fewer numbers than states.
            TypeError: they are no numbers, or duals for a system of floats.
        """
        call = f"{type(self).__name__}.configure_default_state()"
        numbers = as_vector(x0)
        if numbers.dtype == object and self._scalar is float:
            raise Mismatch(f"{call}: incompatible function arguments: expected floats, got {type(numbers[0]).__name__}")
        sampled = bool(self._xd_models)
        size = self._xd_models[0].size() if sampled else self._xc_model.size()
        if len(numbers) != size:
            raise RuntimeError(f"{call}: the state has size {size}, got {len(numbers)}.")
        if not size:
            return
        if sampled:
            self._xd_models[0] = BasicVector(numbers)
        else:
            self._xc_model = BasicVector(numbers)
        self._defaults_changed()

    def configure_random_state(self, covariance: ArrayLike) -> None:
        """Lets `SetRandomContext` add normal noise of this covariance, shape (n, n), to the default state."""
        self._covariance = np.array(covariance, float)

    def _set_random_context(self, context: Context, generator: RandomGenerator) -> None:
        """Adds the symmetric root of the covariance times normal numbers to the state: Drake's numbers."""
        if self._covariance is None or context.is_stateless():
            return
        continuous = context.num_continuous_states() > 0
        x = context.get_continuous_state_vector() if continuous else context.get_discrete_state_vector()
        values, vectors = np.linalg.eigh(self._covariance)
        normal = np.array([*islice(gaussian_pairs(generator), len(values))])
        x.SetFromVector(x.CopyToVector() + vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T @ normal)


def declare_motion(system: Any, cls: type[Any], n: int, kernel: Kernel | None) -> None:
    """Declares n states of a system with a `_period`, and how they move.

    Args:
        system: The system.
        cls: Its class, with `_update` and `DoCalcTimeDerivatives`.
        n: How many states there are.
        kernel: The same on doubles, or None.
    """
    if n and system._period > 0:
        system.DeclareDiscreteState(n)
        update = system._update if kernel is None else on_doubles(kernel, cls._update)
        system.DeclarePeriodicDiscreteUpdateEvent(system._period, 0.0, update)
    elif n:
        system.DeclareContinuousState(n)
        if kernel is not None:
            system.DeclareTimeDerivatives(on_doubles(kernel, cls.DoCalcTimeDerivatives))
