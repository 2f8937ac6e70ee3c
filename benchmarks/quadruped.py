"""A quadruped stands on its four feet, twelve joints held by PD gains: CPU time of a 1 ms step.

    python benchmarks/quadruped.py [--rounds 7] [--seconds 2]

All contenders read the URDF that ships with sheldrake; gains are implicit in the step in each of them. "standing" is
timed after a second in which the robot comes to rest, "landing" from a fall of 2 cm on.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.turns import machine, ratio, take_turns  # noqa: E402

URDF = ROOT / "src" / "sheldrake" / "models" / "quadruped" / "quadruped.urdf"
OURS = "sheldrake"
KP, KD, DT, FRICTION = 300.0, 8.0, 1e-3, 0.8
STANCE = np.tile([0.0, 0.7, -1.4], 4)
HEIGHT = 2 * 0.22 * np.cos(0.7) + 0.025
"""Of the trunk when the feet touch the ground [m]."""


class DrakeLike:
    """The quadruped in sheldrake or pydrake."""

    def __init__(self, package: str, settle: float):
        lib = importlib.import_module(f"{package}.all")
        self.lib, self.settle = lib, settle
        builder = lib.DiagramBuilder()
        plant, _ = lib.AddMultibodyPlantSceneGraph(builder, DT)
        (robot,) = lib.Parser(plant).AddModels(str(URDF))
        friction = 1.0 / (2.0 / FRICTION - 1.0)  # of the ground; that of the feet is 1
        ground = plant.world_body(), lib.RigidTransform(), lib.HalfSpace(), "ground"
        plant.RegisterCollisionGeometry(*ground, lib.CoulombFriction(friction, friction))
        for i in plant.GetJointActuatorIndices():
            plant.get_joint_actuator(i).set_controller_gains(lib.PdControllerGains(p=KP, d=KD))
        plant.Finalize()
        wanted = builder.AddSystem(lib.ConstantVectorSource(np.concatenate([STANCE, np.zeros(12)])))
        builder.Connect(wanted.get_output_port(), plant.get_desired_state_input_port(robot))
        self.simulator = lib.Simulator(builder.Build())
        self.plant, self.context = plant, plant.GetMyContextFromRoot(self.simulator.get_context())
        self.simulator.AdvanceTo(DT)

    def turn(self, seconds: float) -> float:
        """CPU time of a step [us]."""
        plant, context, simulator = self.plant, self.context, self.simulator
        plant.SetVelocities(context, np.zeros(plant.num_velocities()))
        trunk = plant.GetBodyByName("trunk")
        plant.SetFreeBodyPose(context, trunk, self.lib.RigidTransform([0.0, 0.0, HEIGHT + 0.02]))
        for i, angle in zip(plant.GetJointActuatorIndices(), STANCE):
            plant.get_joint_actuator(i).joint().set_angle(context, angle)
        simulator.get_mutable_context().SetTime(0.0)
        simulator.Initialize()
        simulator.AdvanceTo(self.settle)
        start = time.process_time()
        simulator.AdvanceTo(self.settle + seconds)
        spent = time.process_time() - start
        assert abs(plant.EvalBodyPoseInWorld(context, trunk).translation()[2] - HEIGHT) < 0.05
        return spent / round(seconds / DT) * 1e6


class MuJoCo:
    """The quadruped in MuJoCo."""

    def __init__(self, settle: float):
        import mujoco

        spec = mujoco.MjSpec.from_file(str(URDF))
        spec.option.timestep = DT
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.body("trunk").add_freejoint()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
        for geom in spec.geoms:
            geom.friction = [FRICTION, 0.0, 0.0]
        for joint in spec.joints:
            if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
                servo.set_to_position(kp=KP, kv=KD)
                servo.forcelimited, servo.forcerange = True, [-40, 40]
        self.mujoco, self.model, self.settle = mujoco, spec.compile(), settle
        self.data = mujoco.MjData(self.model)

    def turn(self, seconds: float) -> float:
        """CPU time of a step [us]."""
        mujoco, model, data = self.mujoco, self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[:] = [0.0, 0.0, HEIGHT + 0.02, 1.0, 0.0, 0.0, 0.0, *STANCE]
        data.ctrl[:] = STANCE
        if self.settle:
            mujoco.mj_step(model, data, round(self.settle / DT))
        start = time.process_time()
        mujoco.mj_step(model, data, round(seconds / DT))
        spent = time.process_time() - start
        assert abs(data.qpos[2] - HEIGHT) < 0.05
        return spent / round(seconds / DT) * 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=2.0)
    options = parser.parse_args()
    print(machine())
    for what, settle in (("landing", 0.0), ("standing", 1.0)):
        engines = {OURS: DrakeLike(OURS, settle), "Drake": DrakeLike("pydrake", settle)}
        engines["MuJoCo"] = MuJoCo(settle)
        times = take_turns({name: lambda e=e: e.turn(options.seconds) for name, e in engines.items()}, options.rounds)
        for name in engines:
            print(f"{what:10s}{name:12s}{np.median(times[name]):8.2f} us a step {ratio(times, name, OURS):>24s}")


if __name__ == "__main__":
    main()
