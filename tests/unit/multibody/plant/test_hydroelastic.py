"""Hydroelastic contact of a plant: known forces, conservation, and what the contact models mean."""

import copy

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from sheldrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddCompliantHydroelasticPropertiesForHalfSpace,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    HalfSpace,
    HydroelasticContactRepresentation,
    ProximityProperties,
    SceneGraphConfig,
    Sphere,
)
from sheldrake.geometry._compiled import hydroelastic
from sheldrake.geometry._kernels.hydro_model import Mesh, empty_hydro_model
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw
from sheldrake.multibody.math import SpatialAcceleration_, SpatialForce_, SpatialVelocity, SpatialVelocity_
from sheldrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
    HydroelasticContactInfo,
)
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator, Simulator_
from sheldrake.systems.framework import DiagramBuilder

KINDS = HydroelasticContactRepresentation


def properties(rigid=None, soft=None, slab=None, modulus=1e6, mu=0.5, dissipation=10.0):
    p = ProximityProperties()
    if rigid is not None:
        AddRigidHydroelasticProperties(rigid, p)
    if soft is not None:
        AddCompliantHydroelasticProperties(soft, modulus, p)
    if slab is not None:
        AddCompliantHydroelasticPropertiesForHalfSpace(slab, modulus, p)
    AddContactMaterial(properties=p, friction=CoulombFriction(mu, mu), dissipation=dissipation)
    return p


class Scene:
    def __init__(self, *bodies, ground=None, model=ContactModel.kHydroelastic, kind=KINDS.kPolygon, gravity=True,
                 approximation=DiscreteContactApproximation.kLagged, config=None, time_step=1e-3):  # fmt: skip
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
        if config is not None:
            scene_graph.set_config(config)
        self.plant.set_contact_model(model)
        self.plant.set_contact_surface_representation(kind)
        if time_step:
            self.plant.set_discrete_contact_approximation(approximation)
        if not gravity:
            self.plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
        if ground is not None:
            world = self.plant.world_body()
            self.plant.RegisterCollisionGeometry(world, RigidTransform(), HalfSpace(), "ground", properties(**ground))
        for i, (shape, what, _) in enumerate(bodies):
            body = self.plant.AddRigidBody(f"body{i}", SpatialInertia.SolidBoxWithMass(2.0, 0.2, 0.2, 0.2))
            self.plant.RegisterCollisionGeometry(body, RigidTransform(), shape, f"shape{i}", properties(**what))
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        for i, (_, _, pose) in enumerate(bodies):
            body = self.plant.GetBodyByName(f"body{i}")
            self.plant.SetFreeBodyPose(self.context, body, RigidTransform(RollPitchYaw(pose[:3]), pose[3:]))

    def advance(self, time):
        simulator = Simulator(self.diagram, self.root)
        simulator.Initialize()
        simulator.AdvanceTo(time)
        return self

    def state(self):
        return self.plant.GetPositionsAndVelocities(self.context)

    def results(self):
        return self.plant.get_contact_results_output_port().Eval(self.context)

    def infos(self):
        results = self.results()
        return [results.hydroelastic_contact_info(i) for i in range(results.num_hydroelastic_contacts())]


WEIGHT = 2.0 * 9.81


