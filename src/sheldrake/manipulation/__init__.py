"""Drivers, grippers and messages of robot arms."""

from sheldrake.common._names import show_as_own
from sheldrake.manipulation._config import IiwaDriver, SchunkWsgDriver, ZeroForceDriver
from sheldrake.manipulation._drivers import (
    ApplyDriverConfig,
    ApplyDriverConfigs,
    ApplyNamedPositionsAsDefaults,
    BuildIiwaControl,
    BuildSchunkWsgControl,
    SimIiwaDriver,
)
from sheldrake.manipulation._iiwa_messages import (
    IiwaCommandReceiver,
    IiwaCommandSender,
    IiwaControlMode,
    IiwaStatusReceiver,
    IiwaStatusSender,
    ParseIiwaControlMode,
    get_iiwa_max_joint_velocities,
    kIiwaArmNumJoints,
    kIiwaLcmStatusPeriod,
    position_enabled,
    torque_enabled,
)
from sheldrake.manipulation._panda_messages import (
    PandaCommandReceiver,
    PandaCommandSender,
    PandaControlMode,
    PandaStatusReceiver,
    PandaStatusSender,
    kPandaArmNumJoints,
)
from sheldrake.manipulation._wsg import (
    GetSchunkWsgOpenPosition,
    MakeMultibodyForceToWsgForceSystem,
    MakeMultibodyStateToWsgStateSystem,
    SchunkWsgCommandReceiver,
    SchunkWsgCommandSender,
    SchunkWsgController,
    SchunkWsgPositionController,
    SchunkWsgStatusReceiver,
    SchunkWsgStatusSender,
    SchunkWsgTrajectoryGenerator,
)

__all__ = [
    "ApplyDriverConfig",
    "ApplyDriverConfigs",
    "ApplyNamedPositionsAsDefaults",
    "BuildIiwaControl",
    "BuildSchunkWsgControl",
    "GetSchunkWsgOpenPosition",
    "IiwaCommandReceiver",
    "IiwaCommandSender",
    "IiwaControlMode",
    "IiwaDriver",
    "IiwaStatusReceiver",
    "IiwaStatusSender",
    "MakeMultibodyForceToWsgForceSystem",
    "MakeMultibodyStateToWsgStateSystem",
    "PandaCommandReceiver",
    "PandaCommandSender",
    "PandaControlMode",
    "PandaStatusReceiver",
    "PandaStatusSender",
    "ParseIiwaControlMode",
    "SchunkWsgCommandReceiver",
    "SchunkWsgCommandSender",
    "SchunkWsgController",
    "SchunkWsgDriver",
    "SchunkWsgPositionController",
    "SchunkWsgStatusReceiver",
    "SchunkWsgStatusSender",
    "SchunkWsgTrajectoryGenerator",
    "SimIiwaDriver",
    "ZeroForceDriver",
    "get_iiwa_max_joint_velocities",
    "kIiwaArmNumJoints",
    "kIiwaLcmStatusPeriod",
    "kPandaArmNumJoints",
    "position_enabled",
    "torque_enabled",
]

show_as_own(globals())
