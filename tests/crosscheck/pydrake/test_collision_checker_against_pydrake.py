"""Collisions, clearances and edges of the same robot: the same in both libraries."""

import copy
import importlib
import itertools

import numpy as np
import pytest
from tests.libraries import modules_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

MODULES = ("geometry", "math", "planning", "multibody.plant", "multibody.tree")
OURS, THEIRS = (modules_of(name, *MODULES) for name in ("sheldrake", "pydrake"))
KEEP = []  # What pydrake's objects refer to.
Q = np.array([0.3, 0.5, -0.2])


def model(L, floating=False):
    """Three links with spheres, a box beside them and a ball fixed to the world."""
    builder = L.planning.RobotDiagramBuilder(0.0)
    plant, X, t = builder.plant(), L.math.RigidTransform, L.tree
    inertia, friction = t.SpatialInertia.SolidCubeWithDensity(1, 0.1), L.plant.CoulombFriction(1, 1)
    robot, around = plant.AddModelInstance("robot"), plant.AddModelInstance("around")
    at = plant.world_frame()
    for i in range(3):
        body = plant.AddRigidBody(f"link{i}", robot, inertia)
        if not (floating and i == 0):
            plant.AddJoint(t.RevoluteJoint(f"joint{i}", at, body.body_frame(), [0, 0, 1], -3, 2.5 + i))
        plant.RegisterCollisionGeometry(body, X([0.25, 0, 0]), L.geometry.Sphere(0.1), f"s{i}", friction)
        at = plant.AddFrame(t.FixedOffsetFrame(f"end{i}", body.body_frame(), X([0.5, 0, 0])))
    box = plant.AddRigidBody("box", around, inertia)
    plant.RegisterCollisionGeometry(box, X(), L.geometry.Box(0.2, 0.2, 0.2), "box", friction)
    plant.WeldFrames(plant.world_frame(), box.body_frame(), X([0.8, 0.6, 0]))
    plant.RegisterCollisionGeometry(plant.world_body(), X([0, -1, 0]), L.geometry.Sphere(0.3), "ball", friction)
    return builder.Build(), robot


def checker(L, floating=False, **params):
    diagram, robot = model(L, floating)
    given = {"model": diagram, "robot_model_instances": [robot], "edge_step_size": 0.1, **params}
    out = L.planning.SceneGraphCollisionChecker(L.planning.CollisionCheckerParams(**given))
    KEEP.append((diagram, out))
    return out


def configurations(count=60):
    return np.random.default_rng(4).uniform(-3, 3, (count, 3))


def names(items):
    return [t.name for t in items]


def clearance(c, q, distance=0.6):
    r = c.CalcRobotClearance(q, distance)
    rows = [sorted((int(a), int(b))) for a, b in zip(r.robot_indices(), r.other_indices())]
    order = sorted(range(len(rows)), key=lambda k: (rows[k], round(r.distances()[k], 6)))
    return (
        [rows[k] for k in order],
        names(r.collision_types()[k] for k in order),
        r.distances()[order],
        r.jacobians()[order],
    )


def assert_same_clearance(mine, other):
    assert mine[:2] == other[:2]
    np.testing.assert_allclose(mine[2], other[2], atol=1e-7)
    np.testing.assert_allclose(mine[3], other[3], atol=1e-6)


@pytest.mark.parametrize("padding", [(0.0, 0.0), (0.1, 0.05), (-0.03, 0.2)])
def test_configurations(padding):
    pads = {"env_collision_padding": padding[0], "self_collision_padding": padding[1]}
    mine, other = (checker(L, **pads) for L in (OURS, THEIRS))
    qs = list(configurations())
    free = mine.CheckConfigsCollisionFree(qs)
    assert list(free) == list(other.CheckConfigsCollisionFree(qs)) and 0 < sum(free) < len(qs)
    for q in qs:
        assert names(mine.ClassifyBodyCollisions(q)) == names(other.ClassifyBodyCollisions(q))
    for q in qs[:10]:
        a, b = clearance(mine, q), clearance(other, q)
        if (
            padding[1] == 0.2
        ):  # pydrake 1.51.1 turns derivatives around where only the padding makes distances negative.
            a, b = (*a[:3], np.abs(a[3])), (*b[:3], np.abs(b[3]))
        assert_same_clearance(a, b)
    assert mine.MaxNumDistances() == other.MaxNumDistances()


