"""Real robots in Pinocchio and here: where links are, mass matrix, inverse dynamics, Jacobians, at random states."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from real_robots import robot_files

pin = pytest.importorskip("pinocchio")
pytestmark = pytest.mark.peer

from sheldrake.multibody.parsing import ParseError, Parser  # noqa: E402
from sheldrake.multibody.plant import MultibodyPlant  # noqa: E402
from sheldrake.multibody.tree import JacobianWrtVariable, MultibodyForces  # noqa: E402

TOLERANCE = 1e-12  # of the largest entry: recursions in another order
FILES = robot_files("urdf")


class Messages(logging.Handler):
    """What the parser says while this is entered."""

    def __init__(self):
        super().__init__()
        self.lines, self.log = [], logging.getLogger("drake")

    def emit(self, record):
        self.lines.append(record.getMessage())

    def __enter__(self):
        self.before = self.log.level, self.log.propagate
        self.log.setLevel(logging.WARNING)
        self.log.propagate = False
        self.log.addHandler(self)

    def __exit__(self, *error):
        self.log.removeHandler(self)
        self.log.level, self.log.propagate = self.before


class Robot:
    """A robot in both libraries."""

    def __init__(self, path):
        plant, messages = MultibodyPlant(0.0), Messages()
        with messages:
            Parser(plant).AddModels(str(path))
        plant.Finalize()
        self.has_its_own_inertias = not any("inertia" in line for line in messages.lines)
        self.plant, self.context = plant, plant.CreateDefaultContext()
        self.floating = bool(plant.GetFloatingBaseBodies())
        arguments = [str(path), *([pin.JointModelFreeFlyer()] if self.floating else [])]
        self.model = pin.buildModelFromUrdf(*arguments)
        self.data = self.model.createData()
        names = {joint.name(): joint for joint in map(plant.get_joint, plant.GetJointIndices())}
        self.pairs = [(names[n], j) for j, n in enumerate(self.model.names) if j > self.floating]

    def set_state(self, rng):
        """The same random positions and velocities in both; returns those of Pinocchio and the matrix from our v."""
        plant, model = self.plant, self.model
        q, v = np.zeros(plant.num_positions()), rng.normal(size=plant.num_velocities())
        pin_q, T = np.zeros(model.nq), np.zeros((model.nv, plant.num_velocities()))
        R = np.eye(3)
        if self.floating:
            body = plant.get_body(next(iter(plant.GetFloatingBaseBodies())))
            start, turn, place = body.floating_positions_start(), rng.normal(size=4), rng.normal(size=3)
            turn /= np.linalg.norm(turn)
            q[start : start + 4], q[start + 4 : start + 7] = turn, place
            pin_q[:3], pin_q[3:7] = place, turn[[1, 2, 3, 0]]
            plant.SetPositions(self.context, q)
            R = body.EvalPoseInWorld(self.context).rotation().matrix()
            at = body.floating_velocities_start_in_v()
            T[:3, at + 3 : at + 6], T[3:6, at : at + 3] = R.T, R.T
        for joint, j in self.pairs:
            angle, i = rng.normal(), model.joints[j].idx_q
            q[joint.position_start()] = angle
            T[model.joints[j].idx_v, joint.velocity_start()] = 1.0
            pin_q[i : i + model.joints[j].nq] = angle if model.joints[j].nq == 1 else (np.cos(angle), np.sin(angle))
        plant.SetPositions(self.context, q)
        plant.SetVelocities(self.context, v)
        return pin_q, T @ v, T

    def dynamics(self, q, v, T, vdot):
        """(ours, theirs) by name: forces and inertia."""
        plant, model, data, context = self.plant, self.model, self.data, self.context
        gravity = pin.computeGeneralizedGravity(model, data, q)
        a = [T @ vdot, np.zeros(model.nv)]
        if self.floating:  # Pinocchio's velocity of the base is expressed in a frame that turns
            for acceleration in a:
                acceleration[:3] -= np.cross(v[3:6], v[:3])
        M = np.triu(pin.crba(model, data, q))
        forces = [T.T @ (pin.rnea(model, data, q, v, acceleration) - gravity) for acceleration in a]
        return {
            "gravity": (plant.CalcGravityGeneralizedForces(context), -T.T @ gravity),
            "mass matrix": (plant.CalcMassMatrix(context), T.T @ (M + np.triu(M, 1).T) @ T),
            "inverse dynamics": (plant.CalcInverseDynamics(context, vdot, MultibodyForces(plant)), forces[0]),
            "bias": (plant.CalcBiasTerm(context), forces[1]),
        }

    def kinematics(self, q, v, T):
        """(ours, theirs) by name: poses and Jacobians of all links."""
        plant, model, data, context = self.plant, self.model, self.data, self.context
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        result, W = {}, plant.world_frame()
        for frame, name in ((i, f.name) for i, f in enumerate(model.frames) if f.type == pin.FrameType.BODY):
            if name == "universe" or plant.GetBodyByName(name).index() == 0:
                continue
            body = plant.GetBodyByName(name)
            J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED) @ T
            J_ours = plant.CalcJacobianSpatialVelocity(
                context, JacobianWrtVariable.kV, body.body_frame(), np.zeros(3), W, W
            )
            result[f"pose of {name}"] = body.EvalPoseInWorld(context).GetAsMatrix4(), data.oMf[frame].homogeneous
            result[f"Jacobian of {name}"] = J_ours, np.vstack([J[3:], J[:3]])
        return result

    def difference(self, rng):
        """(name, size) of the largest difference at a random state, relative to the quantity's largest entry."""
        q, v, T = self.set_state(rng)
        compared = self.kinematics(q, v, T)
        if self.has_its_own_inertias:
            compared |= self.dynamics(q, v, T, rng.normal(size=self.plant.num_velocities()))
        sizes = {name: np.abs(a - b).max() / max(1.0, np.abs(b).max()) for name, (a, b) in compared.items()}
        return max(sizes.items(), key=lambda pair: pair[1])


def robot_or_none(path):
    """None where one of the two refuses the file."""
    try:
        return Robot(path)
    except (ParseError, ValueError):
        return None


@pytest.mark.skipif(not FILES, reason="example-robot-data is not installed")
def test_most_robots_are_compared():
    robots = [robot for path in FILES if (robot := robot_or_none(path)) is not None]
    assert len(robots) >= 0.9 * len(FILES)
    assert sum(robot.has_its_own_inertias for robot in robots) >= 0.7 * len(FILES)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_kinematics_and_dynamics_equal_pinocchios(path):
    robot = robot_or_none(path)
    if robot is not None:
        rng = np.random.default_rng(5)
        name, size = max((robot.difference(rng) for _ in range(20)), key=lambda pair: pair[1])
        assert size < TOLERANCE, name


@pytest.mark.skipif(not FILES, reason="example-robot-data is not installed")
def test_a_fault_of_one_part_in_a_hundred_million_is_seen():
    robot = Robot(next(path for path in FILES if path.name == "panda.urdf"))
    rng = np.random.default_rng(5)
    assert robot.has_its_own_inertias and robot.difference(rng)[1] < TOLERANCE
    robot.model.inertias[3].mass *= 1.0 + 1e-8
    assert robot.difference(rng)[1] > 1e-10
