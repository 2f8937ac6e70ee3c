"""Drivers: what stands between commands and the actuators of a simulated robot."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.lcm import DrakeLcmInterface
from sheldrake.lcm._messages import (
    lcmt_iiwa_command,
    lcmt_iiwa_status,
    lcmt_schunk_wsg_command,
    lcmt_schunk_wsg_status,
)
from sheldrake.manipulation._config import IiwaDriver, SchunkWsgDriver, ZeroForceDriver
from sheldrake.manipulation._iiwa_messages import (
    IiwaCommandReceiver,
    IiwaStatusSender,
    ParseIiwaControlMode,
    kIiwaArmNumJoints,
    position_enabled,
    torque_enabled,
)
from sheldrake.manipulation._wsg import (
    MakeMultibodyForceToWsgForceSystem,
    MakeMultibodyStateToWsgStateSystem,
    SchunkWsgController,
    SchunkWsgStatusSender,
)
from sheldrake.multibody.parsing import GetScopedFrameByName, Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.systems.controllers import InverseDynamics, InverseDynamicsController
from sheldrake.systems.framework import Diagram, DiagramBuilder
from sheldrake.systems.lcm import LcmBuses, LcmPublisherSystem, LcmSubscriberSystem
from sheldrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    Demultiplexer,
    FirstOrderLowPassFilter,
    Gain,
    MatrixGain,
    PassThrough,
    Saturation,
    SharedPointerSystem,
    StateInterpolatorWithDiscreteDerivative,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.math._rigid_transform import RigidTransform
    from sheldrake.multibody.tree._frame import Frame
    from sheldrake.multibody.tree._index import ModelInstanceIndex

_IIWA_KP = np.array([2000.0, 1500.0, 1500.0, 1500.0, 1500.0, 500.0, 500.0])
_WSG_STATUS_PERIOD = 0.05
"""How often the gripper's status goes out [s]."""


@checked
class SimIiwaDriver(Diagram):
    """Simulates an iiwa's control cabinet: from commands and the arm's state to its actuation.

    Input ports: state; generalized_contact_forces; position [rad] and torque [N m], as the control mode has them.
    Output ports: actuation, position_commanded, position_measured, velocity_estimated, state_estimated,
    torque_commanded, torque_measured, torque_external; velocity_commanded where positions are commanded.

    Args:
        driver_config: Settings.
        controller_plant: The arm as the controller knows it, its hand included.
    """

    def __init__(self, driver_config: IiwaDriver, controller_plant: MultibodyPlant):
        super().__init__()
        mode, n = ParseIiwaControlMode(driver_config.control_mode), controller_plant.num_positions()
        builder = DiagramBuilder()
        parts = builder.AddNamedSystem("demultiplexer", Demultiplexer(output_ports_sizes=[n, n]))
        external = builder.AddNamedSystem(
            "low_pass_filter", FirstOrderLowPassFilter(driver_config.ext_joint_filter_tau, n)
        )
        state = builder.AddNamedSystem("state_pass_through", PassThrough(2 * n))
        builder.ExportInput(parts.get_input_port(), "state")
        builder.ConnectInput("state", state.get_input_port())
        builder.ExportInput(external.get_input_port(), "generalized_contact_forces")
        if position_enabled(mode):
            force, commanded = self._track(builder, driver_config, controller_plant, n)
        else:
            mode_of_gravity = InverseDynamics.kGravityCompensation
            gravity = InverseDynamics(controller_plant, mode_of_gravity)
            builder.AddNamedSystem("gravity_compensation", gravity)
            builder.ConnectInput("state", gravity.get_input_port_estimated_state())
            force, commanded = gravity.get_output_port_generalized_force(), parts.get_output_port(0)
        if torque_enabled(mode):
            total = builder.AddNamedSystem("+", Adder(2, n))
            builder.Connect(force, total.get_input_port(0))
            builder.ExportInput(total.get_input_port(1), "torque")
            force = total.get_output_port()
        limits = controller_plant.GetEffortLowerLimits(), controller_plant.GetEffortUpperLimits()
        limiter = builder.AddNamedSystem("torque_limiter", Saturation(*limits))
        builder.Connect(force, limiter.get_input_port())
        motors = builder.AddNamedSystem("B⁻¹", MatrixGain(np.linalg.inv(controller_plant.MakeActuationMatrix())))
        builder.Connect(limiter.get_output_port(), motors.get_input_port())
        for name, port in (
            ("actuation", motors.get_output_port()),
            ("position_commanded", commanded),
            ("position_measured", parts.get_output_port(0)),
            ("velocity_estimated", parts.get_output_port(1)),
            ("state_estimated", state.get_output_port()),
            ("torque_commanded", limiter.get_output_port()),
            ("torque_measured", limiter.get_output_port()),
            ("torque_external", external.get_output_port()),
        ):
            builder.ExportOutput(port, name)
        builder.BuildInto(self)

    @staticmethod
    def _track(builder: DiagramBuilder, config: IiwaDriver, plant: MultibodyPlant, n: int) -> tuple:
        """Adds what follows commanded positions; its force and the commanded positions."""
        kp = config.desired_kp_gains
        if kp is None:
            if n != kIiwaArmNumJoints:
                raise RuntimeError(
                    f"SimIiwaDriver(): the default desired_kp_gains are for {kIiwaArmNumJoints} joints; "
                    f"the arm has {n}."
                )
            kp = _IIWA_KP
        kp = np.asarray(kp, float)
        control = InverseDynamicsController(plant, kp, np.ones(len(kp)), 2 * np.sqrt(kp), False)
        builder.AddNamedSystem("inverse_dynamics_controller", control)
        rate = builder.AddNamedSystem(
            "velocity_interpolator", StateInterpolatorWithDiscreteDerivative(n, config.lcm_status_period)
        )
        commanded = builder.AddNamedSystem("position_pass_through", PassThrough(n))
        parts = builder.AddSystem(Demultiplexer(output_ports_sizes=[n, n]))
        builder.ConnectInput("state", control.get_input_port_estimated_state())
        builder.Connect(rate.get_output_port(), control.get_input_port_desired_state())
        builder.Connect(rate.get_output_port(), parts.get_input_port())
        builder.ExportInput(rate.get_input_port(), "position")
        builder.ConnectInput("position", commanded.get_input_port())
        builder.ExportOutput(parts.get_output_port(1), "velocity_commanded")
        return control.get_output_port_generalized_force(), commanded.get_output_port()

    @staticmethod
    def AddToBuilder(
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        iiwa_instance: ModelInstanceIndex,
        driver_config: IiwaDriver,
        controller_plant: MultibodyPlant,
    ) -> SimIiwaDriver:
        """Adds a driver and connects it to the plant; commands are left to the caller.

        Args:
            builder: Where the plant is.
            plant: The simulated plant.
            iiwa_instance: The arm in it.
            driver_config: Settings.
            controller_plant: The arm as the controller knows it.
        """
        name = plant.GetModelInstanceName(iiwa_instance)
        driver = builder.AddNamedSystem(name, SimIiwaDriver(driver_config, controller_plant))
        builder.Connect(plant.get_state_output_port(iiwa_instance), driver.GetInputPort("state"))
        forces = plant.get_generalized_contact_forces_output_port(iiwa_instance)
        builder.Connect(forces, driver.GetInputPort("generalized_contact_forces"))
        builder.Connect(driver.GetOutputPort("actuation"), plant.get_actuation_input_port(iiwa_instance))
        return driver


