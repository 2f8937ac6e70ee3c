"""Limits, PD actuators and holonomic constraints as scalar rows, against one step of Drake."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("pydrake")

from drake_problem import DrakeProblem, approximation, one_step

from sheldrake.multibody.contact_solvers._kernels.problem import ACTUATOR, HOLONOMIC, LIMIT

pytestmark = pytest.mark.peer

INF = np.inf


def mechanism(dt, effort=(INF, INF, INF), gains=None, constraints=(), distance_spring=(INF, 0.0), name="lagged"):
    """Three revolute links, a slider with springs, three free bodies."""
    from pydrake.math import RigidTransform, RollPitchYaw
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.multibody.tree import (
        FixedOffsetFrame,
        LinearSpringDamper,
        PdControllerGains,
        PrismaticJoint,
        PrismaticSpring,
        RevoluteJoint,
        RevoluteSpring,
        RotationalInertia,
        SpatialInertia,
    )
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, dt)
    plant.set_discrete_contact_approximation(approximation(name))
    instance = plant.AddModelInstance("m")
    world = plant.world_body()
    links, joints, parent = [], [], world.body_frame()
    for i in range(3):
        inertia = SpatialInertia.MakeFromCentralInertia(1.0 + i, [0, 0, -0.2], RotationalInertia(0.02, 0.03, 0.01))
        link = plant.AddRigidBody(f"link{i}", instance, inertia)
        axis = [[0, 1, 0], [1, 0, 0], [0, 1, 0]][i]
        lower, upper = [(-1.0, 0.5), (-INF, 0.6), (-1.0, INF)][i]
        joint = RevoluteJoint(f"j{i}", parent, link.body_frame(), axis, lower, upper, 0.1 * (i + 1))
        joints.append(plant.AddJoint(joint))
        links.append(link)
        parent = plant.AddFrame(FixedOffsetFrame(f"end{i}", link, RigidTransform([0, 0, -0.4])))
    slider = plant.AddRigidBody("slider", instance, SpatialInertia.SolidBoxWithMass(0.7, 0.2, 0.06, 0.04))
    joints.append(plant.AddJoint(PrismaticJoint("js", world.body_frame(), slider.body_frame(), [1, 0, 0], -2, 2, 0.7)))
    inertia = RotationalInertia(0.01, 0.02, 0.015, 0.001, -0.002, 0.0005)
    A = plant.AddRigidBody("A", instance, SpatialInertia.MakeFromCentralInertia(1.3, [0.02, -0.03, 0.01], inertia))
    B = plant.AddRigidBody("B", instance, SpatialInertia.SolidBoxWithMass(0.5, 0.2, 0.06, 0.04))
    C = plant.AddRigidBody("C", instance, SpatialInertia.SolidBoxWithMass(0.4, 0.1, 0.03, 0.02))
    actuators = []
    for n, i in enumerate((0, 1, 3)):
        actuator = plant.AddJointActuator(f"a{i}", joints[i], effort[n])
        actuator.set_default_rotor_inertia(0.01 * (i + 1))
        actuator.set_default_gear_ratio(3.0 + i)
        if gains and gains[n]:
            actuator.set_controller_gains(PdControllerGains(p=gains[n][0], d=gains[n][1]))
        actuators.append(actuator)
    plant.AddForceElement(RevoluteSpring(joints[2], 0.3, 4.0))
    plant.AddForceElement(PrismaticSpring(joints[3], 0.1, 50.0))
    plant.AddForceElement(LinearSpringDamper(A, [0.1, 0, 0], C, [0, 0, 0.1], 0.3, 30.0, 2.0))
    X_BP, X_CQ = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0, 0, 0.1]), RigidTransform([0.05, 0, 0])
    if "coupler" in constraints:
        plant.AddCouplerConstraint(joints[1], joints[3], 1.7, 0.05)
    if "distance" in constraints:
        plant.AddDistanceConstraint(links[2], [0, 0, -0.4], A, [0.1, 0.05, 0], 0.25, *distance_spring)
    if "ball" in constraints:
        plant.AddBallConstraint(A, [0, 0.1, 0], B, [0.1, 0, 0])
    if "weld" in constraints:
        plant.AddWeldConstraint(B, X_BP, C, X_CQ)
    plant.Finalize()
    return SimpleNamespace(
        plant=plant, diagram=builder.Build(), links=links, joints=joints, actuators=actuators, A=A, B=B, C=C,
        X_BP=X_BP, X_CQ=X_CQ, constraints=constraints, distance_spring=distance_spring, instance=instance,
    )  # fmt: skip


def add_limits(m, problem):
    plant, dt = m.plant, m.plant.time_step()
    for joint in m.joints:
        k, q = joint.velocity_start(), joint.GetOnePosition(problem.context)
        lower, upper = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        reach = 2 * dt * max(abs(problem.v0[k]), abs(problem.v_star[k]))
        for gap, sign in ((q - lower, 1.0), (upper - q, -1.0)):
            if gap <= reach:
                row = np.zeros(plant.num_velocities())
                row[k] = sign
                numbers = {"gap": gap, "stiffness": 1e12, "relaxation": dt, "upper": INF}
                problem.add_rows(row, LIMIT, **numbers)


def add_actuators(m, problem, u, desired):
    for n, actuator in enumerate(m.actuators):
        if actuator.has_controller():
            k = actuator.joint().velocity_start()
            row = np.zeros(m.plant.num_velocities())
            row[k] = 1.0
            dt, effort = m.plant.time_step(), actuator.effort_limit()
            gap = actuator.joint().GetOnePosition(problem.context) - desired[0][n]
            gains = actuator.get_controller_gains()
            problem.add_rows(
                row, ACTUATOR, lower=-dt * effort, upper=dt * effort, gap=gap,
                stiffness=gains.p, relaxation=gains.d, rate=desired[1][n], forward=u[n],
            )  # fmt: skip


def add_holonomic(m, problem):
    from pydrake.multibody.tree import JacobianWrtVariable

    plant, context, W = m.plant, problem.context, m.plant.world_frame()
    kV = JacobianWrtVariable.kV
    both = {"lower": -INF, "upper": INF}

    def point(body, p):
        J = plant.CalcJacobianTranslationalVelocity(context, kV, body.body_frame(), p, W, W)
        return plant.EvalBodyPoseInWorld(context, body) @ np.array(p), J

    if "coupler" in m.constraints:
        a, b = m.joints[1], m.joints[3]
        row = np.zeros(plant.num_velocities())
        row[a.velocity_start()], row[b.velocity_start()] = 1.0, -1.7
        gap = a.GetOnePosition(context) - 1.7 * b.GetOnePosition(context) - 0.05
        problem.add_rows(row, HOLONOMIC, gap=gap, stiffness=INF, **both)
    if "distance" in m.constraints:
        (p, J_p), (q, J_q) = point(m.links[2], [0, 0, -0.4]), point(m.A, [0.1, 0.05, 0])
        length, (k, c) = np.linalg.norm(q - p), m.distance_spring
        row = (q - p) / length @ (J_q - J_p)
        numbers = {"gap": length - 0.25, "stiffness": k, "relaxation": c / k}
        problem.add_rows(row, HOLONOMIC, **numbers, **both)
    if "ball" in m.constraints:
        (p, J_p), (q, J_q) = point(m.A, [0, 0.1, 0]), point(m.B, [0.1, 0, 0])
        problem.add_rows(J_q - J_p, HOLONOMIC, gap=q - p, stiffness=INF, **both)
    if "weld" in m.constraints:
        X_WB, X_WC = (plant.EvalBodyPoseInWorld(context, body) for body in (m.B, m.C))
        X_WP, X_WQ = X_WB @ m.X_BP, X_WC @ m.X_CQ
        middle = 0.5 * (X_WP.translation() + X_WQ.translation())
        turn = (X_WP.rotation().inverse() @ X_WQ.rotation()).ToAngleAxis()
        gap = [X_WP.rotation().multiply(turn.angle() * turn.axis()), X_WQ.translation() - X_WP.translation()]
        J_B, J_C = (
            plant.CalcJacobianSpatialVelocity(context, kV, body.body_frame(), X.inverse() @ middle, W, W)
            for body, X in ((m.B, X_WB), (m.C, X_WC))
        )
        problem.add_rows(J_C - J_B, HOLONOMIC, gap=np.concatenate(gap), stiffness=INF, **both)


def random_step(m, rng):
    """(our next state, Drake's, number of rows)"""
    from pydrake.math import RigidTransform, RollPitchYaw

    plant = m.plant
    root = m.diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    for i, joint in enumerate(m.joints):
        middle = (0.499, 0.1, 0.4, 0.03)[i]
        plant.SetPositions(
            context, put(plant.GetPositions(context), joint.position_start(), middle + 0.002 * rng.normal())
        )
    for body, p in ((m.A, [0.3, 0, -1.1]), (m.B, [0.4, 0.1, -1.1]), (m.C, [0.5, 0, -1])):
        X_WB = RigidTransform(RollPitchYaw(rng.normal(0, 0.3, 3)), p + rng.normal(0, 0.01, 3))
        plant.SetFreeBodyPose(context, body, X_WB)
    plant.SetVelocities(context, rng.normal(0, 1.0, plant.num_velocities()))
    u = rng.normal(0, 5.0, 3)
    desired = rng.normal(0, 0.5, (2, 3))
    plant.get_actuation_input_port().FixValue(context, u)
    if any(a.has_controller() for a in m.actuators):
        plant.get_desired_state_input_port(m.instance).FixValue(context, desired.ravel())
    tau = np.zeros(plant.num_velocities())
    for a, effort in zip(m.actuators, u):
        if not a.has_controller():
            tau[a.joint().velocity_start()] = np.clip(effort, -a.effort_limit(), a.effort_limit())
    problem = DrakeProblem(plant, context, "lagged", tau=tau)
    add_limits(m, problem)
    add_actuators(m, problem, u, desired)
    add_holonomic(m, problem)
    count = problem.work.problem.num_rows
    return problem.next_state(), one_step(m.diagram, plant, root), count


def put(values, i, value):
    values = values.copy()
    values[i] = value
    return values


CASES = {
    "limits": ({}, 1e-12),
    "effort limits": ({"effort": (2.0, 0.5, INF)}, 1e-12),
    "soft PD": ({"gains": [(100, 10), (50, 1), None]}, 1e-12),
    "stiff PD": ({"gains": [(1e7, 1e3), (0, 1e6), (1e9, 0)], "effort": (20.0, INF, 300.0)}, 1e-11),
    "coupler": ({"constraints": ("coupler",)}, 1e-11),
    "rigid distance": ({"constraints": ("distance",)}, 1e-8),
    "soft distance": ({"constraints": ("distance",), "distance_spring": (200.0, 3.0)}, 1e-11),
    # Speeds up to 1e3 and round-off of rows of stiffness 1/dt^2 limit the next two.
    "ball": ({"constraints": ("ball",)}, 1e-7),
    "weld": ({"constraints": ("weld",)}, 1e-7),
    "all": (
        {
            "constraints": ("coupler", "distance", "ball", "weld"),
            "gains": [(100, 10), (50, 1), None],
            "effort": (20.0, INF, INF),
        },
        1e-7,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_one_step_with_rows(case):
    options, tolerance = CASES[case]
    rng = np.random.default_rng(11)
    rows = 0
    for dt in (1e-3, 1e-2):
        m = mechanism(dt, **options)
        for _ in range(6):
            ours, drakes, count = random_step(m, rng)
            rows += count
            np.testing.assert_allclose(ours, drakes, rtol=tolerance, atol=tolerance)
    assert rows >= 8


def test_a_wrong_gap_is_seen(monkeypatch):
    m = mechanism(1e-3, constraints=("coupler",))
    right = DrakeProblem.add_rows

    def wrong(problem, J, kind, gap, **numbers):
        right(problem, J, kind, rate=gap, **numbers)

    monkeypatch.setattr(DrakeProblem, "add_rows", wrong)
    ours, drakes, _ = random_step(m, np.random.default_rng(11))
    assert np.abs(ours - drakes).max() > 1e-3
