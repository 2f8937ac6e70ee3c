"""Constraints on the positions of the same plants: same values, same derivatives, same solutions."""

import importlib

import numpy as np
import pytest
from tests.crosscheck.pydrake import random_plants

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")

EYE = np.eye(3)
KEEP = []  # A plant does not keep its diagram alive.


class Library:
    """One of the two libraries, by the name of its package."""

    def __init__(self, name):
        for part in ("solvers", "math", "geometry", "autodiffutils"):
            setattr(self, part, importlib.import_module(f"{name}.{part}"))
        self.ik = importlib.import_module(f"{name}.multibody.inverse_kinematics")
        self.names = random_plants.library(name)
        self.builder = importlib.import_module(f"{name}.systems.framework").DiagramBuilder
        self.analysis = importlib.import_module(f"{name}.systems.analysis")
        self.primitives = importlib.import_module(f"{name}.systems.primitives")

    def X(self, *p):
        return self.math.RigidTransform(self.math.RollPitchYaw(0.3, -0.2, 0.9), p)

    def R(self, *rpy):
        return self.math.RotationMatrix(self.math.RollPitchYaw(*rpy))


OURS, THEIRS = Library("sheldrake"), Library("pydrake")


def two_frames(lib, plant):
    names = sorted(plant.get_body(i).name() for i in (lib.names.BodyIndex(k) for k in range(1, plant.num_bodies())))
    return [plant.GetFrameByName(names[1]), plant.GetFrameByName(names[-1])]


MAKE = {
    "position": lambda L, p, F, G, c: L.ik.PositionConstraint(p, F, [-1, -2, -3], [1, 2, 3], G, [0.1, 0.2, 0.3], c),
    "position_in_offset": lambda L, p, F, G, c: L.ik.PositionConstraint(
        p, F, L.X(1, 2, 3), [-1, -2, -3], [1, 2, 3], G, [0.1, 0.2, 0.3], c
    ),
    "position_of_variable": lambda L, p, F, G, c: L.ik.PositionConstraint(p, F, [-1, -2, -3], [1, 2, 3], G, None, c),
    "position_cost": lambda L, p, F, G, c: L.ik.PositionCost(
        p, F, [0.1, 0.2, 0.3], G, [1, 0.5, -1], np.arange(9.0).reshape(3, 3), c
    ),
    "orientation": lambda L, p, F, G, c: L.ik.OrientationConstraint(p, F, L.R(0.1, 0.2, 1), G, L.R(0, 0.3, 0), 0.4, c),
    "orientation_cost": lambda L, p, F, G, c: L.ik.OrientationCost(p, F, L.R(0.1, 0.2, 1), G, L.R(0, 0.3, 0), 0.4, c),
    "angle": lambda L, p, F, G, c: L.ik.AngleBetweenVectorsConstraint(p, F, [1, 2, 3], G, [0, -1, 2], 0.1, 1.2, c),
    "angle_cost": lambda L, p, F, G, c: L.ik.AngleBetweenVectorsCost(p, F, [1, 2, 3], G, [0, -1, 2], 0.7, c),
    "gaze": lambda L, p, F, G, c: L.ik.GazeTargetConstraint(p, F, [0.1, 0.2, 0.3], [1, 2, 3], G, [1, 0, 2], 0.6, c),
    "point_to_point": lambda L, p, F, G, c: L.ik.PointToPointDistanceConstraint(
        p, F, [1, 2, 3], G, [0, 1, 0], 0.1, 2, c
    ),
    "point_to_line": lambda L, p, F, G, c: L.ik.PointToLineDistanceConstraint(
        p, F, [1, 2, 3], G, [0, 1, 0], [1, 1, 2], 0.1, 2, c
    ),
    "polyhedron": lambda L, p, F, G, c: L.ik.PolyhedronConstraint(
        p, F, G, np.arange(6.0).reshape(3, 2), np.arange(12.0).reshape(2, 6), [1, 2], c
    ),
    "com": lambda L, p, F, G, c: L.ik.ComPositionConstraint(p, None, F, c),
    "com_of_robot": lambda L, p, F, G, c: L.ik.ComInPolyhedronConstraint(
        p, [p.GetModelInstanceByName("robot")], G, EYE[:2], [0, 1], [1, 2], c
    ),
}


