"""Fastest traversals, and constraints on motion and balance, of the same plants in both libraries."""

import numpy as np
import pytest
from tests.libraries import modules_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

EYE6 = np.ones(6)

MODULES = (
    "autodiffutils geometry math trajectories solvers "
    "multibody.optimization multibody.plant multibody.tree systems.framework"
).split()
OURS, THEIRS = (modules_of(name, *MODULES) for name in ("sheldrake", "pydrake"))
KEEP = []  # What pydrake's objects refer to.


def arm(L):
    """Two links on hinges, with a frame at the tip."""
    builder = L.framework.DiagramBuilder()
    plant, _ = L.plant.AddMultibodyPlantSceneGraph(builder, 0.0)
    inertia = L.tree.SpatialInertia.SolidCubeWithDensity(100, 0.2)
    A, B = (plant.AddRigidBody(name, inertia) for name in "AB")
    plant.AddJoint(L.tree.RevoluteJoint("a", plant.world_frame(), A.body_frame(), [0, 1, 0], 0.3))
    elbow = plant.AddFrame(L.tree.FixedOffsetFrame("f", A.body_frame(), L.math.RigidTransform([0.5, 0, 0])))
    plant.AddJoint(L.tree.RevoluteJoint("b", elbow, B.body_frame(), [0, 1, 0.2]))
    tip = plant.AddFrame(L.tree.FixedOffsetFrame("g", B.body_frame(), L.math.RigidTransform([0.5, 0.1, 0])))
    plant.Finalize()
    KEEP.append(builder.Build())
    return plant, tip


def path_of(L):
    return L.trajectories.PiecewisePolynomial.CubicShapePreserving(
        [0.5, 1.0, 1.5], np.array([[0, 1, 0.3], [0, -1, -2.0]]), True
    )


LIMITS = {
    "velocity": lambda L, T, tip: T.AddJointVelocityLimit([-1.5, -1], [1.3, 1]),
    "acceleration": lambda L, T, tip: T.AddJointAccelerationLimit([-1, -2], [1, 2]),
    "collocated": lambda L, T, tip: T.AddJointAccelerationLimit(
        [-1, -2], [1, 2], L.optimization.ToppraDiscretization.kCollocation
    ),
    "torque": lambda L, T, tip: T.AddJointTorqueLimit([-10, -8], [10, 8.0]),
    "frame": lambda L, T, tip: T.AddFrameVelocityLimit(tip, -0.6 * EYE6, 0.5 * EYE6),
    "speed": lambda L, T, tip: T.AddFrameTranslationalSpeedLimit(tip, 0.4),
    "speed_trajectory": lambda L, T, tip: T.AddFrameTranslationalSpeedLimit(
        tip, L.trajectories.PiecewisePolynomial.FirstOrderHold([0.3, 0.9], [[0.5, 0.2]])
    ),
    "frame_acceleration": lambda L, T, tip: T.AddFrameAccelerationLimit(tip, -2 * EYE6, 2 * EYE6),
    "frame_acceleration_trajectories": lambda L, T, tip: T.AddFrameAccelerationLimit(
        tip,
        L.trajectories.PiecewisePolynomial.FirstOrderHold([0.7, 1.7], -2 * np.ones((6, 2))),
        L.trajectories.PiecewisePolynomial.FirstOrderHold([0.7, 1.2], 3 * np.ones((6, 2))),
    ),
}
CASES = [
    ("velocity", "acceleration"),
    ("velocity", "collocated"),
    ("torque",),
    ("frame", "acceleration"),
    ("speed", "acceleration"),
    ("speed_trajectory", "acceleration"),
    ("velocity", "frame_acceleration"),
    ("velocity", "frame_acceleration_trajectories"),
    tuple(n for n in LIMITS if n not in ("collocated", "speed_trajectory", "frame_acceleration_trajectories")),
]


def traversal(L, names, start=0.0, end=0.0, spoil=None):
    plant, tip = arm(L)
    KEEP.append(path_of(L))
    T = L.optimization.Toppra(KEEP[-1], plant, np.linspace(0.5, 1.5, 21))
    for name in names:
        LIMITS[name](L, T, tip)
    if spoil:
        spoil(T)
    s = T.SolvePathParameterization(start, end)
    if s is None:
        return None
    t = np.linspace(s.start_time(), s.end_time(), 40)
    return np.concatenate(
        (s.get_segment_times(), [s.value(v)[0, 0] for v in t], [s.EvalDerivative(v)[0, 0] for v in t])
    )


