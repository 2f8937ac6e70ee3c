"""A seven-joint arm under PD control and a humanoid's forward dynamics, against Drake, MuJoCo and Pinocchio.

    python benchmarks/arm.py [--rounds 7] [--seconds 10] [--evaluations 20000]

Stepping: 1 ms steps of the arm in a diagram, started away from where it is sent, with no log. In "motors" the gains
belong to the actuators (implicit in the step), in "PidController" a controller is a system of the diagram (explicit);
MuJoCo has position servos in its implicit integrator, run by its own compiled loop. Forward dynamics: a floating
humanoid of 35 degrees of freedom in compiled loops over random states; Pinocchio's `aba`, MuJoCo's smooth dynamics.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.robots import arm_urdf, humanoid_urdf  # noqa: E402
from benchmarks.turns import machine, ratio, take_turns  # noqa: E402

KP, KD, DT = 200.0, 20.0, 1e-3
GEAR, REFLECTED = 100.0, 0.1
"""Gear ratio of the motors and their inertia at the joint [kg m²]."""
START, GOAL = np.linspace(-0.6, 0.6, 7), np.linspace(0.5, -0.5, 7)
OURS = "sheldrake"


class DrakeLike:
    """The arm in sheldrake or pydrake."""

    def __init__(self, package: str, motors: bool):
        lib = importlib.import_module(f"{package}.all")
        builder = lib.DiagramBuilder()
        plant, _ = lib.AddMultibodyPlantSceneGraph(builder, DT)
        lib.Parser(plant).AddModelsFromString(arm_urdf(), "urdf")
        arm = plant.GetModelInstanceByName("arm")
        for i in plant.GetJointActuatorIndices():
            motor = plant.get_joint_actuator(i)
            motor.set_default_rotor_inertia(REFLECTED / GEAR**2)
            motor.set_default_gear_ratio(GEAR)
            if motors:
                motor.set_controller_gains(lib.PdControllerGains(p=KP, d=KD))
        plant.Finalize()
        goal = builder.AddSystem(lib.ConstantVectorSource(np.concatenate([GOAL, np.zeros(7)])))
        if motors:
            builder.Connect(goal.get_output_port(), plant.get_desired_state_input_port(arm))
        else:
            gains = [np.full(7, k) for k in (KP, 0.0, KD)]
            pid = builder.AddSystem(lib.PidController(*gains))
            builder.Connect(plant.get_state_output_port(), pid.get_input_port_estimated_state())
            builder.Connect(goal.get_output_port(), pid.get_input_port_desired_state())
            builder.Connect(pid.get_output_port(), plant.get_actuation_input_port())
        self.simulator = lib.Simulator(builder.Build())
        context = plant.GetMyContextFromRoot(self.simulator.get_context())
        self.plant, self.context = plant, context
        plant.SetPositions(context, START)
        self.simulator.AdvanceTo(DT)

    def turn(self, seconds: float) -> float:
        """CPU time of a step [us]."""
        plant, context, simulator = self.plant, self.context, self.simulator
        plant.SetPositionsAndVelocities(context, np.concatenate([START, np.zeros(7)]))
        simulator.get_mutable_context().SetTime(0.0)
        simulator.Initialize()
        start = time.process_time()
        simulator.AdvanceTo(seconds)
        spent = time.process_time() - start
        assert abs(plant.GetPositions(context) - GOAL).max() < 0.5
        return spent / round(seconds / DT) * 1e6


class MuJoCo:
    """The arm in MuJoCo."""

    def __init__(self):
        import mujoco
        import mujoco.rollout

        spec = mujoco.MjSpec.from_string(arm_urdf())
        spec.option.timestep = DT
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        for joint in spec.joints:
            joint.armature = REFLECTED
            servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            servo.set_to_position(kp=KP, kv=KD)
            servo.forcelimited, servo.forcerange = True, [-300, 300]
        self.mujoco, self.model = mujoco, spec.compile()
        self.data = mujoco.MjData(self.model)

    def turn(self, seconds: float) -> float:
        """CPU time of a step [us]."""
        mujoco, steps = self.mujoco, round(seconds / DT)
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = START
        size = mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        state = np.zeros((1, size))
        mujoco.mj_getState(self.model, self.data, state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        control = np.broadcast_to(GOAL, (1, steps, 7)).copy()
        start = time.process_time()
        mujoco.rollout.rollout(self.model, self.data, state, control, nstep=steps)
        spent = time.process_time() - start
        assert abs(self.data.qpos - GOAL).max() < 0.5
        return spent / steps * 1e6


def humanoid_sheldrake(states: np.ndarray) -> Callable[[], float]:
    """Forward dynamics from positions, velocities and forces, all stages, in our compiled loop."""
    from benchmarks._loop import repeat_forward_dynamics

    import sheldrake.all as lib
    from sheldrake.multibody.tree._kernels.model import make_work

    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(humanoid_urdf(), "urdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    view = plant._parts.contexts.view(context)
    assert plant.num_velocities() == 35
    q, v, tau, vdot = np.zeros(36), np.zeros(35), np.zeros(35), np.zeros(35)
    call = repeat_forward_dynamics.bind(view.model, view.p.copy(), make_work(view.model), states, q, v, tau, vdot)

    def turn() -> float:
        start = time.process_time()
        assert call() == 0
        return (time.process_time() - start) / len(states) * 1e6

    return turn


def humanoid_mujoco(states: np.ndarray) -> Callable[[], float]:
    """MuJoCo's smooth forward dynamics; a loop of Python around its C functions, whose calls are taken off."""
    import mujoco as mj

    spec = mj.MjSpec.from_string(humanoid_urdf())
    spec.body("pelvis").add_freejoint()
    model = spec.compile()
    data = mj.MjData(model)
    rows = [(s[[4, 5, 6, 0, 1, 2, 3]], s[7:36], np.roll(s[36:71], -3)) for s in states]

    def loop(work: Callable[[], Any]) -> float:
        start = time.process_time()
        for base, joints, v in rows:
            data.qpos[:7], data.qpos[7:], data.qvel[:] = base, joints, v
            work()
        return (time.process_time() - start) / len(rows) * 1e6

    def smooth() -> None:
        mj.mj_fwdPosition(model, data)
        mj.mj_fwdVelocity(model, data)
        mj.mj_fwdAcceleration(model, data)

    return lambda: loop(smooth) - loop(lambda: None)