@pytest.mark.parametrize("kind", [KINDS.kPolygon, KINDS.kTriangle])
@pytest.mark.parametrize("approximation", DiscreteContactApproximation)
def test_a_box_rests_as_deep_as_its_weight_presses_it(approximation, kind):
    """Rigid box on a slab: weight = E / t * depth * area."""
    ground = {"slab": 0.1, "modulus": 1e5, "dissipation": 5.0}
    box = (Box(0.2, 0.2, 0.2), {"rigid": 1.0}, (0, 0, 0.3, 0, 0, 0.0995))
    scene = Scene(box, ground=ground, approximation=approximation, kind=kind).advance(1.0)
    depth = 0.1 - scene.state()[6]
    assert depth == pytest.approx(WEIGHT / (1e5 / 0.1 * 0.04), rel=5e-3)
    assert np.abs(scene.state()[7:]).max() < 1e-3  # the solvers stop at a residual of 1e-6
    (info,) = scene.infos()  # A is the ground, which was registered first
    assert isinstance(info, HydroelasticContactInfo)
    surface, force = info.contact_surface(), info.F_Ac_W()
    assert surface.total_area() == pytest.approx(0.04 + 0.8 * depth, rel=1e-4)  # and the sides below ground
    assert surface.is_triangle() == (kind is KINDS.kTriangle)
    assert force.translational()[2] == pytest.approx(-WEIGHT, rel=5e-3)
    assert np.abs(force.rotational()).max() < 1e-2
    assert scene.results().num_point_pair_contacts() == 0
    tau = scene.plant.get_generalized_contact_forces_output_port(
        scene.plant.GetBodyByName("body0").model_instance()
    ).Eval(scene.context)
    assert tau[5] == pytest.approx(WEIGHT, rel=5e-3)


def test_a_box_slides_as_far_as_friction_lets_it():
    ground = {"slab": 0.1, "modulus": 1e6, "mu": 0.4}
    scene = Scene((Box(0.4, 0.4, 0.05), {"rigid": 1.0, "mu": 0.4}, (0, 0, 0, 0, 0, 0.025 - 1.22625e-5)), ground=ground)
    body = scene.plant.GetBodyByName("body0")
    scene.plant.SetFreeBodySpatialVelocity(scene.context, body, SpatialVelocity(np.array([0, 0, 0, 1.0, 0, 0])))
    scene.advance(0.2)
    v = scene.state()[7:]
    assert v[3] == pytest.approx(1.0 - 0.4 * 9.81 * 0.2, rel=0.02)


@pytest.mark.parametrize("second", [{"soft": 0.03, "modulus": 4e6}, {"rigid": 0.03}])
def test_a_collision_conserves_momentum(second):
    a = (Sphere(0.1), {"soft": 0.03}, (0.1, 0.2, 0.3, 0, 0, 0))
    b = (Box(0.2, 0.15, 0.1), second, (0.4, 0.1, 0.2, 0.03, 0.02, 0.16))
    scene = Scene(a, b, gravity=False)
    v = np.concatenate([[0.5, 1.0, -0.4, 0.1, 0, 0.5], [0.2, 0.3, 0.1, 0, -0.1, -0.5]])
    scene.plant.SetVelocities(scene.context, v)

    def momentum():
        M = [scene.plant.CalcSpatialMomentumInWorldAboutPoint(scene.context, np.zeros(3)).get_coeffs()]
        return np.array(M[0])

    def energy():
        return scene.plant.CalcKineticEnergy(scene.context)

    before, energies = momentum(), [energy()]
    simulator = Simulator(scene.diagram, scene.root)
    touched = 0
    for k in range(60):
        simulator.AdvanceTo(1e-3 * k)
        np.testing.assert_allclose(momentum()[3:], before[3:], atol=1e-12)
        energies.append(energy())
        touched += scene.results().num_hydroelastic_contacts()
    assert touched > 3
    assert energies[-1] < energies[0]
    assert (np.diff(momentum()[:3]) == np.diff(momentum()[:3])).all()  # finite
    np.testing.assert_allclose(momentum()[:3], before[:3], atol=2e-2)  # turns explicitly: of first order in the step


def test_contact_models():
    ball = (Sphere(0.1), {"soft": 0.03}, (0, 0, 0, 0, 0, 0.099))
    counts = {}
    for model in (ContactModel.kPoint, ContactModel.kHydroelastic, ContactModel.kHydroelasticWithFallback):
        scene = Scene(ball, ground={"rigid": 1.0}, model=model).advance(0.0)
        counts[model] = scene.results().num_point_pair_contacts(), scene.results().num_hydroelastic_contacts()
    assert counts[ContactModel.kPoint] == (1, 0)
    assert counts[ContactModel.kHydroelastic] == counts[ContactModel.kHydroelasticWithFallback] == (0, 1)