@pytest.mark.parametrize("name", sorted(MAKE))
def test_values_and_gradients(name):
    for seed in (1, 4):
        found = []
        for L in (OURS, THEIRS):
            plant = random_plants.build(L.names, seed, forces=False)
            c = MAKE[name](L, plant, *two_frames(L, plant), plant.CreateDefaultContext())
            rng = np.random.default_rng(seed)
            x = rng.uniform(-1.2, 1.2, c.num_vars())
            gradient = rng.normal(size=(x.size, 3))
            duals = c.Eval(L.autodiffutils.InitializeAutoDiff(x, gradient)[:, 0])
            bounds = (c.lower_bound(), c.upper_bound()) if "cost" not in name else ()
            found.append([c.Eval(x), L.autodiffutils.ExtractGradient(duals), *bounds])
        for mine, other in zip(*found):
            np.testing.assert_allclose(mine, other, atol=1e-10)


@pytest.mark.parametrize("name", ["position", "orientation", "angle_cost", "gaze", "point_to_line", "com"])
def test_plants_of_duals_give_the_same_gradients(name):
    L = OURS
    plant = random_plants.build(L.names, 4, forces=False)
    duals = plant.ToAutoDiffXd()
    a = MAKE[name](L, plant, *two_frames(L, plant), plant.CreateDefaultContext())
    b = MAKE[name](L, duals, *two_frames(L, duals), duals.CreateDefaultContext())
    x = np.random.default_rng(3).uniform(-1.2, 1.2, a.num_vars())
    np.testing.assert_allclose(a.Eval(x), b.Eval(x), atol=1e-12)
    given = L.autodiffutils.InitializeAutoDiff(x)[:, 0]
    np.testing.assert_allclose(*(L.autodiffutils.ExtractGradient(c.Eval(given)) for c in (a, b)), atol=1e-10)


def arm(L, links=4):
    """A diagram with an arm of spheres on hinges and a ball in its way."""
    n, builder = L.names, L.builder()
    plant, _ = n.AddMultibodyPlantSceneGraph(builder, 0.01)
    friction = n.CoulombFriction(1, 1)
    parent, axes = plant.world_body(), ([0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0])
    for i in range(links):
        body = plant.AddRigidBody(f"link{i}", n.SpatialInertia.SolidCubeWithDensity(1000, 0.1))
        X = n.RigidTransform([0, 0, 0.4 if i else 0.2])
        plant.AddJoint(
            n.RevoluteJoint(
                f"j{i}",
                plant.AddFrame(n.FixedOffsetFrame(f"f{i}", parent.body_frame(), X)),
                body.body_frame(),
                axes[i],
                -2,
                2.2,
            )
        )
        shape = L.geometry.Sphere(0.1) if i % 2 else L.geometry.Box(0.1, 0.15, 0.2)
        plant.RegisterCollisionGeometry(body, n.RigidTransform([0, 0, 0.2]), shape, f"g{i}", friction)
        parent = body
    plant.RegisterCollisionGeometry(
        plant.world_body(), n.RigidTransform([0.5, 0.1, 0.8]), L.geometry.Sphere(0.2), "ball", friction
    )
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    KEEP.extend((diagram, root))
    return plant, plant.GetMyMutableContextFromRoot(root)


@pytest.mark.parametrize("kind", ["lower", "upper", "pair"])
def test_distances_and_their_gradients(kind):
    found = []
    for L in (OURS, THEIRS):
        plant, context = arm(L)
        if kind == "lower":
            c = L.ik.MinimumDistanceLowerBoundConstraint(plant, 0.05, context, influence_distance_offset=0.6)
        elif kind == "upper":
            c = L.ik.MinimumDistanceUpperBoundConstraint(plant, 0.05, context, 0.6)
        else:
            ids = [
                plant.GetCollisionGeometriesForBody(b)[0] for b in (plant.world_body(), plant.GetBodyByName("link3"))
            ]
            c = L.ik.DistanceConstraint(plant, tuple(ids), context, 0.1, 2.0)
        rows = []
        for q in np.random.default_rng(1).uniform(-0.7, 0.7, size=(4, plant.num_positions())):
            J = L.autodiffutils.ExtractGradient(c.Eval(L.autodiffutils.InitializeAutoDiff(q)[:, 0]))
            rows.append([*c.Eval(q), *J.ravel()])
        found.append(np.array([[*r, *c.lower_bound(), *c.upper_bound()] for r in rows]))
    np.testing.assert_allclose(*found, atol=1e-7)  # nearest points of box and sphere are found to that