def test_edges():
    mine, other = checker(OURS), checker(THEIRS)
    qs = configurations()
    edges = list(itertools.pairwise(qs))
    assert mine.CheckEdgesCollisionFree(edges) == list(other.CheckEdgesCollisionFree(edges))
    for a, b in zip(mine.MeasureEdgesCollisionFree(edges), other.MeasureEdgesCollisionFree(edges)):
        np.testing.assert_allclose(a.distance(), b.distance())
        np.testing.assert_allclose(a.alpha_or(-1), b.alpha_or(-1), atol=1e-12)
        assert (a.completely_free(), a.partially_free()) == (b.completely_free(), b.partially_free())


def test_jacobians_are_derivatives():
    c = checker(OURS)
    _, _, distances, J = clearance(c, Q)
    for k, e in enumerate(np.eye(3)):
        ahead, behind = (clearance(c, Q + s * 1e-6 * e)[2] for s in (1, -1))
        np.testing.assert_allclose((ahead - behind) / 2e-6, J[:, k], atol=1e-6)
    assert len(distances) > 1


def test_paddings_and_filters():
    found = []
    for L in (OURS, THEIRS):
        c, rows, I = checker(L), [], L.tree.BodyIndex
        c.SetPaddingAllRobotEnvironmentPairs(0.1)
        c.SetPaddingAllRobotRobotPairs(0.05)
        rows += [c.GetPaddingMatrix().copy(), c.GetLargestPadding(), c.MaybeGetUniformRobotEnvironmentPadding()]
        c.SetPaddingBetween(I(2), I(4), 0.3)
        c.SetPaddingOneRobotBodyAllEnvironmentPairs(I(3), -0.1)
        rows += [c.GetPaddingMatrix().copy(), c.MaybeGetUniformRobotEnvironmentPadding() is None]
        rows += [c.MaybeGetUniformRobotRobotPadding(), c.GetPaddingBetween(I(2), I(4))]
        rows += [c.GetFilteredCollisionMatrix().copy(), c.GetNominalFilteredCollisionMatrix()]
        c.SetCollisionFilteredBetween(I(2), I(4), True)
        c.SetCollisionFilteredBetween(c.get_body(I(1)), c.get_body(I(2)), False)
        rows += [c.GetFilteredCollisionMatrix().copy(), *clearance(c, Q)[2:]]
        c.SetCollisionFilteredWithAllBodies(I(3))
        rows += [c.GetFilteredCollisionMatrix().copy(), *clearance(c, Q)[2:]]
        c.SetCollisionFilterMatrix(c.GetNominalFilteredCollisionMatrix())
        c.SetPaddingMatrix(0 * c.GetPaddingMatrix())
        rows += [*clearance(c, Q)[2:], [c.IsPartOfRobot(I(k)) for k in range(5)]]
        found.append(rows)
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-7)


def test_more_shapes():
    found = []
    for L in (OURS, THEIRS):
        c, p, g, X = checker(L), L.planning, L.geometry, L.math.RigidTransform
        shape = p.BodyShapeDescription(g.Sphere(0.2), X([0, 0, 0.1]), "robot", "link1")
        plant = c.plant()
        done = [
            c.AddCollisionShape("a", shape),
            c.AddCollisionShapeToFrame("b", plant.GetFrameByName("end1"), g.Sphere(0.3), X()),
            c.AddCollisionShapeToBody("a", plant.GetBodyByName("box"), g.Box(0.3, 0.3, 0.3), X([0, 0.3, 0])),
            c.AddCollisionShapes({"c": [shape, shape]}) == {"c": 2},
        ]
        groups = {k: [d.body_name() for d in v] for k, v in c.GetAllAddedCollisionShapes().items()}
        rows = [clearance(c, Q)]
        rows += [clearance(c.Clone(), Q)]
        c.RemoveAllAddedCollisionShapes("a")
        rows += [clearance(c, Q)]
        c.RemoveAllAddedCollisionShapes()
        rows += [clearance(c, Q)]
        found.append((done, groups, rows))
    assert found[0][:2] == found[1][:2]
    for mine, other in zip(found[0][2], found[1][2]):
        assert_same_clearance(mine, other)


