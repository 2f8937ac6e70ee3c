"""Drivers of arms and grippers give Drake's numbers, message by message."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from sheldrake.lcm._messages import (
    lcmt_iiwa_command,
    lcmt_iiwa_status,
    lcmt_schunk_wsg_command,
    lcmt_schunk_wsg_status,
)

pytestmark = pytest.mark.peer
N = 7


def arm_urdf() -> str:
    links = "".join(
        f'<link name="l{i}"><inertial><origin xyz="0.1 0 0.2"/><mass value="{1 + i}"/>'
        '<inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for i in range(N + 1)
    )
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="0 0 0.3"/>'
        f'<axis xyz="{1 - i % 2} {i % 2} 0"/><limit lower="-10" upper="10" effort="300" velocity="10"/></joint>'
        f'<transmission name="t{i}"><type>transmission_interface/SimpleTransmission</type><joint name="j{i}"/>'
        f'<actuator name="m{i}"/></transmission>'
        for i in range(N)
    )
    return f'<robot name="iiwa">{links}{joints}</robot>'


def statuses(package: str, folder, mode: str, command: lcmt_iiwa_command | None) -> list[lcmt_iiwa_status]:
    """What the driver of an arm reports in 0.1 s; a command comes before 0.05 s."""
    lib = importlib.import_module(f"{package}.all")
    (folder / "arm.urdf").write_text(arm_urdf(), encoding="utf-8")
    (folder / "arm.yaml").write_text(
        f"directives:\n- add_model: {{name: iiwa, file: 'file://{folder}/arm.urdf'}}\n"
        "- add_weld: {parent: world, child: iiwa::l0}\n",
        encoding="utf-8",
    )
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.001)
    infos = lib.ProcessModelDirectives(lib.LoadModelDirectives(str(folder / "arm.yaml")), lib.Parser(plant))
    plant.Finalize()
    lib.ApplyNamedPositionsAsDefaults({"iiwa": {"j1": [0.3], "j4": [-0.5]}}, plant)
    lcm, buses = lib.DrakeLcm("memq://"), lib.LcmBuses()
    buses.Add("default", lcm)
    driver = lib.IiwaDriver(control_mode=mode)
    lib.ApplyDriverConfigs(
        driver_configs={"iiwa": driver},
        sim_plant=plant,
        models_from_directives=infos,
        lcm_buses=buses,
        builder=builder,
    )
    found: list = []
    lcm.Subscribe("IIWA_STATUS", lambda message: found.append(lcmt_iiwa_status.decode(message)))
    simulator = lib.Simulator(builder.Build())
    # Not by an LcmInterfaceSystem: within AdvanceTo Drake 1.51 makes bytes for a handler in Python without the
    # interpreter's lock, which corrupts the memory of the process.
    for k in range(20):
        if k == 10 and command is not None:
            lcm.Publish("IIWA_COMMAND", command.encode())
        lcm.HandleSubscriptions(0)
        simulator.AdvanceTo(0.005 * (k + 1))
    lcm.HandleSubscriptions(0)
    return found


@pytest.mark.parametrize("mode", ["position_and_torque", "position_only", "torque_only"])
def test_status_of_a_driven_arm(tmp_path, mode):
    pytest.importorskip("pydrake")
    command = lcmt_iiwa_command(utime=40_000)
    if mode != "torque_only":
        command.num_joints, command.joint_position = N, np.linspace(0.1, -0.1, N).tolist()
    if mode != "position_only":
        command.num_torques, command.joint_torque = N, np.linspace(5.0, -5.0, N).tolist()
    ours, theirs = (statuses(p, tmp_path, mode, command) for p in ("sheldrake", "pydrake"))
    assert [m.utime for m in ours] == [m.utime for m in theirs] and len(ours) >= 20
    assert ours[-1].joint_position_measured != ours[0].joint_position_measured
    for name, *_ in lcmt_iiwa_status._fields[2:]:
        mine, its = (np.array([getattr(m, name) for m in found]) for found in (ours, theirs))
        # Both integrate the same equations in other orders of summation; torques are of the order of 100 N m.
        assert np.abs(mine - its).max() < 1e-9 * max(1.0, np.abs(its).max()), name


@pytest.mark.parametrize("package", ["sheldrake", "pydrake"])
@pytest.mark.parametrize("torques, utime", [(N, 1), (N, 0), (0, 1)])
def test_a_command_without_positions_is_refused_where_they_are_expected(tmp_path, package, torques, utime):
    pytest.importorskip("pydrake")
    command = lcmt_iiwa_command(utime=utime, num_torques=torques, joint_torque=[1.0] * torques)
    with pytest.raises(RuntimeError):
        statuses(package, tmp_path, "position_and_torque", command)


def received(package: str, name: str, message) -> np.ndarray:
    """All outputs of a receiver of messages after one that came over LCM, which Drake's need."""
    lib, drake = importlib.import_module(f"{package}.all"), importlib.import_module("drake")
    lcm, builder = lib.DrakeLcm("memq://"), lib.DiagramBuilder()
    kind = getattr(drake, type(message).__name__)
    source = builder.AddSystem(lib.LcmSubscriberSystem.Make("C", kind, lcm, use_cpp_serializer=True))
    receiver = builder.AddSystem(getattr(lib, name)())
    builder.Connect(source.get_output_port(), receiver.get_input_port(0))
    simulator = lib.Simulator(builder.Build())
    simulator.Initialize()
    lcm.Publish("C", message.encode())
    lcm.HandleSubscriptions(0)
    simulator.AdvanceTo(0.001)
    context = receiver.GetMyContextFromRoot(simulator.get_context())
    return np.concatenate([receiver.get_output_port(i).Eval(context) for i in range(receiver.num_output_ports())])


