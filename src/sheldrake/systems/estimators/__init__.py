"""Estimators of states: Luenberger observers, steady-state Kalman filters."""

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

for _name in __all__:
    if hasattr(globals()[_name], "__module__"):
        globals()[_name].__module__ = __name__
