"""Polytopes that are proven free of collisions: their planes separate, and what is within does not touch."""

import itertools

import numpy as np
import pytest

from sheldrake.geometry import Box, Capsule, Cylinder, Ellipsoid, Sphere
from sheldrake.geometry.optimization import (
    CIrisGeometryType,
    CspaceFreePolytope,
    CspaceFreePolytopeBase,
    PlaneSide,
    SeparatingPlaneOrder,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, RevoluteJoint, SpatialInertia
from sheldrake.systems.framework import DiagramBuilder

pytest.importorskip("clarabel")

CUBE = SpatialInertia.SolidCubeWithDensity(1000, 0.1)
C = np.vstack((np.eye(2), -np.eye(2)))
Q_STAR = np.array([0.1, -0.2])
KEEP = []


def arm(shape, joints=(RevoluteJoint, RevoluteJoint)):
    """Two links that turn about y, and a box beside them."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    parent, friction = plant.world_body(), CoulombFriction(1, 1)
    for i, kind in enumerate(joints):
        body = plant.AddRigidBody(f"l{i}", CUBE)
        F = plant.AddFrame(FixedOffsetFrame(f"F{i}", parent.body_frame(), RigidTransform([0, 0, 0.4 if i else 0.1])))
        plant.AddJoint(kind(f"j{i}", F, body.body_frame(), [0, 1, 0], -1.2, 1.0))
        plant.RegisterCollisionGeometry(body, RigidTransform([0, 0, 0.2]), shape, f"g{i}", friction)
        parent = body
    wall = RigidTransform([0.5, 0, 0.5])
    plant.RegisterCollisionGeometry(plant.world_body(), wall, Box(0.2, 0.6, 0.2), "wall", friction)
    plant.Finalize()
    diagram = builder.Build()
    KEEP.append(diagram)
    return diagram, plant, scene_graph


def make(shape=Box(0.1, 0.1, 0.4), with_cross_y=False, **kwargs):
    diagram, plant, scene_graph = arm(shape, **kwargs)
    options = CspaceFreePolytopeBase.Options(with_cross_y=with_cross_y)
    return diagram, plant, CspaceFreePolytope(plant, scene_graph, SeparatingPlaneOrder.kAffine, Q_STAR, options)


def extent(shape, direction):
    """How far a shape at the origin reaches in a direction."""
    if isinstance(shape, Box):
        return np.abs(direction) @ shape.size() / 2
    if isinstance(shape, Sphere):
        return shape.radius() * np.linalg.norm(direction)
    end = 0.5 * shape.length() * abs(direction[2])
    return end + shape.radius() * np.linalg.norm(direction if isinstance(shape, Capsule) else direction[:2])


def gap(plant, polytope, plane_index, a, b, s):
    """How far both geometries are on their sides of a plane: a x + b, less what the geometries reach; at s."""
    plane = polytope.separating_planes()[plane_index]
    kinematics = polytope._kinematics
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, kinematics.ComputeQValue(s, Q_STAR))
    at = dict(zip(kinematics.s(), s))
    a, b = np.array([p.Evaluate(at) for p in a]), b.Evaluate(at)
    out = []
    for sign, geometry in ((1, plane.positive_side_geometry), (-1, plane.negative_side_geometry)):
        bodies = (plant.get_body(i).body_frame() for i in (plane.expressed_body, geometry.body_index()))
        X_EG = plant.CalcRelativeTransform(context, *bodies) @ geometry.X_BG()
        reach = extent(geometry.geometry(), X_EG.rotation().matrix().T @ a)
        out.append(sign * (a @ X_EG.translation() + b) - reach)
    return min(out)


@pytest.mark.parametrize(
    ("shape", "cross"),
    [(Box(0.1, 0.1, 0.4), False), (Sphere(0.05), False), (Sphere(0.05), True), (Capsule(0.05, 0.2), False),
     (Cylinder(0.05, 0.2), False)],
)  # fmt: skip
def test_planes_separate_everywhere_in_the_polytope(shape, cross):
    _, plant, polytope = make(shape, cross)
    d = 0.15 * np.ones(4)
    success, found = polytope.FindSeparationCertificateGivenPolytope(
        C, d, set(), CspaceFreePolytope.FindSeparationCertificateGivenPolytopeOptions()
    )
    assert success and set(found) == set(polytope.map_geometries_to_separating_planes())
    for certificate in found.values():
        for s in itertools.product(np.linspace(-0.15, 0.15, 5), repeat=2):
            assert gap(plant, polytope, certificate.plane_index, certificate.a, certificate.b, np.array(s)) > 0.0


def test_multipliers_are_sums_of_squares_and_prove_it():
    """At any s: the numerator less multipliers times slacks is a square, not negative; so are multipliers."""
    _, _, polytope = make()
    pair = next(iter(polytope.map_geometries_to_separating_planes()))
    d = 0.15 * np.ones(4)
    program = polytope.MakeIsGeometrySeparableProgram(pair, C, d)
    result = polytope.SolveSeparationCertificateProgram(
        program, CspaceFreePolytope.FindSeparationCertificateGivenPolytopeOptions()
    )
    index = result.plane_index
    lagrangians = result.positive_side_rational_lagrangians + result.negative_side_rational_lagrangians
    row = np.append(result.plane_decision_var_vals, 1.0)
    for s in np.random.default_rng(1).uniform(-0.6, 0.6, (20, 2)):
        at = dict(zip(polytope._variables, [*s, 0, 0, 0]))
        slack = d - C @ s
        for rational, multipliers in zip(polytope._rationals(index), lagrangians):
            numerator = sum(
                np.prod(np.power([*s, 0, 0, 0], key)) * (value @ row) for key, value in rational.numerator.items()
            )
            values = np.array([p.Evaluate(at) for p in multipliers.polytope()])
            scale = max(1.0, np.abs(values).max(), abs(numerator))
            assert values.min() > -1e-7 * scale
            assert numerator - values @ slack > -1e-6 * scale


def test_what_collides_has_no_certificate():
    _, _, polytope = make()
    options = CspaceFreePolytope.FindSeparationCertificateGivenPolytopeOptions(terminate_at_failure=False)
    success, found = polytope.FindSeparationCertificateGivenPolytope(C, 0.6 * np.ones(4), set(), options)
    assert not success and len(found) < 2
    pairs = set(polytope.map_geometries_to_separating_planes())
    success, found = polytope.FindSeparationCertificateGivenPolytope(C, 0.6 * np.ones(4), pairs, options)
    assert success and not found


def collides(diagram, plant, q):
    context = diagram.CreateDefaultContext()
    plant.SetPositions(plant.GetMyMutableContextFromRoot(context), q)
    query = plant.get_geometry_query_input_port().Eval(plant.GetMyContextFromRoot(context))
    return query.HasCollisions()


def test_searches_make_large_polytopes_without_collisions():
    diagram, plant, polytope = make()
    scale = polytope.BinarySearch(
        set(), C, 0.1 * np.ones(4), np.zeros(2), CspaceFreePolytope.BinarySearchOptions(scale_max=10.0, max_iter=5)
    )
    assert scale.d() == pytest.approx(scale.d()[0]) and 0.1 < scale.d()[0] < 0.4 and scale.num_iter() == 5
    rounds = polytope.SearchWithBilinearAlternation(
        set(), C, 0.1 * np.ones(4), CspaceFreePolytope.BilinearAlternationOptions(max_iter=2)
    )
    volumes = [r.certified_polytope().MaximumVolumeInscribedEllipsoid().CalcVolume() for r in rounds]
    assert len(rounds) == 2 and volumes[1] > volumes[0] > 10 * np.pi * 0.1**2
    last = rounds[-1].certified_polytope()
    kinematics = polytope._kinematics
    inside = [s for s in itertools.product(np.linspace(-0.8, 0.8, 17), repeat=2) if last.PointInSet(np.array(s))]
    assert len(inside) > 50
    assert not any(collides(diagram, plant, kinematics.ComputeQValue(np.array(s), Q_STAR)) for s in inside)
    for index in rounds[-1].a():
        assert all(
            gap(plant, polytope, index, rounds[-1].a()[index], rounds[-1].b()[index], np.array(s)) > 0
            for s in inside[::5]
        )


def test_sliding_joints_and_points_to_contain():
    _, _, polytope = make(joints=(PrismaticJoint, RevoluteJoint))
    options = CspaceFreePolytope.BilinearAlternationOptions(max_iter=1)
    points = np.array([[0.05, -0.05], [0.0, 0.0]])
    options.find_polytope_options.s_inner_pts = points
    options.find_polytope_options.backoff_scale = 0.05
    options.find_polytope_options.search_s_bounds_lagrangians = False
    options.find_polytope_options.ellipsoid_margin_cost = CspaceFreePolytope.EllipsoidMarginCost.kSum
    (found,) = polytope.SearchWithBilinearAlternation(set(), C, 0.1 * np.ones(4), options)
    assert all(found.certified_polytope().PointInSet(p, 1e-6) for p in points.T)


def test_planes_tell_what_they_separate():
    _, _, polytope = make()
    planes = polytope.separating_planes()
    assert [int(p.expressed_body) for p in planes] == [1, 1] and PlaneSide.kPositive.value == 0
    for plane in planes:
        assert int(plane.positive_side_geometry.body_index()) == 0 and plane.plane_degree == 1
        assert plane.negative_side_geometry.type() is CIrisGeometryType.kPolytope
        assert plane.negative_side_geometry.num_rationals() == 8 and len(plane.decision_variables) == 12
    assert [v.get_name() for v in polytope.y_slack()] == ["y0", "y1", "y2"]


def test_what_is_refused():
    _, _, polytope = make()
    ids = next(iter(polytope.map_geometries_to_separating_planes()))
    options = CspaceFreePolytope.BinarySearchOptions()
    for call, message in (
        (lambda: polytope.MakeIsGeometrySeparableProgram(ids, np.eye(3), np.ones(3)), "there are 2 s"),
        (lambda: polytope.MakeIsGeometrySeparableProgram((ids[0], ids[0]), C, np.ones(4)), "need no plane"),
        (lambda: polytope.BinarySearch(set(), C, 0.1 * np.ones(4), [1.0, 0.0], options), "is not in the polytope"),
        (lambda: make(Ellipsoid(1, 2, 3)), "is not supported"),
    ):
        with pytest.raises(RuntimeError, match=message):
            call()
    with pytest.raises(TypeError, match="No constructor"):
        CspaceFreePolytopeBase()