@checked
def BuildIiwaControl(
    builder: DiagramBuilder,
    lcm: DrakeLcmInterface,
    plant: MultibodyPlant,
    iiwa_instance: ModelInstanceIndex,
    driver_config: IiwaDriver,
    controller_plant: MultibodyPlant,
) -> None:
    """Adds an arm's driver, fed by messages of channel IIWA_COMMAND, its status going out on IIWA_STATUS.

    Args:
        builder: Where the plant is.
        lcm: The connection. One to nobody ("memq://null") leaves the messages out, and the commands to the caller.
        plant: The simulated plant.
        iiwa_instance: The arm in it.
        driver_config: Settings.
        controller_plant: The arm as the controller knows it.
    """
    driver = SimIiwaDriver.AddToBuilder(builder, plant, iiwa_instance, driver_config, controller_plant)
    if lcm.get_lcm_url() == LcmBuses.kLcmUrlMemqNull:
        return
    mode, period = ParseIiwaControlMode(driver_config.control_mode), driver_config.lcm_status_period
    n, name = controller_plant.num_positions(), plant.GetModelInstanceName(iiwa_instance)
    add = builder.AddNamedSystem
    subscriber = add(
        f"{name}_iiwa_command_subscriber", LcmSubscriberSystem.Make("IIWA_COMMAND", lcmt_iiwa_command, lcm)
    )
    receiver = add(f"{name}_iiwa_command_receiver", IiwaCommandReceiver(n, mode))
    parts = add(f"{name}_iiwa_state_demultiplexer", Demultiplexer(output_ports_sizes=[n, n]))
    publisher = add(
        f"{name}_iiwa_status_publisher", LcmPublisherSystem.Make("IIWA_STATUS", lcmt_iiwa_status, lcm, period)
    )
    sender = add(f"{name}_iiwa_status_sender", IiwaStatusSender(n))
    connect = builder.Connect
    connect(subscriber.get_output_port(), receiver.get_message_input_port())
    connect(plant.get_state_output_port(iiwa_instance), parts.get_input_port())
    connect(parts.get_output_port(0), receiver.get_position_measured_input_port())
    for command in ("position",) * position_enabled(mode) + ("torque",) * torque_enabled(mode):
        connect(receiver.GetOutputPort(command), driver.GetInputPort(command))
    for value in ("position_commanded", "position_measured", "velocity_estimated", "torque_external"):
        connect(driver.GetOutputPort(value), sender.GetInputPort(value))
    for value in ("torque_commanded", "torque_measured"):  # the cabinet reports what the arm exerts on the motors
        flip = add(f"sign_flip_{name}_{value}", Gain(-1.0, n))
        connect(driver.GetOutputPort(value), flip.get_input_port())
        connect(flip.get_output_port(), sender.GetInputPort(value))
    connect(sender.get_output_port(), publisher.get_input_port())