def test_inverse_kinematics_finds_the_same_posture():
    found = []
    for L in (OURS, THEIRS):
        plant, context = arm(L, links=7)
        ik = L.ik.InverseKinematics(plant, context)
        tip, W = plant.GetFrameByName("link6"), plant.world_frame()
        plant.SetPositions(context, [0.4, 0.8, -0.5, 0.9, 0.3, -0.6, 0.2])
        X = plant.CalcRelativeTransform(context, W, tip)
        p = X @ np.array([0, 0, 0.2])
        ik.AddPositionConstraint(tip, [0, 0, 0.2], W, p - 1e-3, p + 1e-3)
        ik.AddOrientationConstraint(W, X.rotation(), tip, L.R(0, 0, 0), 0.05)
        ik.AddMinimumDistanceLowerBoundConstraint(0.01, 0.3)
        ik.prog().AddQuadraticErrorCost(np.eye(7), np.full(7, 0.2), ik.q())
        ik.prog().SetInitialGuess(ik.q(), np.full(7, 0.2))
        result = L.solvers.Solve(ik.prog())
        assert result.is_success()
        found.append((result.get_optimal_cost(), result.GetSolution(ik.q()), str(ik.prog())))
    assert found[0][0] <= found[1][0] + 1e-4
    np.testing.assert_allclose(found[0][1], found[1][1], atol=2e-3)
    assert found[0][2] == found[1][2]


def test_locked_joints_stay():
    for L in (OURS, THEIRS):
        plant, context = arm(L)
        plant.SetPositions(context, [0.1, 0.2, 0.3, 0.4])
        plant.GetJointByName("j2").Lock(context)
        ik = L.ik.InverseKinematics(plant, context)
        ik.AddPositionCost(plant.world_frame(), [0.3, 0.2, 1.2], plant.GetFrameByName("link3"), [0, 0, 0], EYE)
        result = L.solvers.Solve(ik.prog())
        assert result.is_success() and result.GetSolution(ik.q())[2] == pytest.approx(0.3, abs=1e-9)


def kinematic_plant(L, kind):
    n = L.names
    plant = n.MultibodyPlant(0.01)
    A, B, C = (plant.AddRigidBody(name, n.SpatialInertia.SolidCubeWithDensity(1, 1)) for name in "ABC")
    a = plant.AddJoint(n.RevoluteJoint("a", plant.world_frame(), A.body_frame(), [0, 0, 1]))
    b = plant.AddJoint(n.PrismaticJoint("b", A.body_frame(), B.body_frame(), [1, 0, 0]))
    if kind == "coupler":
        plant.AddCouplerConstraint(a, b, 2.0, 0.3)
    elif kind == "distance":
        plant.AddDistanceConstraint(A, [1, 2, 3], C, [1, 0, 0], 0.5)
    elif kind == "ball":
        plant.AddBallConstraint(A, [1, 2, 3], C, [1, 0, 0])
    else:
        plant.AddWeldConstraint(A, L.X(1, 2, 3), C, L.X(1, 0, 2))
    plant.Finalize()
    return plant


@pytest.mark.parametrize("kind", ["coupler", "distance", "ball", "weld"])
def test_constraints_of_the_plant(kind):
    found = []
    for L in (OURS, THEIRS):
        plant = kinematic_plant(L, kind)
        prog = L.solvers.MathematicalProgram()
        q = prog.NewContinuousVariables(plant.num_positions(), "q")
        context = plant.CreateDefaultContext()
        bindings = L.ik.AddMultibodyPlantConstraints(plant, q, prog, context)
        x = np.linspace(0.1, 0.7, q.size)
        values = np.concatenate([prog.EvalBinding(b, x) for b in bindings])
        found.append((str(prog), values))
    assert found[0][0] == found[1][0]
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-10)


