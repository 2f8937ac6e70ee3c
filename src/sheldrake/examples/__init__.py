"""Small systems that textbooks are written about: pendulums, walkers, a quadrotor."""

from sheldrake.common._names import show_as_own

from ._acrobot import (
    AcrobotGeometry,
    AcrobotInput,
    AcrobotParams,
    AcrobotPlant,
    AcrobotSpongController,
    AcrobotState,
    AcrobotWEncoder,
    SpongControllerParams,
)
from ._compass_gait import CompassGait, CompassGaitContinuousState, CompassGaitGeometry, CompassGaitParams
from ._pendulum import PendulumGeometry, PendulumInput, PendulumParams, PendulumPlant, PendulumState
from ._quadrotor import QuadrotorGeometry, QuadrotorPlant, StabilizingLQRController
from ._rimless_wheel import RimlessWheel, RimlessWheelContinuousState, RimlessWheelGeometry, RimlessWheelParams
from ._van_der_pol import VanDerPolOscillator

__all__ = [
    "AcrobotGeometry",
    "AcrobotInput",
    "AcrobotParams",
    "AcrobotPlant",
    "AcrobotSpongController",
    "AcrobotState",
    "AcrobotWEncoder",
    "CompassGait",
    "CompassGaitContinuousState",
    "CompassGaitGeometry",
    "CompassGaitParams",
    "PendulumGeometry",
    "PendulumInput",
    "PendulumParams",
    "PendulumPlant",
    "PendulumState",
    "QuadrotorGeometry",
    "QuadrotorPlant",
    "RimlessWheel",
    "RimlessWheelContinuousState",
    "RimlessWheelGeometry",
    "RimlessWheelParams",
    "SpongControllerParams",
    "StabilizingLQRController",
    "VanDerPolOscillator",
]

show_as_own(globals())