@pytest.mark.parametrize("utime", [0, 1])
@pytest.mark.parametrize("position, force", [(0.0, 0.0), (0.0, 7.0), (30.0, 0.0), (30.0, 7.0), (np.nan, 7.0)])
def test_only_a_message_of_zeros_is_no_command_for_a_gripper(utime, position, force):
    pytest.importorskip("pydrake")
    message = lcmt_schunk_wsg_command(utime=utime, target_position_mm=position, force=force)
    ours, theirs = (received(p, "SchunkWsgCommandReceiver", message) for p in ("sheldrake", "pydrake"))
    np.testing.assert_array_equal(ours, theirs)


def test_a_status_without_joints_has_no_time():
    pytest.importorskip("pydrake")
    ours, theirs = (received(p, "IiwaStatusReceiver", lcmt_iiwa_status(utime=5)) for p in ("sheldrake", "pydrake"))
    np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("limit", [None, 7.0])
def test_gripper(limit):
    pytest.importorskip("pydrake")
    rng = np.random.default_rng(3)
    for _ in range(10):
        gains, state = rng.uniform(0.0, 1000.0, 4), rng.uniform(-0.1, 0.1, 4)
        position, later = rng.uniform(0.0, 0.1, 2)
        found = []
        for package in ("sheldrake", "pydrake"):
            lib = importlib.import_module(f"{package}.all")
            control = lib.SchunkWsgPositionController(0.05, *gains, 40.0)
            simulator = lib.Simulator(control)
            context = simulator.get_mutable_context()
            control.GetInputPort("state").FixValue(context, state)
            control.GetInputPort("desired_position").FixValue(context, [position])
            if limit is not None:
                control.GetInputPort("force_limit").FixValue(context, [limit])
            numbers = []
            for t in (0.0, 0.06, 0.12, 0.18):
                simulator.AdvanceTo(t)
                if t == 0.06:
                    control.GetInputPort("desired_position").FixValue(context, [later])
                for port in ("generalized_force", "grip_force"):
                    numbers.extend(control.GetOutputPort(port).Eval(context))
            found.append(numbers)
        assert np.abs(np.subtract(*found)).max() < 1e-12 * np.abs(found[1]).max()