@pytest.mark.parametrize("names", CASES, ids="+".join)
def test_fastest_traversals(names):
    # pydrake's linear programs end within 1e-8 of their optimum, where they are not solved by pivoting.
    np.testing.assert_allclose(traversal(OURS, names), traversal(THEIRS, names), atol=1e-7)


def test_traversals_that_start_and_end_in_motion():
    names = ("velocity", "acceleration")
    np.testing.assert_allclose(traversal(OURS, names, 0.1, 0.2), traversal(THEIRS, names, 0.1, 0.2), atol=1e-9)
    assert traversal(OURS, names, 10.0) is None and traversal(THEIRS, names, 10.0) is None
    assert traversal(OURS, names, 0.0, 10.0) is None and traversal(THEIRS, names, 0.0, 10.0) is None


def test_a_planted_fault_in_a_traversal_is_seen():
    def spoil(T):
        T._q_ss *= 1.01
        T.AddJointAccelerationLimit([-1, -2], [1, 2])

    wrong = traversal(OURS, ("velocity",), spoil=spoil)
    assert np.abs(wrong - traversal(THEIRS, ("velocity", "acceleration"))).max() > 1e-5


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"max_err": 1e-2, "min_points": 5},
        {"max_err": 1e-2, "min_points": 5, "max_seg_length": 0.3},
        {"max_err": 1, "min_points": 5, "max_seg_length": 2},
        {"max_err": 1e-9, "min_points": 5, "max_seg_length": 2, "max_iter": 3},
    ],
    ids=str,
)
def test_gridpoints(options):
    mine, other = (
        L.optimization.Toppra.CalcGridPoints(path_of(L), L.optimization.CalcGridPointsOptions(**options))
        for L in (OURS, THEIRS)
    )
    np.testing.assert_allclose(mine, other, atol=1e-15)


def touching(L):
    """A ball on a hinge, a free ball and the ground, as a plant of duals in a diagram's context."""
    builder = L.framework.DiagramBuilder()
    plant, scene_graph = L.plant.AddMultibodyPlantSceneGraph(builder, 0.0)
    inertia, friction = L.tree.SpatialInertia.SolidCubeWithDensity(100, 0.2), L.plant.CoulombFriction(0.7, 0.5)
    A, B = (plant.AddRigidBody(name, inertia) for name in "AB")
    g, X = L.geometry, L.math.RigidTransform
    plant.RegisterCollisionGeometry(A, X([0.1, 0, 0]), g.Sphere(0.1), "a", friction)
    plant.RegisterCollisionGeometry(B, X(), g.Sphere(0.2), "b", L.plant.CoulombFriction(0.9, 0.5))
    plant.RegisterCollisionGeometry(plant.world_body(), X([0, 0, -1]), g.Box(10, 10, 2), "ground", friction)
    plant.AddJoint(L.tree.RevoluteJoint("a", plant.world_frame(), B.body_frame(), [0, 1, 0], -1, 2))
    plant.AddJointActuator("motor", plant.GetJointByName("a"))
    plant.Finalize()
    of_floats = builder.Build()
    diagram = of_floats.ToAutoDiffXd()
    root = diagram.CreateDefaultContext()
    duals = diagram.GetSubsystemByName("plant")
    KEEP.extend((of_floats, diagram, root))
    pairs = sorted(scene_graph.model_inspector().GetCollisionCandidates())
    return duals, duals.GetMyContextFromRoot(root), pairs


def bounds_of_rotation(L):
    w = L.optimization.SpatialVelocityConstraint.AngularVelocityBounds()
    w.magnitude_lower, w.magnitude_upper, w.reference_direction, w.theta_bound = 0.3, 3.0, [1, 2, 3], 0.5
    return w


def frames(plant):
    return plant.GetFrameByName("A"), plant.GetFrameByName("B")


def velocity(L, plant, context, *more):
    A, B = frames(plant)
    return L.optimization.SpatialVelocityConstraint(
        plant, A, [-1, -2, -3], [1, 2, 3], B, [0.1, 0.2, 0.3], context, *more
    )


MAKE = {
    "momentum": lambda L, p, c, pairs: L.optimization.CentroidalMomentumConstraint(p, None, c, False),
    "angular": lambda L, p, c, pairs: L.optimization.CentroidalMomentumConstraint(
        p, [p.GetBodyByName("A").model_instance()], c, True
    ),
    "velocity": lambda L, p, c, pairs: velocity(L, p, c),
    "rotation": lambda L, p, c, pairs: velocity(L, p, c, bounds_of_rotation(L)),
    "turn": lambda L, p, c, pairs: L.optimization.QuaternionEulerIntegrationConstraint(False),
    "negated": lambda L, p, c, pairs: L.optimization.QuaternionEulerIntegrationConstraint(True),
    "wrench": lambda L, p, c, pairs: L.optimization.ContactWrenchFromForceInWorldFrameEvaluator(p, c, pairs[0]),
}