def differential_parameters(L, n):
    p = L.ik.DifferentialInverseKinematicsParameters(n, n)
    p.set_time_step(0.05)
    p.set_nominal_joint_position(np.linspace(-0.5, 0.5, n))
    p.set_joint_centering_gain(0.3 * np.eye(n))
    p.set_joint_position_limits((-2 * np.ones(n), 2.2 * np.ones(n)))
    p.set_joint_velocity_limits((-1.5 * np.ones(n), 1.5 * np.ones(n)))
    p.set_joint_acceleration_limits((-40 * np.ones(n), 40 * np.ones(n)))
    for key in ("eps_abs", "eps_rel"):  # OSQP serves pydrake here, and is coarse by default.
        if L is THEIRS:
            p.get_mutable_solver_options().SetOption(L.solvers.OsqpSolver.id(), key, 1e-10)
    p.set_end_effector_angular_speed_limit(2.0)
    p.set_end_effector_translational_velocity_limits([-0.5] * 3, [0.5] * 3)
    return p


@pytest.mark.parametrize("way", ["velocity", "velocity_in_frame", "pose", "flags", "arrays", "fast"])
def test_differential_inverse_kinematics(way):
    found = []
    for L in (OURS, THEIRS):
        plant, context = arm(L, links=7)
        q = np.array([0.1, 0.4, -0.3, 0.5, 0.2, 0.6, 0.1])
        plant.SetPositions(context, q)
        p, E = differential_parameters(L, 7), plant.GetFrameByName("link6")
        do, V = L.ik.DoDifferentialInverseKinematics, np.array([0.1, -0.2, 0.3, 0.1, 0.05, -0.1])
        if way == "velocity":
            r = do(plant, context, V, E, p)
        elif way == "fast":
            r = do(plant, context, 50 * V, E, p)
        elif way == "velocity_in_frame":
            r = do(plant, context, V, plant.GetFrameByName("link1"), E, p)
        elif way == "flags":
            p.set_end_effector_velocity_flag([True, False, True, True, False, True])
            r = do(plant, context, V, E, p)
        elif way == "pose":
            X = plant.CalcRelativeTransform(context, plant.world_frame(), E)
            r = do(plant, context, L.math.RigidTransform(L.R(0.1, 0.2, -0.1), [0.02, 0.01, 0.03]) @ X, E, p)
        else:
            J = np.arange(14.0).reshape(2, 7) % 5 - 2
            r = do(q_current=q, v_current=0 * q, V=np.array([0.3, -0.2]), J=J, parameters=p)
        found.append((r.status.name, r.joint_velocities))
    assert found[0][0] == found[1][0]
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-5)


@pytest.mark.parametrize("port", ["X_AE_desired", "X_WE_desired"])
def test_the_integrator_follows_a_pose(port):
    found = []
    for L in (OURS, THEIRS):
        plant, _ = arm(L, links=7)
        E = plant.GetFrameByName("link6")
        system = L.ik.DifferentialInverseKinematicsIntegrator(plant, E, 0.05, differential_parameters(L, 7))
        simulator = L.analysis.Simulator(system)
        mine = simulator.get_mutable_context()
        system.SetPositions(mine, np.linspace(0.1, 0.7, 7))
        X = L.math.RigidTransform(L.R(0.1, 0.5, -0.1), [0.3, 0.2, 1.7])
        system.GetInputPort(port).FixValue(mine, X)
        simulator.AdvanceTo(2.0)
        found.append((system.GetOutputPort("joint_positions").Eval(mine), system.ForwardKinematics(mine).translation()))
        assert system.GetInputPort("use_robot_state").get_index() == 3
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-4)


def test_a_least_distance_has_a_finite_bound():
    for L in (OURS, THEIRS):
        plant, context = arm(L)
        with pytest.raises(ValueError, match="influence_distance must be finite"):
            L.ik.MinimumDistanceLowerBoundConstraint(plant=plant, bound=np.inf, plant_context=context)


def test_a_planted_fault_is_seen():
    L = OURS
    plant = random_plants.build(L.names, 4, forces=False)
    c = MAKE["gaze"](L, plant, *two_frames(L, plant), plant.CreateDefaultContext())
    x = np.random.default_rng(3).uniform(-1.2, 1.2, c.num_vars())
    h = 1e-6
    J = L.autodiffutils.ExtractGradient(c.Eval(L.autodiffutils.InitializeAutoDiff(x)[:, 0]))
    c._M, c._own_forms = 1.01 * c._M, None
    differences = np.stack([(c.Eval(x + h * e) - c.Eval(x - h * e)) / (2 * h) for e in np.eye(x.size)], axis=1)
    assert np.abs(J - differences).max() > 1e-3