GRIPPER = """<sdf version="1.7"><model name="wsg">
  <link name="palm"/><joint name="weld" type="fixed"><parent>world</parent><child>palm</child></joint>
  {}</model></sdf>""".format(
    "".join(
        f"""<link name="{name}"><pose>{x} 0 0 0 0 0</pose><inertial><mass>0.05</mass></inertial>
        <collision name="c"><geometry><box><size>0.01 0.02 0.02</size></box></geometry></collision></link>
        <joint name="{name}_joint" type="prismatic"><parent>palm</parent><child>{name}</child>
        <axis><xyz>1 0 0</xyz><limit><lower>{lower}</lower><upper>{upper}</upper><effort>80</effort></limit></axis>
        </joint>"""
        for name, x, lower, upper in (("left", -0.015, -0.055, 0), ("right", 0.015, 0, 0.055))
    )
)
"""Two fingers on sliders, 2 cm apart where they are closed."""


def gripper_statuses(package, gains):
    """Status messages of a gripper that opens, then closes on a welded block."""
    lib = importlib.import_module(f"{package}.all")
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    (wsg,) = lib.Parser(plant).AddModelsFromString(GRIPPER, "sdf")
    friction = lib.CoulombFriction(1.0, 1.0)
    plant.RegisterCollisionGeometry(plant.world_body(), lib.RigidTransform(), lib.Sphere(0.02), "block", friction)
    plant.Finalize()
    lcm = lib.DrakeLcm("memq://")
    lib.BuildSchunkWsgControl(plant, wsg, lcm, builder, *gains)
    names = [s.get_name() for s in builder.GetSystems() if s.get_name().startswith("wsg_")]
    simulator = lib.Simulator(builder.Build())
    plant.SetPositions(plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), [-0.02, 0.02])
    found = []
    lcm.Subscribe("SCHUNK_WSG_STATUS", lambda data: found.append(lcmt_schunk_wsg_status.decode(data)))
    for k in range(22):
        lcm.HandleSubscriptions(0)
        if k in (4, 11):
            command = lcmt_schunk_wsg_command(utime=k, target_position_mm=100.0 if k == 4 else 10.0, force=15.0)
            lcm.Publish("SCHUNK_WSG_COMMAND", command.encode())
            lcm.HandleSubscriptions(0)
        simulator.AdvanceTo(0.03 * (k + 1))
    lcm.HandleSubscriptions(0)
    return names, [(m.utime, m.actual_position_mm, m.actual_speed_mm_per_s, m.actual_force) for m in found]


@pytest.mark.parametrize("gains", [(), ([2000.0, 0.0, 5.0],)])
def test_status_of_a_driven_gripper(gains):
    pytest.importorskip("pydrake")
    (names, ours), (their_names, theirs) = (gripper_statuses(p, gains) for p in ("sheldrake", "pydrake"))
    assert names == their_names == ["wsg_wsg_command_subscriber", "wsg_wsg_status_publisher"]
    ours, theirs = np.array(ours), np.array(theirs)
    assert len(ours) == len(theirs) >= 12 and np.ptp(ours[:, 1]) > 50.0 and ours[-1, 3] > 10.0
    # mm, mm/s and N; contact is solved to 1e-6 or so by both.
    assert np.abs(ours - theirs).max() < 1e-4


def test_constants_and_small_systems():
    theirs = pytest.importorskip("pydrake.manipulation")
    ours = importlib.import_module("sheldrake.manipulation")
    for name in ("GetSchunkWsgOpenPosition", "get_iiwa_max_joint_velocities"):
        assert np.array_equal(getattr(ours, name)(), getattr(theirs, name)())
    for name in ("IiwaDriver", "SchunkWsgDriver", "ZeroForceDriver"):
        assert repr(getattr(ours, name)()) == repr(getattr(theirs, name)())
    for make in ("MakeMultibodyStateToWsgStateSystem", "MakeMultibodyForceToWsgForceSystem"):
        answers = []
        for module in (ours, theirs):
            system = getattr(module, make)()
            context = system.CreateDefaultContext()
            u = np.random.default_rng(4).normal(size=system.get_input_port().size())
            system.get_input_port().FixValue(context, u)
            answers.append(system.get_output_port().Eval(context))
        assert np.array_equal(*answers)