@checked
def BuildSchunkWsgControl(
    plant: MultibodyPlant,
    wsg_instance: ModelInstanceIndex,
    lcm: DrakeLcmInterface,
    builder: DiagramBuilder,
    pid_gains: ArrayLike | None = None,
) -> None:
    """Adds a gripper's controller, fed by messages of channel SCHUNK_WSG_COMMAND, its status on SCHUNK_WSG_STATUS.

    Args:
        plant: The simulated plant, finalized.
        wsg_instance: The gripper in it.
        lcm: The connection. Over one to nobody ("memq://null") no command comes: the gripper stays at its first one.
        builder: Where the plant is.
        pid_gains: Proportional, integral and derivative gain, shape (3,); None: those of SchunkWsgDriver.
    """
    name, add, connect = plant.GetModelInstanceName(wsg_instance), builder.AddNamedSystem, builder.Connect
    subscriber = add(
        f"{name}_wsg_command_subscriber", LcmSubscriberSystem.Make("SCHUNK_WSG_COMMAND", lcmt_schunk_wsg_command, lcm)
    )
    gains = np.asarray(SchunkWsgDriver().pid_gains if pid_gains is None else pid_gains, dtype=float)
    controller = builder.AddSystem(SchunkWsgController(*gains))
    status = LcmPublisherSystem.Make("SCHUNK_WSG_STATUS", lcmt_schunk_wsg_status, lcm, _WSG_STATUS_PERIOD)
    publisher = add(f"{name}_wsg_status_publisher", status)
    sender = builder.AddSystem(SchunkWsgStatusSender())
    state = builder.AddSystem(MakeMultibodyStateToWsgStateSystem())
    force = builder.AddSystem(MakeMultibodyForceToWsgForceSystem())
    connect(subscriber.get_output_port(), controller.GetInputPort("command_message"))
    connect(plant.get_state_output_port(wsg_instance), controller.GetInputPort("state"))
    connect(controller.GetOutputPort("force"), plant.get_actuation_input_port(wsg_instance))
    connect(plant.get_state_output_port(wsg_instance), state.get_input_port())
    connect(plant.get_generalized_contact_forces_output_port(wsg_instance), force.get_input_port())
    connect(state.get_output_port(), sender.get_state_input_port())
    connect(force.get_output_port(), sender.get_force_input_port())
    connect(sender.get_output_port(), publisher.get_input_port())


def _controller_plant(sim_plant: MultibodyPlant, arm: Any, hand: Any, config: IiwaDriver) -> MultibodyPlant:
    """The arm alone, welded as in the simulated plant, with its hand as one rigid body."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    instances = parser.AddModels(arm.model_path)
    child = plant.GetFrameByName(config.arm_child_frame_name or arm.child_frame_name, instances[0])
    plant.WeldFrames(plant.world_frame(), child, _weld(sim_plant, arm, config))
    if hand is not None:
        _add_hand(plant, arm, sim_plant, hand, config)
    plant.mutable_gravity_field().set_gravity_vector(sim_plant.gravity_field().gravity_vector())
    plant.Finalize()
    return plant


def _weld(sim_plant: MultibodyPlant, arm: Any, config: IiwaDriver) -> RigidTransform:
    """Pose of the arm's welded frame in the world."""
    frame = sim_plant.GetFrameByName(config.arm_child_frame_name or arm.child_frame_name, arm.model_instance)
    return frame.CalcPoseInWorld(sim_plant.CreateDefaultContext())


def _add_hand(
    plant: MultibodyPlant, arm: ModelInstanceIndex, sim_plant: MultibodyPlant, hand: Any, config: IiwaDriver
) -> None:
    """Adds a rigid body with the hand's mass to the arm's body that carries the hand."""
    context = sim_plant.CreateDefaultContext()
    wrist = _wrist(sim_plant, arm, config.gripper_parent_frame_name or hand.parent_frame_name)
    inertia = sim_plant.CalcSpatialInertia(context, wrist, sim_plant.GetBodyIndices(hand.model_instance))
    carrier = plant.GetBodyByName(wrist.body().name())
    body = plant.AddRigidBody(f"{hand.model_name}_equivalent", carrier.model_instance(), inertia)
    plant.WeldFrames(carrier.body_frame(), body.body_frame(), wrist.GetFixedPoseInBodyFrame())


