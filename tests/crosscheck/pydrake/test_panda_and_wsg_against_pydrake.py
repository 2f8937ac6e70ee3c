"""A Panda's messages and a gripper's trajectories are Drake's."""

import importlib

import numpy as np
import pytest

from sheldrake.lcm import _messages

pytest.importorskip("pydrake")
drake_messages = pytest.importorskip("drake")
pytestmark = pytest.mark.peer
STATUS = (
    "position_commanded", "position_measured", "velocity_commanded", "velocity_measured", "acceleration_commanded",
    "torque_commanded", "torque_measured", "torque_external",
)  # fmt: skip


def library(name):
    return importlib.import_module(f"{name}.all")


def kind(name, message):
    """A message's class, and what makes systems of Drake understand it."""
    if name == "pydrake":
        return getattr(drake_messages, message), {"use_cpp_serializer": True}
    return getattr(_messages, message), {}


def fields(message):
    names = [f[0] for f in getattr(_messages, type(message).__name__)._fields]
    return {n: list(v) if isinstance(v := getattr(message, n), (list, tuple)) else v for n in names}


def sent(name, make, message, inputs):
    """What a system that makes messages makes of these inputs; an error's kind."""
    lib, (cls, extra) = library(name), kind(name, message)
    lcm, builder = lib.DrakeLcm("memq://"), lib.DiagramBuilder()
    system = builder.AddSystem(make(lib))
    forced = {lib.TriggerType.kForced}
    publisher = builder.AddSystem(lib.LcmPublisherSystem.Make("X", cls, lcm, publish_triggers=forced, **extra))
    builder.Connect(system.get_output_port(), publisher.get_input_port())
    received = []
    lcm.Subscribe("X", received.append)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    context.SetTime(0.5)
    for port, value in inputs.items():
        system.GetInputPort(port).FixValue(system.GetMyMutableContextFromRoot(context), value)
    try:
        diagram.ForcedPublish(context)
    except RuntimeError as error:
        return type(error)
    lcm.HandleSubscriptions(0)
    return fields(cls.decode(received[-1]))


def listened(name, make, message, inputs=None):
    """Outputs at first, after a step, when inputs moved, and after a message; the discrete state."""
    lib, (cls, extra) = library(name), kind(name, type(message).__name__)
    lcm, builder = lib.DrakeLcm("memq://"), lib.DiagramBuilder()
    system = builder.AddSystem(make(lib))
    subscriber = builder.AddSystem(lib.LcmSubscriberSystem.Make("Y", cls, lcm, **extra))
    builder.Connect(subscriber.get_output_port(), system.get_input_port(0))
    simulator = lib.Simulator(builder.Build())
    context = system.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for port, value in (inputs or {}).items():
        system.GetInputPort(port).FixValue(context, value)
    found = []

    def look():
        for j in range(system.num_output_ports()):
            try:
                found.append(system.get_output_port(j).Eval(context).tolist())
            except RuntimeError as error:
                found.append(type(error).__name__)
        found.extend(context.get_discrete_state(g).value().tolist() for g in range(context.num_discrete_state_groups()))

    look()
    simulator.AdvanceTo(0.01)
    look()
    for port, value in (inputs or {}).items():
        system.GetInputPort(port).FixValue(context, np.asarray(value) + 10.0)
    simulator.AdvanceTo(0.02)
    look()
    lcm.Publish("Y", message.encode())
    lcm.HandleSubscriptions(0)
    simulator.AdvanceTo(0.03)
    look()
    return found


def both(call, *arguments):
    ours, theirs = (call(name, *arguments) for name in ("sheldrake", "pydrake"))
    assert ours == theirs
    return ours


@pytest.mark.parametrize("mode", range(1, 8))
def test_commands_sent(mode):
    inputs = {n: np.arange(2.0) + i for i, n in enumerate(("position", "velocity", "torque")) if mode >> i & 1}
    both(sent, lambda lib: lib.PandaCommandSender(2, mode), "lcmt_panda_command", inputs)


@pytest.mark.parametrize("given", [STATUS, ("position_measured", "torque_commanded"), ("position_measured",)])
def test_status_sent(given):
    inputs = {n: np.arange(2.0) + STATUS.index(n) for n in given}
    both(sent, lambda lib: lib.PandaStatusSender(2), "lcmt_panda_status", inputs)


def command(mode, size=2, utime=5):
    message = _messages.lcmt_panda_command(utime=utime, control_mode_expected=mode)
    for i, name in enumerate(("position", "velocity", "torque")):
        values = (np.arange(size) + 1.0 + i).tolist() if mode >> i & 1 else []
        setattr(message, f"num_joint_{name}", len(values))
        setattr(message, f"joint_{name}", values)
    return message