def value_and_gradient(L, evaluator, x):
    duals = evaluator.Eval(L.autodiffutils.InitializeAutoDiff(x)[:, 0])
    return [evaluator.Eval(x), L.autodiffutils.ExtractValue(duals).ravel(), L.autodiffutils.ExtractGradient(duals)]


@pytest.mark.parametrize("name", sorted(MAKE))
def test_constraints_on_motion(name):
    found = []
    for L in (OURS, THEIRS):
        evaluator = MAKE[name](L, *touching(L))
        x = np.random.default_rng(2).uniform(-1, 1, evaluator.num_vars())
        bounds = [evaluator.lower_bound(), evaluator.upper_bound()] if name != "wrench" else []
        found.append([*value_and_gradient(L, evaluator, x), *bounds])
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-12)


def equilibrium(L):
    plant, context, pairs = touching(L)
    problem = L.optimization.StaticEquilibriumProblem(plant, context, {pairs[1]})
    problem.UpdateComplementarityTolerance(0.02)
    KEEP.append(problem)
    return problem


def evaluated(L, problem):
    prog, out = problem.prog(), []
    x = np.random.default_rng(3).uniform(-1, 1, prog.num_vars())
    for binding in prog.GetAllConstraints():
        evaluator = binding.evaluator()
        mine = x[prog.FindDecisionVariableIndices(binding.variables())]
        out += [*value_and_gradient(L, evaluator, mine), evaluator.lower_bound(), evaluator.upper_bound()]
    return out


def test_static_equilibrium_is_the_same_program():
    mine, other = (equilibrium(L) for L in (OURS, THEIRS))
    assert [str(v) for v in mine.prog().decision_variables()] == [str(v) for v in other.prog().decision_variables()]
    rows = [evaluated(L, p) for L, p in ((OURS, mine), (THEIRS, other))]
    assert len(rows[0]) == len(rows[1])
    for a, b in zip(*rows):
        np.testing.assert_allclose(a, b, atol=1e-10)


class AllOnes:
    """A result in which every variable is one."""

    def GetSolution(self, variables):
        return np.ones(len(variables))


def test_wrenches_of_a_solution():
    found = []
    problem = equilibrium(OURS)
    for wrench in problem.GetContactWrenchSolution(AllOnes()):
        found.append((int(wrench.bodyA_index), int(wrench.bodyB_index), wrench.p_WCb_W, wrench.F_Cb_W.get_coeffs()))
    assert len(found) == 2
    for _, _, p_WC, F in found:
        assert p_WC.shape == (3,) and np.array_equal(F, [0, 0, 0, 1, 1, 1])
    # The ball on the hinge is at the origin, the free one beyond (1, 1, 1): they are nearest where the line between
    # their centers leaves the first, which comes second in the pair.
    assert found[0][:2] == (1, 2)
    np.testing.assert_allclose(np.linalg.norm(found[0][2]), 0.2, atol=1e-12)


def test_a_planted_fault_in_the_balance_is_seen():
    problem = equilibrium(OURS)
    right = evaluated(OURS, problem)
    problem._cones[0]._mu *= 1.01
    wrong = evaluated(OURS, problem)
    assert not all(np.allclose(a, b, atol=1e-3) for a, b in zip(right, wrong))


def test_relaxed_limits_of_the_way_forward():
    """Accelerations pass their limits by the relaxation, on the way forward only: the traversal is a little faster."""
    limits = ("acceleration",)
    tight = traversal(OURS, limits)
    loose = traversal(OURS, limits, spoil=lambda T: T.set_constraint_relaxation(1e-3))
    durations = [t[20] - t[0] for t in (tight, loose)]
    assert durations[0] * (1.0 - 1e-2) < durations[1] < durations[0]
    plant, _ = arm(OURS)
    T = OURS.optimization.Toppra(path_of(OURS), plant, np.linspace(0.5, 1.5, 3))
    assert T.constraint_relaxation() == 0.0
    for bad in (-1.0, np.inf, np.nan):
        with pytest.raises(RuntimeError, match="finite number >= 0"):
            T.set_constraint_relaxation(bad)