def test_only_hydroelastic_contact_refuses_what_has_no_surface():
    rigid = (Sphere(0.1), {"rigid": 0.03}, (0, 0, 0, 0, 0, 0.3))
    scene = Scene(rigid, ground={"rigid": 1.0})
    scene.advance(0.1)  # falls freely
    with pytest.raises(RuntimeError, match="Requested contact between two rigid objects") as error:
        scene.advance(0.5)
    assert "shape0" in str(error.value) and "ground" in str(error.value)
    with pytest.raises(RuntimeError, match="without hydroelastic representation"):
        Scene((Sphere(0.1), {}, (0, 0, 0, 0, 0, 0.09)), ground={"rigid": 1.0}).advance(0.0)
    fallback = ContactModel.kHydroelasticWithFallback
    assert Scene(rigid, ground={"rigid": 1.0}, model=fallback).advance(0.5).results().num_point_pair_contacts() == 1


def test_defaults_of_the_scene_graph_make_compliant_geometry():
    config = SceneGraphConfig()
    config.default_proximity_properties.compliance_type = "compliant"
    fallback = ContactModel.kHydroelasticWithFallback
    ball = (Sphere(0.1), {}, (0, 0, 0, 0, 0, 0.0999))
    scene = Scene(ball, ground={"rigid": 1.0}, model=fallback, config=config).advance(0.0)
    assert scene.results().num_hydroelastic_contacts() == 1


def test_plants_without_hydroelastic_geometry_have_no_stage_for_it():
    fallback = ContactModel.kHydroelasticWithFallback
    scene = Scene((Sphere(0.1), {}, (0, 0, 0, 0, 0, 0.1)), ground={}, model=fallback)
    parts = parts_of(scene.plant)
    models = parts.kernel_models.of(True, parts.kernel_models.compiled_geometry())
    names = [kernel.__name__ for kernel in parts.advance.equations.stages(models)]
    assert names == ["smooth_motion", "half_space_pairs", "contact_constraints", "prepare_hunt_crossley_contacts",
                     "solve_to_rest", "next_state_with_momentum"]  # fmt: skip
    work = scene.context._store.scratch(scene.context._node)
    assert sum(a.size for a in work.surfaces) <= 4


def test_clone_and_step_gives_the_same_bits():
    ball = (Sphere(0.1), {"soft": 0.05}, (0, 0, 0, 0, 0, 0.098))
    scene = Scene(ball, ground={"rigid": 1.0}).advance(0.01)
    clone = scene.root.Clone()
    other = scene.plant.GetMyContextFromRoot(clone)
    Simulator(scene.diagram, clone).AdvanceTo(0.05)
    scene.advance(0.05)
    assert np.array_equal(scene.plant.GetPositionsAndVelocities(other), scene.state())


def test_locked_joints_stay_where_they_are():
    ball = (Sphere(0.1), {"soft": 0.05}, (0, 0, 0, 0, 0, 0.098))
    scene = Scene(ball, ground={"rigid": 1.0})
    joint = scene.plant.get_joint(next(iter(scene.plant.GetJointIndices())))
    joint.Lock(scene.context)
    x = scene.state()
    np.testing.assert_array_equal(scene.advance(0.02).state(), x)


def test_too_many_faces_are_an_error_and_the_state_stays(monkeypatch):
    monkeypatch.setattr(hydroelastic, "MOST_OF_A_PAIR", 3)
    monkeypatch.setattr(hydroelastic, "MOST_FACES", 3)
    ball = (Sphere(0.1), {"soft": 0.03}, (0.1, 0.2, 0.3, 0, 0, 0.09))
    for time_step in (1e-3, 0.0):
        scene = Scene(ball, ground={"rigid": 1.0}, time_step=time_step)
        x = scene.state()
        with pytest.raises(RuntimeError, match="more faces than there is room"):
            scene.advance(0.01)
        np.testing.assert_array_equal(scene.state(), x)


