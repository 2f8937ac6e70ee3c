"""Estimators of states: Luenberger observers, steady-state Kalman filters."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.estimators._luenberger import (
    DiscreteTimeSteadyStateKalmanFilter,
    LuenbergerObserver,
    SteadyStateKalmanFilter,
)
from sheldrake.systems.framework import LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate

__all__ = [
    "DiscreteTimeSteadyStateKalmanFilter",
    "LuenbergerObserver",
    "LuenbergerObserver_",
    "SteadyStateKalmanFilter",
]

LuenbergerObserver_ = SystemTemplate(
    "LuenbergerObserver_", LuenbergerObserver, scope=__name__, own=True, base=LeafSystem_
)

show_as_own(globals())
