"""A mass on a spring and a damper: its motion in closed form."""

from __future__ import annotations

import math


class MassDamperSpringAnalyticalSolution:
    """Solves m x'' + b x' + k x = 0 for any damping: it swings, creeps, or is critically damped.

    Args:
        mass: m [kg].
        b: Damping [N s/m].
        k: Stiffness [N/m].

    Raises:
        RuntimeError: the mass is not positive.
    """

    def __init__(self, mass: float, b: float, k: float):
        if not mass > 0.0:
            raise RuntimeError(f"MassDamperSpringAnalyticalSolution(): the mass must be positive, not {mass}.")
        self._mass, self._b, self._k = float(mass), float(b), float(k)
        self._x0 = self._v0 = 0.0

    def SetInitialValue(self, x0: float, xDt0: float) -> None:
        """Sets position [m] and velocity [m/s] at time 0."""
        self._x0, self._v0 = float(x0), float(xDt0)

    def _even_and_odd(self, t: float) -> tuple[float, float]:
        """Solutions e^(-b t/2m) c(t) and e^(-b t/2m) s(t) with c(0) = s'(0) = 1, c'(0) = s(0) = 0."""
        decay = -0.5 * self._b / self._mass
        square = decay * decay - self._k / self._mass
        if square < 0.0:
            rate = math.sqrt(-square)
            return math.exp(decay * t) * math.cos(rate * t), math.exp(decay * t) * math.sin(rate * t) / rate
        if square == 0.0:
            return math.exp(decay * t), math.exp(decay * t) * t
        rate = math.sqrt(square)  # as sums of exponentials, which do not overflow before they cancel
        slow, fast = math.exp((decay + rate) * t), math.exp((decay - rate) * t)
        return 0.5 * (slow + fast), 0.5 * (slow - fast) / rate

    def get_x(self, t: float) -> float:
        """Position at time t [m]."""
        even, odd = self._even_and_odd(t)
        return self._x0 * even + (self._v0 + 0.5 * self._b / self._mass * self._x0) * odd

    def get_xDt(self, t: float) -> float:
        """Velocity at time t [m/s]."""
        even, odd = self._even_and_odd(t)
        return self._v0 * even - (0.5 * self._b * self._v0 + self._k * self._x0) / self._mass * odd

    def get_xDtDt(self, t: float) -> float:
        """Acceleration at time t [m/s²]."""
        return -(self._b * self.get_xDt(t) + self._k * self.get_x(t)) / self._mass