def test_floating_robots():
    found = []
    rng = np.random.default_rng(3)
    quaternions = rng.normal(size=(4, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    for L in (OURS, THEIRS):
        c = checker(L, floating=True)
        provider = L.planning.LinearDistanceAndInterpolationProvider(c.plant())
        starts = provider.quaternion_dof_start_indices()
        rows = [starts, provider.distance_weights(), c.GetZeroConfiguration()]
        qs = np.random.default_rng(5).uniform(-1, 1, (4, c.plant().num_positions()))
        qs[:, starts[0] : starts[0] + 4] = quaternions
        for a, b in itertools.pairwise(qs):
            rows += [provider.ComputeConfigurationDistance(a, b), provider.InterpolateBetweenConfigurations(a, b, 0.3)]
            rows += [c.CheckConfigCollisionFree(a)]
        found.append(rows)
    for mine, other in zip(*found):
        np.testing.assert_allclose(mine, other, atol=1e-12)


def test_distance_functions():
    for L in (OURS, THEIRS):
        c = checker(L, configuration_distance_function=lambda a, b: float(np.abs(a - b).sum()))
        assert c.ComputeConfigurationDistance(Q, Q + 1) == pytest.approx(3)
        c.SetConfigurationInterpolationFunction(lambda a, b, t: a + t * t * (b - a))
        np.testing.assert_allclose(c.InterpolateBetweenConfigurations(Q, Q + 1, 0.5), Q + 0.25)
        c.SetDistanceAndInterpolationProvider(L.planning.LinearDistanceAndInterpolationProvider(c.plant(), [1, 2, 2.0]))
        assert c.MakeStandaloneConfigurationDistanceFunction()(Q, Q + 1) == pytest.approx(3)
        with pytest.raises(RuntimeError, match="not supported after"):
            c.SetConfigurationDistanceFunction(lambda a, b: 1.0)
        with pytest.raises(RuntimeError, match="less than zero"):
            L.planning.LinearDistanceAndInterpolationProvider(c.plant(), [1, 2, -3.0])


def test_contexts():
    for L in (OURS, THEIRS):
        c = checker(L)
        mine = c.MakeStandaloneModelContext()
        assert c.CheckContextConfigCollisionFree(mine, Q) == c.CheckConfigCollisionFree(Q)
        assert c.CheckContextEdgeCollisionFree(mine, Q, Q + 0.1) == c.CheckEdgeCollisionFree(Q, Q + 0.1)
        seen = []
        c.PerformOperationAgainstAllModelContexts(lambda diagram, context, seen=seen: seen.append(context))
        assert len(seen) >= c.num_allocated_contexts() + 1


def test_descriptions():
    for L in (OURS, THEIRS):
        c = checker(L)
        geometry = c.plant().GetCollisionGeometriesForBody(c.plant().GetBodyByName("link0"))[0]
        d = L.planning.MakeBodyShapeDescription(c.plant(), c.plant_context(), geometry)
        assert (d.body_name(), d.model_instance_name(), d.shape().radius()) == ("link0", "robot", 0.1)
        np.testing.assert_allclose(d.pose_in_body().translation(), [0.25, 0, 0])


def test_masks_and_limits():
    found = []
    for L in (OURS, THEIRS):
        plant, p = checker(L).plant(), L.planning
        a, b = p.DofMask([True, False, True]), p.DofMask.MakeFromModel(plant, "robot")
        masks = [a.Complement(), a.Union(b), a.Intersect(b), b.Subtract(a), b]
        rows = [[list(m) for m in masks], a.GetFullToSelectedIndex(), a.GetSelectedToFullIndex(), a.count(), a.size()]
        rows += [[int(j) for j in a.GetJoints(plant)], a == p.DofMask([True, False, True])]
        limits = p.JointLimits(plant)
        chosen = p.JointLimits(limits, a)
        rows += [limits.position_lower().tolist(), chosen.position_upper().tolist(), chosen.num_accelerations()]
        rows += [limits.CheckInPositionLimits([0, 1, 4.5]), limits.CheckInPositionLimits([0, 1, 4.6], 0.2)]
        rows += [limits.CheckInPositionLimits([0, 1, 4.6], 0.05), limits.CheckInVelocityLimits([9, 9, 9])]
        with pytest.raises(RuntimeError, match="not finite"):
            p.JointLimits(plant, require_finite_velocities=True)
        with pytest.raises(RuntimeError, match="invalid"):
            p.JointLimits([1, 2], [0, 3], [1], [2], [1], [2])
        found.append(rows)
    assert found[0] == found[1]


def test_a_planted_fault_is_seen():
    mine, other = checker(OURS), checker(THEIRS)
    mine._padding[2, 4] = mine._padding[4, 2] = 0.001
    assert np.abs(clearance(mine, Q)[2] - clearance(other, Q)[2]).max() > 1e-4


def test_distances_of_a_checker_as_constraints():
    for kind in ("MinimumDistanceLowerBoundConstraint", "MinimumDistanceUpperBoundConstraint"):
        made = []
        for L in (OURS, THEIRS):
            c = checker(L)
            ik = importlib.import_module(f"{L.planning.__name__.split('.')[0]}.multibody.inverse_kinematics")
            constraint = getattr(ik, kind)(
                collision_checker=c,
                bound=0.2,
                collision_checker_context=c.MakeStandaloneModelContext(),
                influence_distance_offset=0.5,
            )
            made.append(constraint)
        assert made[0].num_vars() == made[1].num_vars() == 3
        for q in configurations(20):
            mine, other = (np.asarray(c.Eval(q)) for c in made)
            np.testing.assert_allclose(mine, other, atol=1e-6)
        np.testing.assert_array_equal(made[0].lower_bound(), made[1].lower_bound())
        np.testing.assert_array_equal(made[0].upper_bound(), made[1].upper_bound())


def test_clearances_of_many_configurations_are_those_of_each():
    ours = checker(OURS)
    configs = [Q, Q + 0.1, -Q]
    many = ours.CalcRobotClearances(configs, 0.4, parallelize=False)
    for q, clearance in zip(configs, many, strict=True):
        np.testing.assert_array_equal(clearance.distances(), ours.CalcRobotClearance(q, 0.4).distances())
        theirs = checker(THEIRS).CalcRobotClearance(q, 0.4)
        np.testing.assert_allclose(np.sort(clearance.distances()), np.sort(theirs.distances()), atol=1e-9)
    with pytest.raises(RuntimeError, match="configuration 1"):
        ours.CalcRobotClearances([Q, np.nan * Q], 0.4)
    with pytest.raises(RuntimeError, match="influence_distance"):
        ours.CalcRobotClearances([Q], -0.4)


def test_copies_have_paddings_of_their_own():
    found = []
    for L in (OURS, THEIRS):
        original = checker(L)
        original.CheckConfigCollisionFree(Q)
        other = copy.deepcopy(original)
        other.SetPaddingAllRobotEnvironmentPairs(5.0)
        found.append([type(original.MaxNumDistances()), *(c.CheckConfigCollisionFree(Q) for c in (original, other))])
    assert found[0] == found[1] == [int, True, False]


@pytest.mark.parametrize("L", [OURS, THEIRS], ids=["sheldrake", "pydrake"])
def test_a_checker_that_refuses_is_made_of_names_or_of_params(L):
    diagram, robot = model(L)
    given = {"model": diagram, "robot_model_instances": [robot], "edge_step_size": 0.1}
    Checker = L.planning.UnimplementedCollisionChecker
    KEEP.append(named := Checker(supports_parallel_checking=True, **given))
    assert named.SupportsParallelChecking() and named.edge_step_size() == 0.1
    params = L.planning.CollisionCheckerParams(**{**given, "model": model(L)[0]})
    KEEP.append(whole := Checker(params, True))
    assert whole.edge_step_size() == 0.1
    for wrong in (given, {"supports_parallel_checking": True}):
        with pytest.raises(TypeError):
            Checker(**wrong)
