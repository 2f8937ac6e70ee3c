"""Answers of single calls: what they return, whether it may be written, which error comes."""

import copy
import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer


LIBRARIES = [importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")]


def poses_of_half_spaces(m):
    normals = np.random.default_rng(1).normal(size=(20, 3)).tolist() + np.eye(3).tolist() + (-np.eye(3)).tolist()
    return [m.HalfSpace.MakePose(n, [0.1, 0.2, 0.3]).GetAsMatrix4() for n in normals]


def names_of_new_variables(m):
    program = m.MathematicalProgram()
    calls = (program.NewContinuousVariables, program.NewIndeterminates, program.NewBinaryVariables)
    shapes = ((2,), (1, 1), (2, 1), (1, 2))
    return [[v.get_name() for v in call(*shape).ravel()] for call in calls for shape in shapes]


def linear_constraints(m):
    program = m.MathematicalProgram()
    x = program.NewContinuousVariables(2)
    program.AddBoundingBoxConstraint(-1, 1, x)
    program.AddLinearConstraint(x[0] + x[1] <= 1)
    program.AddLinearEqualityConstraint(x[0] == 2 * x[1])
    return len(program.GetLinearConstraints())


def colors_of_points(m):
    cloud = m.PointCloud(2)
    point = cloud.xyz(0)
    point[:] = 1.0  # a copy
    return np.isnan(cloud.xyz(0)).tolist(), cloud.xyzs().flags.writeable


def topology(m):
    plant = m.MultibodyPlant(0.0)
    body = plant.AddRigidBody("b", m.SpatialInertia.SolidSphereWithMass(1, 1))
    plant.AddJoint(m.RevoluteJoint("j", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.Finalize()
    return plant.GetTopologyGraphvizString().replace("}\n\n", "}\n").strip()


def rate_before_the_first_step(m):
    return np.isnan(m.Simulator(m.Adder(1, 1)).get_actual_realtime_rate())


def groups_as_text(m):
    groups = m.CollisionFilterGroups()
    groups.AddGroup("b", {"two", "one"})
    groups.AddGroup("a", {"three"})
    groups.AddExclusionPair(("b", "a"))
    return str(groups)


def meshes(m):
    def mesh(height):
        tetrahedron = m.VolumeElement(0, 1, 2, 3)
        return m.VolumeMesh([tetrahedron], [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, height]])

    return [mesh(1.0).Equal(mesh(h), vertex_tolerance=0.1) for h in (1.0, 1.05, 1.2)], mesh(1.0).Equal(mesh(1.05))


def copies_of_an_empty_constraint(m):
    copied = copy.copy(m.DistanceConstraintParams())
    return copied.bodyA().is_valid(), copied.bodyB().is_valid(), copied.p_AP().tolist()


def angles_without_limits(m):
    plant = m.MultibodyPlant(0.0)
    inertia = m.SpatialInertia.SolidSphereWithMass(1, 1)
    for kind in (m.BallRpyJoint, m.UniversalJoint, m.PlanarJoint, m.RpyFloatingJoint):
        body = plant.AddRigidBody(kind.__name__, inertia)
        plant.AddJoint(kind(kind.__name__, plant.world_frame(), body.body_frame()))
    plant.Finalize()
    return m.GetContinuousRevoluteJointIndices(plant)


def texts(m):
    empty, seen = m.MathematicalProgram(), m.MathematicalProgram()
    seen.NewIndeterminates(1, "y")
    enums = m.Meshcat.SideOfFaceToRender.kFrontSide, m.MeshcatAnimation.LoopMode.kLoopOnce
    return [str(thing) for thing in (empty, seen, *enums)]


def license_of_gurobi(m):
    with m.GurobiSolver.AcquireLicense():
        return m.GurobiSolver.AcquireLicense().is_valid()


def distributions_of_one_number(m):
    schema = importlib.import_module(f"{m.__name__.split('.')[0]}.common.schema")
    numbers = schema.Deterministic(3.0), schema.Gaussian(1.0, 2.0)
    return [schema.ToDistributionVector(number).Mean().tolist() for number in numbers]


def bounded(m):
    return m.Hyperellipsoid.MakeUnitBall(2).IsBounded() is True


ANSWERS = (
    angles_without_limits, texts, license_of_gurobi, distributions_of_one_number, bounded,
    copies_of_an_empty_constraint,
    poses_of_half_spaces, names_of_new_variables, linear_constraints, colors_of_points, topology,
    rate_before_the_first_step, groups_as_text, meshes,
)  # fmt: skip


@pytest.mark.parametrize("answer", ANSWERS, ids=lambda a: a.__name__)
def test_answer_is_the_same(answer):
    ours, theirs = map(answer, LIBRARIES)
    if answer is poses_of_half_spaces:
        np.testing.assert_allclose(ours, theirs, atol=1e-14)
    else:
        assert ours == theirs


def one_force_on_a_ball_joint(m):
    plant = m.MultibodyPlant(0.0)
    body = plant.AddRigidBody("b", m.SpatialInertia.SolidSphereWithMass(1, 1))
    joint = plant.AddJoint(m.BallRpyJoint("j", plant.world_frame(), body.body_frame()))
    plant.Finalize()
    joint.AddInOneForce(plant.CreateDefaultContext(), 0, 1.0, m.MultibodyForces(plant))


def lock_of_a_body_on_a_joint(m):
    plant = m.MultibodyPlant(0.01)
    body = plant.AddRigidBody("b", m.SpatialInertia.SolidSphereWithMass(1, 1))
    plant.AddJoint(m.RevoluteJoint("j", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.Finalize()
    body.Lock(plant.CreateDefaultContext())


def dynamics_of_another_variable(m):
    x, y = m.Variable("x"), m.Variable("y")
    m.SymbolicVectorSystem(dynamics=[-x], state=[x]).dynamics_for_variable(y)


def coefficients_of_another_size(m):
    m.LorentzConeConstraint(np.eye(3), np.zeros(3)).UpdateCoefficients(np.eye(3, 2), np.zeros(3))


def solution_of_another_size(m):
    program = m.MathematicalProgram()
    program.NewContinuousVariables(2)
    m.Solve(program).set_x_val([1.0])


FAULTS = (
    one_force_on_a_ball_joint, lock_of_a_body_on_a_joint, dynamics_of_another_variable, coefficients_of_another_size,
    solution_of_another_size,
)  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.__name__)
def test_error_is_the_same(fault):
    errors = []
    for m in LIBRARIES:
        with pytest.raises(Exception) as caught:
            fault(m)
        errors.append(caught.type)
    assert errors[0] is errors[1]


def set_and_got(m, one, name, value):
    """What a field holds after it was set, or the error."""
    try:
        setattr(one, name, value)
    except (AttributeError, TypeError) as error:
        return "AttributeError" if isinstance(error, AttributeError) else "TypeError"
    got = getattr(one, name)
    return type(got).__name__, np.asarray(got).tolist() if not hasattr(got, "is_valid") else got.is_valid()


SETTABLE = {
    "SignedDistancePair": ("distance", "nhat_BA_W", "p_ACa", "id_A", "depth", "misspelt"),
    "SignedDistanceToPoint": ("distance", "grad_W", "p_GN", "id_G", "misspelt"),
    "PenetrationAsPointPair": ("depth", "p_WCa", "nhat_BA_W", "id_B", "misspelt"),
    "ExternallyAppliedSpatialForce": ("p_BoBq_B",),
}


@pytest.mark.parametrize("kind", SETTABLE)
def test_fields_become_what_they_are(kind):
    for name in SETTABLE[kind]:
        for value in (1, 0.5, "text", None, [1, 2, 3], np.arange(3)):
            mine, theirs = ([set_and_got(m, getattr(m, kind)(), name, value)] for m in LIBRARIES)
            if theirs[0] in ("TypeError", "AttributeError"):
                assert isinstance(mine[0], str), (kind, name, value)
            else:
                assert mine == theirs, (kind, name, value)


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("GraphOfConvexSetsOptions", "preprocessing", 1),
        ("GraphOfConvexSetsOptions", "convex_relaxation", "yes"),
        ("GraphOfConvexSetsOptions", "max_rounded_paths", 2.5),
        ("GraphOfConvexSetsOptions", "solver_options", "Clarabel"),
        ("IrisOptions", "bounding_region", 0.5),
        ("IrisOptions", "starting_ellipse", "ball"),
    ],
)
def test_settings_become_what_they_are(kind, name, value):
    mine, theirs = ([], [])
    for m, found in zip(LIBRARIES, (mine, theirs), strict=True):
        options = getattr(m, kind)()
        try:
            setattr(options, name, value)
        except TypeError:
            found.append("TypeError")
        else:
            found.append(type(getattr(options, name)).__name__)
    assert mine == theirs


def test_soft_maxima_are_floats_of_python():
    for m in LIBRARIES:
        for call in (m.SoftOverMax, m.SoftUnderMax, m.SoftOverMin, m.SoftUnderMin):
            assert type(call(np.array([0.5, 1.0]))) is float
