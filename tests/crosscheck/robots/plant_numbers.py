"""What is compared of two plants that were made from the same file, and how."""

from __future__ import annotations

import importlib
import pathlib
from typing import Any

import numpy as np

MODELS = pathlib.Path(__file__).parents[2] / "models" / "parsing"
EPSILON = np.finfo(float).eps


def load(library: str, path: pathlib.Path, time_step: float) -> Any:
    """A finalized plant of `sheldrake` or `pydrake` without geometry."""
    plant = importlib.import_module(f"{library}.multibody.plant").MultibodyPlant(time_step)
    parser = importlib.import_module(f"{library}.multibody.parsing").Parser(plant)
    parser.package_map().Add("parsing", str(MODELS))
    parser.AddModels(str(path))
    plant.Finalize()
    return plant


def _tree_of(plant: Any) -> Any:
    """The module `multibody.tree` of the plant's library."""
    return importlib.import_module(type(plant).__module__.split(".")[0] + ".multibody.tree")


def names(plant: Any) -> list[str]:
    """Names and order of all that is counted."""
    indices = range(plant.num_bodies()), plant.GetJointIndices(), range(plant.num_frames())
    tree = _tree_of(plant)
    bodies = [plant.get_body(tree.BodyIndex(i)).scoped_name().get_full() for i in indices[0]]
    joints = [plant.get_joint(i).name() for i in indices[1]]
    frames = [plant.get_frame(tree.FrameIndex(i)).scoped_name().get_full() for i in indices[2]]
    states = [*plant.GetPositionNames(), *plant.GetVelocityNames(), *plant.GetActuatorNames()]
    return [*bodies, "joints", *joints, "frames", *frames, "state", *states]


def fixed_numbers(plant: Any) -> dict[str, np.ndarray]:
    """What does not depend on the state."""
    context = plant.CreateDefaultContext()
    return {
        "default positions": plant.GetPositions(context).copy(),
        "position limits": np.array([plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()]),
        "velocity limits": np.array([plant.GetVelocityLowerLimits(), plant.GetVelocityUpperLimits()]),
        "acceleration limits": np.array([plant.GetAccelerationLowerLimits(), plant.GetAccelerationUpperLimits()]),
        "effort limits": np.array([plant.GetEffortLowerLimits(), plant.GetEffortUpperLimits()]),
        "mass": np.array([plant.CalcTotalMass(context)]),
        "selector": np.asarray(plant.MakeActuationMatrix()),
    }


def numbers(plant: Any, states: int = 20) -> dict[str, np.ndarray]:
    """Everything compared, by name: fixed numbers and the model quantities at random states."""
    tree = _tree_of(plant)
    context, result = plant.CreateDefaultContext(), fixed_numbers(plant)
    nq, nv, W = plant.num_positions(), plant.num_velocities(), plant.world_frame()
    rng = np.random.default_rng(3)
    bodies = [plant.get_body(tree.BodyIndex(i)) for i in range(plant.num_bodies())]
    elements = [plant.get_force_element(tree.ForceElementIndex(i)) for i in range(plant.num_force_elements())]
    has_bushings = any("Bushing" in type(element).__name__ for element in elements)
    has_mass = plant.CalcTotalMass(context) > 0.0
    for state in range(states if nv else 0):
        q, v, vdot, point = (rng.normal(size=n) for n in (nq, nv, nv, 3))
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        found = {
            "mass matrix": plant.CalcMassMatrixViaInverseDynamics(context),
            "mass matrix, composite bodies": plant.CalcMassMatrix(context),
            "bias": plant.CalcBiasTerm(context),
            "gravity": plant.CalcGravityGeneralizedForces(context),
            "inverse dynamics": plant.CalcInverseDynamics(context, vdot, tree.MultibodyForces(plant)),
            "poses": np.array([plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34() for body in bodies]),
            "qdot": plant.MapVelocityToQDot(context, v),
            "kinetic energy": np.array([plant.CalcKineticEnergy(context)]),
        }
        if not has_bushings:  # Drake has no energy for them
            found["potential energy"] = np.array([plant.CalcPotentialEnergy(context)])
        for body in (bodies[-1], bodies[int(rng.integers(len(bodies)))]):
            B = body.body_frame()
            wrt = tree.JacobianWrtVariable.kV
            found[f"Jacobian of {body.name()}"] = plant.CalcJacobianSpatialVelocity(context, wrt, B, point, W, W)
            found[f"bias acceleration of {body.name()}"] = plant.CalcBiasSpatialAcceleration(
                context, wrt, B, point, W, W
            ).get_coeffs()
        if has_mass:
            found["centre of mass"] = plant.CalcCenterOfMassPositionInWorld(context)
            found["velocity of the centre of mass"] = plant.CalcCenterOfMassTranslationalVelocityInWorld(context)
        result.update({f"{name}, state {state}": value for name, value in found.items()})
    return result


def forward_dynamics(plant: Any, states: int = 20) -> list[tuple[np.ndarray, float]]:
    """(vdot, what numbers of 1e-16 in M do to it) of a continuous plant at random states."""
    context = plant.CreateDefaultContext()
    nq, nv = plant.num_positions(), plant.num_velocities()
    rng, result = np.random.default_rng(4), []
    for _ in range(states):
        plant.SetPositions(context, rng.normal(size=nq))
        plant.SetVelocities(context, rng.normal(size=nv))
        plant.get_actuation_input_port().FixValue(context, rng.normal(size=plant.num_actuated_dofs()))
        plant.get_applied_generalized_force_input_port().FixValue(context, rng.normal(size=nv))
        vdot = plant.EvalTimeDerivatives(context).CopyToVector()[nq:]
        result.append((vdot, 20.0 * EPSILON * float(np.linalg.cond(plant.CalcMassMatrix(context)))))
    return result


def worst(theirs: dict[str, np.ndarray], ours: dict[str, np.ndarray]) -> tuple[str, float]:
    """The quantity that differs most, and by how much relative to its largest entry."""
    assert theirs.keys() == ours.keys()
    errors = {"(nothing)": 0.0}
    for name, expected in theirs.items():
        finite = np.isfinite(expected)
        assert expected.shape == ours[name].shape, name
        assert np.array_equal(np.where(finite, 0.0, expected), np.where(np.isfinite(ours[name]), 0.0, ours[name])), name
        scale = max(1.0, np.max(np.abs(expected[finite]), initial=0.0))
        errors[name] = np.max(np.abs(expected[finite] - ours[name][finite]), initial=0.0) / scale
    name = max(errors, key=errors.__getitem__)
    return name, errors[name]