def _wrist(sim_plant: MultibodyPlant, arm: Any, name: str) -> Frame:
    """The frame that carries the hand: of the arm, or another that is fixed to it."""
    unscoped = name.split("::")[-1]
    if sim_plant.HasFrameNamed(unscoped, arm.model_instance):
        return sim_plant.GetFrameByName(unscoped, arm.model_instance)
    return GetScopedFrameByName(sim_plant, name)


@checked
def ApplyDriverConfig(
    driver_config: Any,
    model_instance_name: str,
    sim_plant: MultibodyPlant,
    models_from_directives: dict[str, Any],
    lcms: LcmBuses,
    builder: DiagramBuilder,
) -> None:
    """Adds the driver of one model.

    Args:
        driver_config: IiwaDriver, SchunkWsgDriver or ZeroForceDriver.
        model_instance_name: The model in the plant.
        sim_plant: The simulated plant, finalized.
        models_from_directives: What `ProcessModelDirectives` gave, by name of the model.
        lcms: The connections.
        builder: Where the plant is.
    """
    instance = sim_plant.GetModelInstanceByName(model_instance_name)
    if isinstance(driver_config, IiwaDriver):
        arm = _model(models_from_directives, model_instance_name)
        hand_name = driver_config.hand_model_name
        hand = _model(models_from_directives, hand_name) if hand_name else None
        controller_plant = _controller_plant(sim_plant, arm, hand, driver_config)
        holder = SharedPointerSystem(controller_plant)
        builder.AddNamedSystem(f"{model_instance_name}_controller_plant", holder)
        lcm = lcms.Find(f"Driver for {model_instance_name}", driver_config.lcm_bus)
        BuildIiwaControl(builder, lcm, sim_plant, instance, driver_config, controller_plant)
    elif isinstance(driver_config, ZeroForceDriver):
        n = sim_plant.num_actuators(instance)
        zero = ConstantVectorSource(np.zeros(n))
        builder.AddNamedSystem(f"zero_force_source_for_{model_instance_name}", zero)
        builder.Connect(zero.get_output_port(), sim_plant.get_actuation_input_port(instance))
    elif isinstance(driver_config, SchunkWsgDriver):
        lcm = lcms.Find(f"Driver for {model_instance_name}", driver_config.lcm_bus)
        BuildSchunkWsgControl(sim_plant, instance, lcm, builder, driver_config.pid_gains)
    else:
        raise Mismatch(
            f"ApplyDriverConfig(): incompatible function arguments: {driver_config!r} is none of IiwaDriver, "
            "SchunkWsgDriver, ZeroForceDriver."
        )


def _model(models: dict[str, Any], name: str) -> Any:
    if name not in models:
        raise RuntimeError(
            f"ApplyDriverConfig(): the directives added no model '{name}' (there are: {', '.join(models) or 'none'})"
        )
    return models[name]


def ApplyDriverConfigs(
    *,
    driver_configs: dict[str, Any],
    sim_plant: MultibodyPlant,
    models_from_directives: list,
    lcm_buses: LcmBuses,
    builder: DiagramBuilder,
) -> None:
    """Adds the drivers of several models.

    Args:
        driver_configs: Settings by name of the model. A class of your own brings a function `ApplyDriverConfig` in
            its module.
        sim_plant: The simulated plant, finalized.
        models_from_directives: What `ProcessModelDirectives` gave.
        lcm_buses: The connections.
        builder: Where the plant is.
    """
    models = {info.model_name: info for info in models_from_directives}
    for name, config in driver_configs.items():
        module = sys.modules[type(config).__module__]
        apply = getattr(module, "ApplyDriverConfig", ApplyDriverConfig)
        apply(config, name, sim_plant, models, lcm_buses, builder)


@checked
def ApplyNamedPositionsAsDefaults(input: dict[str, dict[str, Any]], plant: MultibodyPlant) -> None:
    """Sets default positions of joints.

    Args:
        input: Positions by name of the joint, by name of the model instance.
        plant: The plant, finalized.
    """
    for model_name, joints in input.items():
        instance = plant.GetModelInstanceByName(model_name)
        for joint_name, positions in joints.items():
            joint = plant.GetJointByName(joint_name, instance)
            values = np.asarray(positions, float).reshape(-1)
            if len(values) != joint.num_positions():
                raise RuntimeError(
                    f"ApplyNamedPositionsAsDefaults(): joint '{model_name}::{joint_name}' has {joint.num_positions()} "
                    f"positions, got {len(values)}."
                )
            joint.set_default_positions(values)
