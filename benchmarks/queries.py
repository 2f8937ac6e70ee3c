"""Queries from Python against Drake and MuJoCo: CPU time of setting positions and asking, a seven-joint arm.

    python benchmarks/queries.py [--rounds 9] [--calls 4000]

Every call sets new positions first (and velocities where the query needs them), so that nothing is answered from a
cache. MuJoCo runs the stages that the query needs and no more; its answers are copied, as the others' are.
"""

from __future__ import annotations

import argparse
import pathlib
import statistics
import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.robots import arm_urdf  # noqa: E402
from benchmarks.turns import cpu_time, machine, ratio, take_turns  # noqa: E402

Calls = dict[str, Callable[[np.ndarray], Any]]
OURS = "sheldrake"


def drake_like(package: str) -> Calls:
    """The queries in sheldrake or pydrake, by title."""
    import importlib

    all_names = importlib.import_module(f"{package}.all")
    plant = all_names.MultibodyPlant(0.0)
    all_names.Parser(plant).AddModelsFromString(arm_urdf(), "urdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    hand, world = plant.GetBodyByName("link7"), plant.world_frame()
    frame, wrt = hand.body_frame(), all_names.JacobianWrtVariable.kV
    plant.SetVelocities(context, np.linspace(-1.0, 1.0, 7))
    vdot, point, forces = np.linspace(1.0, 2.0, 7), np.array([0.01, 0.02, 0.03]), all_names.MultibodyForces(plant)

    def set_positions(q):
        plant.SetPositions(context, q)

    def mass_matrix(q):
        plant.SetPositions(context, q)
        return plant.CalcMassMatrix(context)

    def bias(q):
        plant.SetPositions(context, q)
        return plant.CalcBiasTerm(context)

    def gravity(q):
        plant.SetPositions(context, q)
        return plant.CalcGravityGeneralizedForces(context)

    def forward_kinematics(q):
        plant.SetPositions(context, q)
        return plant.EvalBodyPoseInWorld(context, hand)

    def jacobian(q):
        plant.SetPositions(context, q)
        return plant.CalcJacobianSpatialVelocity(context, wrt, frame, point, world, world)

    def inverse_dynamics(q):
        plant.SetPositions(context, q)
        return plant.CalcInverseDynamics(context, vdot, forces)

    def centre_of_mass(q):
        plant.SetPositions(context, q)
        return plant.CalcCenterOfMassPositionInWorld(context)

    return {
        "set positions": set_positions,
        "mass matrix": mass_matrix,
        "bias": bias,
        "gravity": gravity,
        "forward kinematics": forward_kinematics,
        "Jacobian": jacobian,
        "inverse dynamics": inverse_dynamics,
        "centre of mass": centre_of_mass,
    }


def mujoco_calls() -> Calls:
    """The same queries in MuJoCo."""
    import mujoco as mj

    compiler = '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco>'
    model = mj.MjModel.from_xml_string(arm_urdf().replace('<robot name="arm">', f'<robot name="arm">{compiler}'))
    data = mj.MjData(model)
    data.qvel[:] = np.linspace(-1.0, 1.0, 7)
    data.qacc[:] = np.linspace(1.0, 2.0, 7)
    qpos, xpos, xquat = data.qpos, data.xpos, data.xquat
    hand, M, J, tau = model.body("link7").id, np.zeros((7, 7)), np.zeros((6, 7)), np.zeros(7)
    J_v, J_w, subtree_com = J[3:], J[:3], data.subtree_com

    def kinematics(q):
        qpos[:] = q
        mj.mj_kinematics(model, data)
        mj.mj_comPos(model, data)

    def set_positions(q):
        qpos[:] = q

    def mass_matrix(q):
        kinematics(q)
        mj.mj_crb(model, data)
        mj.mj_fullM(model, data, M)
        return M.copy()

    def bias(q):
        kinematics(q)
        mj.mj_comVel(model, data)
        mj.mj_rne(model, data, 0, tau)
        return tau.copy()

    def gravity(q):
        kinematics(q)
        mj.mj_rne(model, data, 0, tau)
        return tau.copy()

    def forward_kinematics(q):
        qpos[:] = q
        mj.mj_kinematics(model, data)
        return xpos[hand].copy(), xquat[hand].copy()

    def jacobian(q):
        kinematics(q)
        mj.mj_jacBody(model, data, J_v, J_w, hand)
        return J.copy()

    def inverse_dynamics(q):
        kinematics(q)
        mj.mj_comVel(model, data)
        mj.mj_rne(model, data, 1, tau)
        return tau.copy()

    def centre_of_mass(q):
        kinematics(q)
        return subtree_com[0].copy()

    return {
        "set positions": set_positions,
        "mass matrix": mass_matrix,
        "bias": bias,
        "gravity": gravity,
        "forward kinematics": forward_kinematics,
        "Jacobian": jacobian,
        "inverse dynamics": inverse_dynamics,
        "centre of mass": centre_of_mass,
    }


def contenders() -> dict[str, Calls]:
    """All who are installed."""
    found = {OURS: drake_like("sheldrake")}
    for name, make in (("Drake", lambda: drake_like("pydrake")), ("MuJoCo", mujoco_calls)):
        try:
            found[name] = make()
        except ImportError as error:
            print(f"without {name}: {error}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--calls", type=int, default=4000)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(machine())
    found = contenders()
    positions = list(np.random.default_rng(1).uniform(-2.0, 2.0, (options.calls, 7)))
    rivals = [name for name in found if name != OURS]
    print(
        f"{'us a query (CPU)':22s}"
        + "".join(f"{n:>11s}" for n in found)
        + "".join(f"{n + '/ours':>20s}" for n in rivals)
    )
    for query in found[OURS]:
        turns = {name: (lambda call=calls[query]: cpu_time(call, positions)) for name, calls in found.items()}
        times = take_turns(turns, options.rounds)
        medians = "".join(f"{statistics.median(times[name]):11.2f}" for name in found)
        print(f"{query:22s}{medians}" + "".join(f"{ratio(times, rival, OURS):>20s}" for rival in rivals), flush=True)


if __name__ == "__main__":
    main()