def test_very_fine_meshes_do_not_take_all_memory():
    leaves = np.array([1 << 17, 1 << 17, 64], np.int64)
    model = empty_hydro_model()
    geometry = np.zeros((3, Mesh.SIZE), np.int64)
    geometry[:, Mesh.num_leaves] = leaves
    pair, family = np.array([[0, 1], [0, 2], [1, 2]], np.int64), np.array([0, 0, 0, 3, 3], np.int64)
    assert hydroelastic.face_capacity(model._replace(geometry=geometry, pair=pair, family=family)) == 1 << 16


def test_info_is_made_by_plants_only():
    with pytest.raises(TypeError, match="No constructor defined"):
        HydroelasticContactInfo()
    ball = (Sphere(0.1), {"soft": 0.05}, (0, 0, 0, 0, 0, 0.098))
    (info,) = Scene(ball, ground={"rigid": 1.0}).advance(0.0).infos()
    for twin in (copy.copy(info), copy.deepcopy(info)):
        np.testing.assert_array_equal(twin.F_Ac_W().get_coeffs(), info.F_Ac_W().get_coeffs())
        assert twin.contact_surface().Equal(info.contact_surface())


@pytest.mark.parametrize("kind", [KINDS.kPolygon, KINDS.kTriangle])
def test_a_continuous_plant_comes_to_rest_at_the_same_depth(kind):
    ground = {"slab": 0.1, "modulus": 1e5, "dissipation": 5.0}
    box = (Box(0.2, 0.2, 0.2), {"rigid": 1.0}, (0, 0, 0.3, 0, 0, 0.0995))
    scene = Scene(box, ground=ground, kind=kind, time_step=0.0)
    vdot = scene.plant.EvalTimeDerivatives(scene.context).CopyToVector()[7:]
    lift = 1e5 / 0.1 * 5e-4 * 0.04  # force of the pressure at half a millimetre
    np.testing.assert_allclose(vdot, [0, 0, 0, 0, 0, lift / 2.0 - 9.81], atol=1e-9)
    (info,) = scene.infos()
    np.testing.assert_allclose(info.F_Ac_W().get_coeffs(), [0, 0, 0, 0, 0, -lift], atol=1e-9)
    scene.advance(0.5)
    assert 0.1 - scene.state()[6] == pytest.approx(WEIGHT / (1e5 / 0.1 * 0.04), rel=5e-3)


def test_a_continuous_plant_refuses_what_has_no_surface():
    scene = Scene((Sphere(0.1), {"rigid": 0.03}, (0, 0, 0, 0, 0, 0.09)), ground={"rigid": 1.0}, time_step=0.0)
    with pytest.raises(RuntimeError, match="Requested contact between two rigid objects"):
        scene.plant.EvalTimeDerivatives(scene.context)


@pytest.mark.parametrize("time_step", [1e-3, 0.0])
def test_ports_of_a_plant_of_duals_give_duals(time_step):
    ball = (Sphere(0.1), {"soft": 0.05}, (0.1, 0.2, 0.3, 0, 0, 0.095))
    scene = Scene(ball, ground={"rigid": 1.0}, time_step=time_step)
    dual = scene.diagram.ToAutoDiffXd()
    plant = dual.GetSubsystemByName("plant")
    root = dual.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    plant.SetPositionsAndVelocities(context, InitializeAutoDiff(scene.state()))
    if time_step:
        Simulator_[AutoDiffXd](dual, root).AdvanceTo(0.0)
    classes = {
        "body_poses": RigidTransform_,
        "body_spatial_velocities": SpatialVelocity_,
        "body_spatial_accelerations": SpatialAcceleration_,
        "reaction_forces": SpatialForce_,
    }
    for name, family in classes.items():
        assert type(plant.GetOutputPort(name).Eval(context)[0]) is family[AutoDiffXd], name
    info = plant.get_contact_results_output_port().Eval(context).hydroelastic_contact_info(0)
    force = info.F_Ac_W()
    assert type(force) is SpatialForce_[AutoDiffXd]
    lift = force.translational()[2].derivatives()[6]  # of the force on the ground, by the ball's height
    assert lift > 1e3
    assert info.contact_surface().total_area().derivatives()[6] < 0.0
