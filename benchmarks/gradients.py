"""Derivatives of a plant's motion against Drake: CPU time of AutoDiffXd, a seven-joint arm, all 21 of x and u.

    python benchmarks/gradients.py [--rounds 9] [--calls 50]

"derivatives": time derivatives of the state; "step": the next state of a discrete plant; "Linearize": all of it, from
the plant of numbers; "collocation": all constraints of a trajectory optimization of five samples. The rest are queries
of the plant of duals at new positions and velocities.
"""

from __future__ import annotations

import argparse
import importlib
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

OURS, DRAKE = "sheldrake", "pydrake"


def calls(package: str) -> dict[str, Callable[[np.ndarray], Any]]:
    """What is timed, by title, as functions of x and u in one vector."""
    lib = importlib.import_module(f"{package}.all")
    return {
        "derivatives": motion(lib, 0.0),
        "step": motion(lib, 1e-3),
        "Linearize": linear_model(lib),
        **queries(lib),
        "collocation": collocation(lib),
    }


def arm(lib: Any, time_step: float) -> Any:
    plant = lib.MultibodyPlant(time_step)
    lib.Parser(plant).AddModelsFromString(arm_urdf(), "urdf")
    if time_step:
        plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    return plant


def motion(lib: Any, time_step: float) -> Callable[[np.ndarray], Any]:
    """Derivatives of the motion by duals."""
    plant = arm(lib, time_step).ToAutoDiffXd()
    context = plant.CreateDefaultContext()

    def gradient(z: np.ndarray) -> np.ndarray:
        duals = lib.InitializeAutoDiff(z).ravel()
        plant.get_actuation_input_port().FixValue(context, duals[14:])
        if time_step:
            context.SetDiscreteState(duals[:14])
            found = plant.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0)
        else:
            context.SetContinuousState(duals[:14])
            found = plant.EvalTimeDerivatives(context)
        return lib.ExtractGradient(found.CopyToVector())

    return gradient


def queries(lib: Any) -> dict[str, Callable[[np.ndarray], Any]]:
    """What optimizations ask of a plant of duals."""
    plant = arm(lib, 0.0).ToAutoDiffXd()
    context = plant.CreateDefaultContext()
    world, tip = plant.world_frame(), plant.GetBodyByName("link7").body_frame()
    forces, wrt = lib.MultibodyForces_[lib.AutoDiffXd](plant), lib.JacobianWrtVariable.kV

    def at(ask: Callable[[np.ndarray], Any]) -> Callable[[np.ndarray], Any]:
        def query(z: np.ndarray) -> Any:
            duals = lib.InitializeAutoDiff(z).ravel()
            plant.SetPositionsAndVelocities(context, duals[:14])
            return ask(duals)

        return query

    return {
        "mass matrix": at(lambda duals: plant.CalcMassMatrix(context)),
        "gravity": at(lambda duals: plant.CalcGravityGeneralizedForces(context)),
        "inverse dynamics": at(lambda duals: plant.CalcInverseDynamics(context, duals[14:], forces)),
        "velocity of the tip": at(lambda duals: plant.EvalBodySpatialVelocityInWorld(context, tip.body())),
        "acceleration": at(lambda duals: plant.EvalBodySpatialAccelerationInWorld(context, tip.body())),
        "centre of mass": at(lambda duals: plant.CalcCenterOfMassPositionInWorld(context)),
        "its Jacobian": at(
            lambda duals: plant.CalcJacobianCenterOfMassTranslationalVelocity(context, wrt, world, world)
        ),
        "kinetic energy": at(lambda duals: plant.CalcKineticEnergy(context)),
        "pose of the tip": at(lambda duals: plant.CalcRelativeTransform(context, world, tip)),
        "Jacobian of the tip": at(
            lambda duals: plant.CalcJacobianSpatialVelocity(context, wrt, tip, np.zeros(3), world, world)
        ),
    }


def collocation(lib: Any) -> Callable[[np.ndarray], Any]:
    """All constraints of a direct collocation of five samples, each by its own variables."""
    plant = arm(lib, 0.0)
    port = plant.get_actuation_input_port().get_index()
    trajectory = lib.DirectCollocation(
        plant, plant.CreateDefaultContext(), 5, 0.05, 0.2, port, assume_non_continuous_states_are_fixed=True
    )
    prog = trajectory.prog()
    parts = [(b.evaluator(), prog.FindDecisionVariableIndices(b.variables())) for b in prog.GetAllConstraints()]

    def constraints(z: np.ndarray) -> Any:
        everything = 0.1 + 0.05 * np.resize(z, prog.num_vars())
        return [evaluator.Eval(lib.InitializeAutoDiff(everything[places]).ravel()) for evaluator, places in parts]

    return constraints


def linear_model(lib: Any) -> Callable[[np.ndarray], Any]:
    """The linear model about a state, which need not be an equilibrium."""
    plant = arm(lib, 0.0)
    context = plant.CreateDefaultContext()
    port, none = plant.get_actuation_input_port().get_index(), lib.OutputPortSelection.kNoOutput

    def model(z: np.ndarray) -> Any:
        context.SetContinuousState(z[:14])
        plant.get_actuation_input_port().FixValue(context, z[14:])
        return lib.FirstOrderTaylorApproximation(plant, context, port, none).A()

    return model


def main() -> None:
    """Prints the table; the machine code on complex numbers is made first."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--calls", type=int, default=50)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    from sheldrake.autodiffutils import _complex_step

    _complex_step.PATIENCE = 0
    found = {OURS: calls(OURS)}
    try:
        found[DRAKE] = calls(DRAKE)
    except ImportError as error:
        print(f"without Drake: {error}")
    print(machine())
    states = list(np.random.default_rng(1).uniform(-1.0, 1.0, (options.calls, 21)))
    print(f"{'us (CPU)':20s}" + "".join(f"{name:>12s}" for name in found) + f"{'Drake/ours':>20s}")
    for title in found[OURS]:
        turns = {name: (lambda call=c[title]: cpu_time(call, states)) for name, c in found.items()}
        times = take_turns(turns, options.rounds)
        medians = "".join(f"{statistics.median(times[name]):12.0f}" for name in found)
        print(f"{title:20s}{medians}{ratio(times, DRAKE, OURS):>20s}", flush=True)


if __name__ == "__main__":
    main()
