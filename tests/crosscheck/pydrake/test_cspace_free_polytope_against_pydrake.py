"""Certificates of polytopes without collisions: the same ones are found, and the same largest scale."""

import numpy as np
import pytest
from tests.libraries import names_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")

C = np.vstack((np.eye(2), -np.eye(2)))
MODULES = (
    "geometry",
    "geometry.optimization",
    "math",
    "multibody.plant",
    "multibody.tree",
    "solvers",
    "systems.framework",
)
KEEP = []


def library(name):
    return names_of(name, *MODULES)


OURS, THEIRS = library("sheldrake"), library("pydrake")
SHAPES = {
    "box": lambda L: L.Box(0.1, 0.1, 0.4),
    "sphere": lambda L: L.Sphere(0.06),
    "capsule": lambda L: L.Capsule(0.05, 0.2),
    "cylinder": lambda L: L.Cylinder(0.05, 0.2),
}


def make(L, shape, links=2, wall=0.5, cross=False):
    builder = L.DiagramBuilder()
    plant, scene_graph = L.AddMultibodyPlantSceneGraph(builder, 0.0)
    parent, friction = plant.world_body(), L.CoulombFriction(1, 1)
    for i in range(links):
        body = plant.AddRigidBody(f"l{i}", L.SpatialInertia.SolidCubeWithDensity(1000, 0.1))
        X = L.RigidTransform([0, 0, 0.4 if i else 0.1])
        F = plant.AddFrame(L.FixedOffsetFrame(f"F{i}", parent.body_frame(), X))
        plant.AddJoint(L.RevoluteJoint(f"j{i}", F, body.body_frame(), [0, 1, 0], -1.2, 1.0))
        plant.RegisterCollisionGeometry(body, L.RigidTransform([0, 0, 0.2]), shape(L), f"g{i}", friction)
        parent = body
    X = L.RigidTransform([wall, 0, 0.5])
    plant.RegisterCollisionGeometry(plant.world_body(), X, L.Box(0.2, 0.6, 0.2), "wall", friction)
    plant.Finalize()
    KEEP.append(builder.Build())
    options = L.CspaceFreePolytopeBase.Options()
    options.with_cross_y = cross
    order = L.SeparatingPlaneOrder.kAffine
    KEEP.append(L.CspaceFreePolytope(plant, scene_graph, order, 0.1 * np.ones(links), options))
    return KEEP[-1]


def with_solver(L, options):
    options.solver_id = L.ClarabelSolver.id()
    return options


def scale(L, shape, **kwargs):
    options = L.CspaceFreePolytope.BinarySearchOptions()
    options.scale_max, options.scale_min, options.max_iter = 4.0, 0.5, 4
    with_solver(L, options.find_lagrangian_options)
    found = make(L, shape, **kwargs).BinarySearch(set(), C, 0.1 * np.ones(4), np.zeros(2), options)
    return found.d(), found.num_iter(), found.certified_polytope().b()


@pytest.mark.parametrize("shape", SHAPES)
def test_the_largest_scale_is_pydrakes(shape):
    ours, theirs = scale(OURS, SHAPES[shape]), scale(THEIRS, SHAPES[shape])
    np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-12)
    assert ours[1] == theirs[1]
    np.testing.assert_allclose(ours[2], theirs[2], rtol=1e-12)


def test_the_largest_scale_with_products_of_y():
    """The solver gives up on the large matrices a bisection earlier or later."""
    ours, theirs = (scale(L, SHAPES["cylinder"], cross=True)[0] for L in (OURS, THEIRS))
    np.testing.assert_allclose(ours, theirs, rtol=0.15)


def test_a_planted_fault_is_caught():
    assert np.abs(scale(OURS, SHAPES["box"], wall=0.6)[0] - scale(THEIRS, SHAPES["box"])[0]).max() > 1e-3


@pytest.mark.parametrize("shape", SHAPES)
def test_planes_are_pydrakes(shape):
    def facts(L):
        out = []
        for p in make(L, SHAPES[shape], links=3).separating_planes():
            sides = [p.positive_side_geometry, p.negative_side_geometry]
            of_sides = [(int(g.body_index()), g.type().name, g.num_rationals()) for g in sides]
            out.append((int(p.expressed_body), p.plane_degree, len(p.decision_variables), *of_sides))
        return sorted(out)

    assert facts(OURS) == facts(THEIRS)


def test_programs_have_as_many_variables_as_pydrakes():
    def count(L):
        polytope = make(L, SHAPES["box"])
        programs = [
            polytope.MakeIsGeometrySeparableProgram(pair, C, 0.1 * np.ones(4))
            for pair in polytope.map_geometries_to_separating_planes()
        ]
        return sorted((p.prog().num_vars(), len(p.certificate.positive_side_rational_lagrangians)) for p in programs)

    assert count(OURS) == count(THEIRS)


def test_alternation_grows_as_pydrakes():
    def volumes(L):
        options = L.CspaceFreePolytope.BilinearAlternationOptions()
        options.max_iter = 3
        with_solver(L, options.find_lagrangian_options)
        with_solver(L, options.find_polytope_options)
        rounds = make(L, SHAPES["box"]).SearchWithBilinearAlternation(set(), C, 0.1 * np.ones(4), options)
        return np.array([r.certified_polytope().MaximumVolumeInscribedEllipsoid().CalcVolume() for r in rounds])

    # Multipliers are not unique, so neither are the polytopes on the way; they differ less and less.
    ours, theirs = volumes(OURS), volumes(THEIRS)
    assert len(ours) == len(theirs) and np.all(np.diff(ours) > 0.0)
    assert ours[-1] == pytest.approx(theirs[-1], rel=0.05)