PINOCCHIO = r"""
#include <chrono>
#include <fstream>
#include <iostream>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/serialization.hpp>
int main(int, char** file) {
  pinocchio::Model model;
  pinocchio::serialization::loadFromText(model, file[1]);
  pinocchio::Data data(model);
  Eigen::MatrixXd x(std::stol(file[3]), 106);
  std::ifstream in(file[2], std::ios::binary);
  Eigen::VectorXd row(106);
  for (long i = 0; i < x.rows(); ++i) {
    in.read(reinterpret_cast<char*>(row.data()), 106 * sizeof(double));
    x.row(i) = row;
  }
  Eigen::VectorXd q(36), v(35), tau(35);
  double sum = 0.0;
  for (std::string line; std::getline(std::cin, line);) {
    const auto start = std::chrono::steady_clock::now();
    for (long i = 0; i < x.rows(); ++i) {
      q = x.row(i).head(36); v = x.row(i).segment(36, 35); tau = x.row(i).tail(35);
      sum += pinocchio::aba(model, data, q, v, tau)[0];
    }
    const std::chrono::duration<double, std::micro> spent = std::chrono::steady_clock::now() - start;
    std::cout << spent.count() / x.rows() << " " << sum << std::endl;
  }
}
"""


def humanoid_pinocchio(states: np.ndarray) -> Callable[[], float]:
    """Pinocchio's `aba` in a C++ loop, compiled here with g++ against the headers of the `pin` package."""
    import pinocchio

    prefix = next(p for p in pathlib.Path(pinocchio.__file__).parents if p.name == "cmeel.prefix")
    folder = pathlib.Path(tempfile.mkdtemp())
    (folder / "aba.cpp").write_text(PINOCCHIO)
    model = pinocchio.buildModelFromXML(humanoid_urdf(), pinocchio.JointModelFreeFlyer())
    model.saveToText(str(folder / "humanoid"))
    turned = states.copy()
    turned[:, :7] = states[:, [4, 5, 6, 1, 2, 3, 0]]
    turned.tofile(folder / "states")
    command = ["g++", "-O3", "-march=native", "-DNDEBUG", "-std=c++17", f"-I{prefix}/include"]
    command += ["-DBOOST_MPL_LIMIT_LIST_SIZE=40", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS"]
    command += [f"-I{prefix}/include/eigen3", "-o", str(folder / "aba"), str(folder / "aba.cpp")]
    command += [f"-L{prefix}/lib", f"-Wl,-rpath,{prefix}/lib", "-lpinocchio_default", "-lboost_serialization"]
    subprocess.run(command, check=True)
    arguments = [str(folder / name) for name in ("aba", "humanoid", "states")]
    process = subprocess.Popen(
        [*arguments, str(len(states))], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )

    def turn() -> float:
        process.stdin.write("again\n")
        process.stdin.flush()
        return float(process.stdout.readline().split()[0])

    return turn


def found(makers: dict[str, Callable[[], Any]]) -> dict[str, Any]:
    """Those that are installed."""
    made = {}
    for name, make in makers.items():
        try:
            made[name] = make()
        except ImportError as error:
            print(f"without {name}: {error}")
    return made


def show(title: str, times: dict[str, list[float]]) -> None:
    print(f"\n{title:34s}{'median':>9s}{'min':>9s}{'max':>9s}    others / {OURS}")
    for name, t in times.items():
        other = "" if name == OURS else ratio(times, name, OURS)
        print(f"{name:34s}{statistics.median(t):9.3f}{min(t):9.3f}{max(t):9.3f}    {other}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--evaluations", type=int, default=20_000)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(machine())
    for title, motors in (("arm, motors [us a step]", True), ("arm, PidController [us a step]", False)):
        makers: dict[str, Callable[[], Any]] = {
            OURS: lambda m=motors: DrakeLike("sheldrake", m),
            "Drake": lambda m=motors: DrakeLike("pydrake", m),
            "MuJoCo": MuJoCo,
        }
        turns = {name: (lambda c=c: c.turn(options.seconds)) for name, c in found(makers).items()}
        show(title, take_turns(turns, options.rounds))

    states = np.random.default_rng(1).normal(size=(options.evaluations, 36 + 35 + 35))
    states[:, :4] /= np.linalg.norm(states[:, :4], axis=1)[:, None]
    makers = {
        OURS: lambda: humanoid_sheldrake(states),
        "Pinocchio aba": lambda: humanoid_pinocchio(states),
        "MuJoCo": lambda: humanoid_mujoco(states),
    }
    show("humanoid forward dynamics [us]", take_turns(found(makers), options.rounds))


if __name__ == "__main__":
    main()
