"""Messages of arms and grippers as vectors and back, and errors."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake import manipulation as m
from sheldrake.lcm._messages import lcmt_iiwa_command, lcmt_iiwa_status, lcmt_schunk_wsg_command


def wired(sender, receiver, inputs):
    """Values of the receiver's outputs when the sender's inputs have these values."""
    context = sender.CreateDefaultContext()
    context.SetTime(0.25)
    for name, value in inputs.items():
        sender.GetInputPort(name).FixValue(context, value)
    message = sender.get_output_port().Eval(context)
    decoded = type(message).decode(message.encode())
    reader = receiver.CreateDefaultContext()
    receiver.get_input_port(0).FixValue(reader, decoded)
    ports = [receiver.get_output_port(i) for i in range(receiver.num_output_ports())]
    return {port.get_name(): port.Eval(reader) for port in ports}


def test_iiwa_status_there_and_back():
    rng = np.random.default_rng(1)
    names = ["position_commanded", "position_measured", "velocity_estimated", "torque_commanded", "torque_measured"]
    inputs = {name: rng.normal(size=7) for name in [*names, "torque_external"]}
    found = wired(m.IiwaStatusSender(), m.IiwaStatusReceiver(), inputs)
    for name, value in inputs.items():
        assert np.array_equal(found[name], value), name
    assert found["time_measured"] == 0.25
    del inputs["torque_measured"], inputs["torque_external"], inputs["velocity_estimated"]
    found = wired(m.IiwaStatusSender(), m.IiwaStatusReceiver(), inputs)
    assert np.array_equal(found["torque_measured"], inputs["torque_commanded"])
    assert not found["torque_external"].any() and not found["velocity_estimated"].any()


def test_iiwa_status_before_the_first_message():
    receiver = m.IiwaStatusReceiver(3)
    context = receiver.CreateDefaultContext()
    receiver.get_input_port().FixValue(context, lcmt_iiwa_status())
    assert receiver.get_position_measured_output_port().Eval(context).tolist() == [0.0] * 3


def test_iiwa_commands_there_and_back():
    q, tau = np.linspace(0, 1, 7), np.linspace(-5, 5, 7)
    found = wired(m.IiwaCommandSender(), m.IiwaCommandReceiver(), {"position": q, "torque": tau})
    assert np.array_equal(found["position"], q) and np.array_equal(found["torque"], tau) and found["time"] == 0.25
    mode = m.IiwaControlMode.kPositionOnly
    found = wired(m.IiwaCommandSender(7, mode), m.IiwaCommandReceiver(7, mode), {"position": q, "time": [0.5]})
    assert set(found) == {"position", "time"} and found["time"] == 0.5


def test_before_the_first_command_an_arm_stays_where_it_was():
    receiver = m.IiwaCommandReceiver(2)
    context = receiver.CreateDefaultContext()
    receiver.get_message_input_port().FixValue(context, lcmt_iiwa_command())
    measured = receiver.get_position_measured_input_port()
    measured.FixValue(context, [1.0, 2.0])
    position = receiver.get_commanded_position_output_port()
    assert position.Eval(context).tolist() == [1.0, 2.0]
    receiver.ExecuteInitializationEvents(context)
    measured.FixValue(context, [3.0, 4.0])  # it sagged; the command does not follow
    assert position.Eval(context).tolist() == [1.0, 2.0]
    assert receiver.get_commanded_torque_output_port().Eval(context).tolist() == [0.0, 0.0]


def test_a_command_for_another_arm_is_refused():
    receiver = m.IiwaCommandReceiver(2)
    context = receiver.CreateDefaultContext()
    receiver.get_message_input_port().FixValue(
        context, lcmt_iiwa_command(utime=1, num_joints=3, joint_position=[1.0, 2.0, 3.0])
    )
    with pytest.raises(RuntimeError, match="has 3 elements; the arm has 2 joints"):
        receiver.get_commanded_position_output_port().Eval(context)


def test_wsg_messages_there_and_back():
    found = wired(m.SchunkWsgCommandSender(), m.SchunkWsgCommandReceiver(), {"position": [0.05]})
    assert found["position"] == pytest.approx(0.05, abs=1e-15) and found["force_limit"] == 40.0
    found = wired(m.SchunkWsgStatusSender(), m.SchunkWsgStatusReceiver(), {"u0": [0.05, -0.1], "u1": [7.0]})
    assert found["state"] == pytest.approx([0.05, -0.1], abs=1e-15) and found["force"] == 7.0
    receiver = m.SchunkWsgCommandReceiver(initial_position=0.03, initial_force=5.0)
    context = receiver.CreateDefaultContext()
    receiver.get_input_port().FixValue(context, lcmt_schunk_wsg_command())
    assert receiver.get_position_output_port().Eval(context) == 0.03
    assert receiver.get_force_limit_output_port().Eval(context) == 5.0


def test_modes():
    assert m.ParseIiwaControlMode("torque_only") is m.IiwaControlMode.kTorqueOnly
    assert not m.position_enabled(m.IiwaControlMode.kTorqueOnly)
    assert m.torque_enabled(m.IiwaControlMode.kPositionAndTorque)
    with pytest.raises(RuntimeError, match="valid: position_only, torque_only, position_and_torque"):
        m.ParseIiwaControlMode("gently")


def test_wrong_settings_say_so():
    with pytest.raises(AttributeError, match="it has pid_gains, lcm_bus"):
        m.SchunkWsgDriver(gains=[1.0])
    with pytest.raises(RuntimeError, match="must be positive"):
        m.SchunkWsgPositionController(default_force_limit=0.0)


def test_an_arm_with_another_name_carries_its_hand_on_a_frame_of_the_scenario(tmp_path):
    """The driver's own model of the arm, which has the file's name, gets the hand's mass at the right place."""
    import sheldrake.all as lib

    link = '<link name="{0}"><inertial><origin xyz="{2} 0 0"/><mass value="{1}"/></inertial></link>'
    arm = "".join(link.format(f"l{i}", 1.0, 0.0) for i in range(8)) + "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><axis xyz="0 0 1"/>'
        f'<limit effort="9"/></joint><transmission name="t{i}"><type>SimpleTransmission</type><joint name="j{i}"/>'
        f'<actuator name="m{i}"/></transmission>'
        for i in range(7)
    )
    (tmp_path / "arm.urdf").write_text(f'<robot name="of_the_file">{arm}</robot>', encoding="utf-8")
    hand = f'<robot name="hand">{link.format("palm", 5.0, 0.25)}</robot>'
    (tmp_path / "hand.urdf").write_text(hand, encoding="utf-8")
    directives = lib.LoadModelDirectivesFromString(f"""
directives:
- add_model: {{name: iiwa, file: 'file://{tmp_path}/arm.urdf'}}
- add_weld: {{parent: world, child: iiwa::l0}}
- add_frame: {{name: mount, X_PF: {{base_frame: iiwa::l7, translation: [0.5, 0, 0]}}}}
- add_model: {{name: hand, file: 'file://{tmp_path}/hand.urdf'}}
- add_weld: {{parent: mount, child: hand::palm}}
""")
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.001)
    infos = lib.ProcessModelDirectives(directives, lib.Parser(plant))
    plant.Finalize()
    buses = lib.LcmBuses()
    buses.Add("default", lib.DrakeLcm("memq://"))
    lib.ApplyDriverConfigs(
        driver_configs={"iiwa": m.IiwaDriver(hand_model_name="hand")},
        sim_plant=plant,
        models_from_directives=infos,
        lcm_buses=buses,
        builder=builder,
    )
    alone = builder.GetSubsystemByName("iiwa_controller_plant").get()
    context = alone.CreateDefaultContext()
    assert alone.CalcTotalMass(context) == 13.0
    assert alone.CalcCenterOfMassPositionInWorld(context)[0] == pytest.approx(5 * 0.75 / 13.0, rel=1e-12)


def test_an_arm_has_joints():
    from sheldrake.manipulation import IiwaCommandReceiver

    with pytest.raises(RuntimeError, match="num_joints must be positive, got 0"):
        IiwaCommandReceiver(0)