@pytest.mark.parametrize("message", [command(1), command(2), command(4), command(7), command(1, 3), command(1, 2, 0)])
def test_commands_received(message):
    mode = message.control_mode_expected
    both(listened, lambda lib: lib.PandaCommandReceiver(2, mode), message, {"position_measured": [0.1, 0.2]})


def test_status_received():
    message = _messages.lcmt_panda_status(utime=3, num_joints=2)
    for i, field in enumerate(f for f, kind, *size in message._fields if size):
        setattr(message, field, [1.0 + i, 2.0 + i])
    both(listened, lambda lib: lib.PandaStatusReceiver(2), message)


def test_modes():
    for name in ("sheldrake", "pydrake"):
        lib = library(name)
        with pytest.raises(RuntimeError, match="Invalid control_mode bits set: 0x8"):
            lib.PandaCommandReceiver(2, 9)
        assert (lib.PandaControlMode.kPosition | lib.PandaControlMode.kTorque) == 5 and lib.kPandaArmNumJoints == 7
        receiver = lib.PandaCommandReceiver(num_joints=2, control_mode=1)
        context = receiver.CreateDefaultContext()
        receiver.get_position_measured_input_port().FixValue(context, [1.0, 2.0])
        receiver.LatchInitialPosition(context)
        assert context.get_discrete_state(1).value().tolist() == [1.0, 2.0]


def trajectory(name, desired, finger, use_force_limit):
    """Target and force limit over time; the desired distance changes at 0.4 s, by little and by more."""
    lib = library(name)
    generator = lib.SchunkWsgTrajectoryGenerator(2, 1, use_force_limit)
    simulator = lib.Simulator(generator)
    context = simulator.get_mutable_context()
    generator.get_desired_position_input_port().FixValue(context, [desired])
    generator.get_state_input_port().FixValue(context, [9.0, finger])
    if use_force_limit:
        generator.get_force_limit_input_port().FixValue(context, [40.0])
    rows = []
    for t in np.arange(0.0, 0.8, 0.013):
        if 0.4 < t < 0.413:
            generator.get_desired_position_input_port().FixValue(context, [desired + 5e-5])
        if t > 0.6:
            generator.get_desired_position_input_port().FixValue(context, [desired + 0.03])
        simulator.AdvanceTo(t)
        ports = range(generator.num_output_ports())
        rows.append(np.concatenate([generator.get_output_port(j).Eval(context) for j in ports]))
    return np.array(rows)


@pytest.mark.parametrize("finger", [-0.02, -0.05, -0.025, -0.0251])
@pytest.mark.parametrize("use_force_limit", [True, False])
def test_trajectories_of_a_gripper(finger, use_force_limit):
    ours, theirs = (trajectory(name, 0.05, finger, use_force_limit) for name in ("sheldrake", "pydrake"))
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def grip_forces(name, gains, error=0.0):
    """Forces of the controller at random states of the fingers, once it has been told where to go."""
    lib, (cls, extra) = library(name), kind(name, "lcmt_schunk_wsg_command")
    lcm, builder = lib.DrakeLcm("memq://"), lib.DiagramBuilder()
    controller = builder.AddSystem(lib.SchunkWsgController(**gains))
    subscriber = builder.AddSystem(lib.LcmSubscriberSystem.Make("W", cls, lcm, **extra))
    builder.Connect(subscriber.get_output_port(), controller.GetInputPort("command_message"))
    simulator = lib.Simulator(builder.Build())
    context = controller.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    rng, out = np.random.default_rng(0), []
    for k, force in enumerate((40.0, 5.0, 1e4)):
        message = _messages.lcmt_schunk_wsg_command(utime=k + 1, target_position_mm=50.0 + 9 * k + error, force=force)
        lcm.Publish("W", message.encode())
        lcm.HandleSubscriptions(0)
        for i in range(6):
            state = np.array([-0.025, 0.025, 0.0, 0.0]) + rng.normal(size=4) * [0.003, 0.003, 0.1, 0.1]
            controller.GetInputPort("state").FixValue(context, state)
            simulator.AdvanceTo(k + 0.1 * (i + 1) + 0.02)  # between updates
            out.append(controller.get_output_port().Eval(context))
    return np.array(out)


@pytest.mark.parametrize("gains", [{}, {"kp": 100.0, "ki": 30.0, "kd": 7.0}])
def test_forces_of_a_gripper(gains):
    ours, theirs = (grip_forces(name, gains) for name in ("sheldrake", "pydrake"))
    assert np.abs(theirs).max() > 1.0
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)
    assert np.abs(grip_forces("sheldrake", gains, error=1e-3) - theirs).max() > 1e-9, "a millimetre's thousandth shows"
