"""A quadruped stands on its four feet, twelve joints held by PD gains: CPU time of a 1 ms step.

    python benchmarks/quadruped.py [quadruped a1] [--rounds 7] [--seconds 2]

All contenders read the same URDF, the one that ships with sheldrake or, for the A1, that of example-robot-data (found
there or by SHELDRAKE_ROBOTS); gains are implicit in the step in each of them, and the two sides of a joint never touch.
"standing" is timed after a second in which the robot comes to rest, "landing" from a fall of 2 cm on.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import re
import sys
import tempfile
import time
from typing import NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.real_robots import exclude_neighbours, with_hulls  # noqa: E402
from benchmarks.turns import machine, ratio, take_turns  # noqa: E402
from tests.crosscheck.robots.real_robots import robots_folder  # noqa: E402

OURS = "sheldrake"
KP, KD, DT, FRICTION = 300.0, 8.0, 1e-3, 0.8


class Robot(NamedTuple):
    """A quadruped and how it stands.

    Attributes:
        urdf: its description.
        thigh: angle of the thighs; the calves are turned back by twice as much [rad].
        leg: length of thigh and of calf [m].
        foot: radius [m].
        effort: the most that a motor gives [N m].
    """

    urdf: pathlib.Path
    thigh: float
    leg: float
    foot: float
    effort: float

    def stance(self) -> np.ndarray:
        """Angles of the joints [rad], shape (12,)."""
        return np.tile([0.0, self.thigh, -2.0 * self.thigh], 4)

    def height(self) -> float:
        """Of the trunk when the feet touch the ground [m]."""
        return 2.0 * self.leg * float(np.cos(self.thigh)) + self.foot


URDF = ROOT / "src" / "sheldrake" / "models" / "quadruped" / "quadruped.urdf"
QUADRUPED = Robot(URDF, thigh=0.7, leg=0.22, foot=0.025, effort=40.0)


def robots(folder: pathlib.Path) -> dict[str, Robot]:
    """The robots there are; files made for them go into a folder."""
    found = {"quadruped": QUADRUPED}
    others = robots_folder()
    if others is not None:
        urdf = with_hulls(others / "a1_description" / "urdf" / "a1.urdf", folder)
        found["a1"] = Robot(urdf, thigh=0.8, leg=0.2, foot=0.02, effort=33.5)
    return found


class DrakeLike:
    """The quadruped in sheldrake or pydrake."""

    def __init__(self, package: str, settle: float, robot: Robot = QUADRUPED):
        lib = importlib.import_module(f"{package}.all")
        self.lib, self.robot, self.settle = lib, robot, settle
        builder = lib.DiagramBuilder()
        plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, DT)
        (instance,) = lib.Parser(plant).AddModels(str(robot.urdf))
        friction = 1.0 / (2.0 / FRICTION - 1.0)  # of the ground; that of the feet is 1
        ground = plant.world_body(), lib.RigidTransform(), lib.HalfSpace(), "ground"
        plant.RegisterCollisionGeometry(*ground, lib.CoulombFriction(friction, friction))
        if plant.num_actuators() == 0:
            joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
            for joint in [joint for joint in joints if joint.num_velocities() == 1]:
                plant.AddJointActuator(joint.name(), joint, robot.effort)
        for i in plant.GetJointActuatorIndices():
            plant.get_joint_actuator(i).set_controller_gains(lib.PdControllerGains(p=KP, d=KD))
        plant.Finalize()
        exclude_neighbours(lib, plant, scene_graph)
        wanted = builder.AddSystem(lib.ConstantVectorSource(np.concatenate([robot.stance(), np.zeros(12)])))
        builder.Connect(wanted.get_output_port(), plant.get_desired_state_input_port(instance))
        self.simulator = lib.Simulator(builder.Build())
        self.plant, self.context = plant, plant.GetMyContextFromRoot(self.simulator.get_context())
        self.simulator.AdvanceTo(DT)

    def turn(self, seconds: float) -> float:
        """CPU time of a step [us]."""
        plant, context, simulator = self.plant, self.context, self.simulator
        plant.SetVelocities(context, np.zeros(plant.num_velocities()))
        (trunk,) = plant.GetFloatingBaseBodies()
        trunk, height = plant.get_body(trunk), self.robot.height()
        plant.SetFreeBodyPose(context, trunk, self.lib.RigidTransform([0.0, 0.0, height + 0.02]))
        for i, angle in zip(plant.GetJointActuatorIndices(), self.robot.stance()):
            plant.get_joint_actuator(i).joint().set_angle(context, angle)
        simulator.get_mutable_context().SetTime(0.0)
        simulator.Initialize()
        simulator.AdvanceTo(self.settle)
        start = time.process_time()
        simulator.AdvanceTo(self.settle + seconds)
        spent = time.process_time() - start
        assert abs(plant.EvalBodyPoseInWorld(context, trunk).translation()[2] - height) < 0.05
        return spent / round(seconds / DT) * 1e6


class MuJoCo:
    """The quadruped in MuJoCo."""

    def __init__(self, settle: float, robot: Robot = QUADRUPED):
        import mujoco

        text = robot.urdf.read_text()
        options = '<mujoco><compiler strippath="false" balanceinertia="true" fusestatic="false"/></mujoco>'
        spec = mujoco.MjSpec.from_string(re.sub(r"(<robot[^>]*>)", rf"\1{options}", text, count=1))
        spec.option.timestep = DT
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.worldbody.bodies[0].add_freejoint()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
        for geom in spec.geoms:
            geom.friction = [FRICTION, 0.0, 0.0]
        for joint in spec.joints:
            if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
                servo.set_to_position(kp=KP, kv=KD)
                servo.forcelimited, servo.forcerange = True, [-robot.effort, robot.effort]
        self.mujoco, self.model, self.robot, self.settle = mujoco, spec.compile(), robot, settle
        self.data = mujoco.MjData(self.model)

    def turn(self, seconds: float) -> float:
        """CPU time of a step [us]."""
        mujoco, model, data = self.mujoco, self.model, self.data
        mujoco.mj_resetData(model, data)
        height, stance = self.robot.height(), self.robot.stance()
        data.qpos[:] = [0.0, 0.0, height + 0.02, 1.0, 0.0, 0.0, 0.0, *stance]
        data.ctrl[:] = stance
        if self.settle:
            mujoco.mj_step(model, data, round(self.settle / DT))
        start = time.process_time()
        mujoco.mj_step(model, data, round(seconds / DT))
        spent = time.process_time() - start
        assert abs(data.qpos[2] - height) < 0.05
        return spent / round(seconds / DT) * 1e6


def compare(name: str, robot: Robot, rounds: int, seconds: float) -> None:
    """Prints the times of all engines."""
    for what, settle in (("landing", 0.0), ("standing", 1.0)):
        engines = {OURS: DrakeLike(OURS, settle, robot), "Drake": DrakeLike("pydrake", settle, robot)}
        engines["MuJoCo"] = MuJoCo(settle, robot)
        times = take_turns({name: lambda e=e: e.turn(seconds) for name, e in engines.items()}, rounds)
        for engine in engines:
            spent, times_ours = np.median(times[engine]), ratio(times, engine, OURS)
            print(f"{name:12s}{what:10s}{engine:12s}{spent:8.2f} us a step {times_ours:>24s}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", help="all there are without any")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=2.0)
    options = parser.parse_args()
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        for name, robot in robots(pathlib.Path(folder)).items():
            if not options.robots or name in options.robots:
                compare(name, robot, options.rounds, options.seconds)


if __name__ == "__main__":
    main()
