"""The discrete step with hydroelastic contact equals Drake's: states, forces on surfaces, forces on joints."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from hydro_plants import SCENES, Scene, library

from sheldrake.geometry._state.state import GeometryState
from sheldrake.multibody.plant._step import kernel_models

pytestmark = [pytest.mark.peer, pytest.mark.filterwarnings("ignore")]


@pytest.fixture(scope="module")
def libraries():
    return library("sheldrake"), library("pydrake")


def pair(libraries, name, **options):
    scenes = [Scene(lib, *SCENES[name], **options) for lib in libraries]
    for scene in scenes:
        if name == "box between two pads":
            scene.actuate(30.0, -30.0)
    return scenes


def assert_same(ours, drakes, steps, tolerance=1e-9):
    np.testing.assert_allclose(ours.run(steps), drakes.run(steps), rtol=0, atol=tolerance)
    assert ours.results().num_point_pair_contacts() == drakes.results().num_point_pair_contacts()
    a, b = ours.forces(), drakes.forces()
    assert a.shape == b.shape
    np.testing.assert_allclose(a, b, rtol=0, atol=100 * tolerance * max(1.0, np.abs(b).max(initial=0.0)))
    return len(a)


APPROXIMATIONS = ("kLagged", "kSimilar", "kSap", "kTamsi")


@pytest.mark.parametrize("representation", ["kPolygon", "kTriangle"])
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
@pytest.mark.parametrize("name", SCENES)
def test_one_step(libraries, name, approximation, representation):
    scenes = pair(libraries, name, approximation=approximation, representation=representation)
    if (approximation, representation, name) == ("kTamsi", "kTriangle", "box between two pads"):
        scenes = pair(libraries, name, approximation=approximation, representation=representation, time_step=1e-4)
    assert assert_same(*scenes, steps=1) > 0


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
@pytest.mark.parametrize("name", SCENES)
def test_a_hundred_steps(libraries, name, approximation):
    assert_same(*pair(libraries, name, approximation=approximation), steps=100)


def test_a_squeezed_box_and_what_its_joints_feel(libraries):
    ours, drakes = pair(libraries, "box between two pads")
    assert_same(ours, drakes, steps=60)
    assert len(ours.forces()) == 2
    forces = [
        np.array([f.get_coeffs() for f in s.plant.get_reaction_forces_output_port().Eval(s.context)])
        for s in (ours, drakes)
    ]
    np.testing.assert_allclose(*forces, rtol=0, atol=1e-8)
    tau = [
        s.plant.get_generalized_contact_forces_output_port(s.lib.ModelInstanceIndex(1)).Eval(s.context)
        for s in (ours, drakes)
    ]
    np.testing.assert_allclose(*tau, rtol=0, atol=1e-8)
    assert np.abs(tau[0]).max() > 1.0


@pytest.mark.parametrize("sampled", [True, False])
def test_results_before_and_after_the_first_step(libraries, sampled):
    scenes = pair(libraries, "soft box on rigid ground", sampled=sampled)
    before = [s.forces() for s in scenes]
    assert len(before[0]) == len(before[1]) == (0 if sampled else 1)
    if not sampled:
        np.testing.assert_allclose(*before, rtol=0, atol=1e-9)


def test_fallback_mixes_points_and_surfaces(libraries, monkeypatch):
    """A soft ball on a rigid ground beside a ball without representation, and a rigid one."""
    monkeypatch.setattr(GeometryState, "point_contact_algorithm", "single_point")
    balls = [
        ("Sphere", (0.1,), what, (0.1, 0.2, 0.3, x, 0, 0.0995), (0, 0, 0, 0.1, 0, 0))
        for x, what in ((0.0, {"soft": 0.03}), (0.19, {}), (0.5, {"rigid": 0.03}))
    ]
    ground = ("HalfSpace", (), {"rigid": 1.0})
    scenes = [
        Scene(lib, balls, ground, contact_model="kHydroelasticWithFallback") for lib in libraries
    ]  # fmt: skip
    assert assert_same(*scenes, steps=1) == 1
    assert scenes[0].results().num_point_pair_contacts() == 3
    scenes = [Scene(lib, balls[:2], ground, contact_model="kPoint") for lib in libraries]
    assert assert_same(*scenes, steps=10) == 0


def test_defaults_make_everything_compliant(libraries):
    bodies = [("Sphere", (0.1,), {"mu": 0.3}, (0.1, 0.2, 0.3, 0, 0, 0.098), (0, 0, 0, 0.1, 0, 0))]
    table = ("Box", (1.0, 1.0, 0.02), {"rigid": 1.0})
    defaults = {"compliance_type": "compliant", "hydroelastic_modulus": 2e6, "resolution_hint": 0.05}
    scenes = [
        Scene(lib, bodies, table, contact_model="kHydroelasticWithFallback", defaults=defaults) for lib in libraries
    ]
    assert assert_same(*scenes, steps=20) == 1


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_margins(libraries, approximation):
    bodies = [
        ("Box", (0.2, 0.2, 0.2), {"soft": 0.03, "margin": 0.002}, (0, 0, 0.2, 0, 0, 0.1005), (0, 0, 0, 0, 0, -0.1))
    ]
    ground = ("HalfSpace", (), {"rigid": 1.0})
    scenes = [Scene(lib, bodies, ground, approximation=approximation) for lib in libraries]
    assert_same(*scenes, steps=30)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
@pytest.mark.parametrize("tau", [0.0, 0.1])
def test_a_ball_whose_margin_alone_touches(libraries, approximation, tau):
    """With kSap, relaxation times slow down what is only within a margin, too."""
    what = {"soft": 0.03, "margin": 0.004, "tau": tau}
    bodies = [("Sphere", (0.1,), what, (0.1, 0.2, 0.3, 0, 0, 0.101), (0, 0, 0, 0.1, 0, -0.2))]
    ground = ("HalfSpace", (), {"rigid": 1.0})
    scenes = [Scene(lib, bodies, ground, approximation=approximation) for lib in libraries]
    assert assert_same(*scenes, steps=1) > 0
    assert_same(*scenes, steps=10)


@pytest.mark.parametrize("representation", ["kPolygon", "kTriangle"])
@pytest.mark.parametrize("margin", [None, 0.004])
@pytest.mark.parametrize("name", SCENES)
def test_derivatives_of_a_continuous_plant(libraries, name, margin, representation):
    bodies, ground = SCENES[name]
    bodies = [(shape, args, {**what, "margin": margin}, *rest) for shape, args, what, *rest in bodies]
    scenes = [Scene(lib, bodies, ground, representation=representation, time_step=0.0) for lib in libraries]
    rates, forces = [], []
    for scene in scenes:
        if name == "box between two pads":
            scene.actuate(3.0, -3.0)
        rates.append(scene.plant.EvalTimeDerivatives(scene.context).CopyToVector())
        forces.append(scene.forces())
    scale = np.abs(rates[1]).max()
    np.testing.assert_allclose(*rates, rtol=0, atol=1e-9 * scale)
    assert len(forces[0]) == len(forces[1]) > 0
    np.testing.assert_allclose(*forces, rtol=0, atol=1e-9 * np.abs(forces[1]).max())


@pytest.mark.parametrize("time_step, tolerance", [(0.0, 1e-9), (1e-3, 1e-5)])  # steps: those of the solvers
def test_derivatives_with_respect_to_the_state(libraries, time_step, tolerance):
    found = []
    for lib in libraries:
        autodiff = importlib.import_module(f"{lib.library}.autodiffutils")
        scene = Scene(lib, *SCENES["soft box on rigid ground"], time_step=time_step, sampled=False)
        diagram = scene.diagram.ToAutoDiffXd()
        plant = diagram.GetSubsystemByName("plant")
        context = plant.GetMyMutableContextFromRoot(diagram.CreateDefaultContext())
        plant.SetPositionsAndVelocities(context, autodiff.InitializeAutoDiff(scene.state()))
        if time_step:
            rates = plant.EvalUniquePeriodicDiscreteUpdate(context).get_vector().CopyToVector()
        else:
            rates = plant.EvalTimeDerivatives(context).CopyToVector()
        found.append(autodiff.ExtractGradient(rates))
    np.testing.assert_allclose(*found, rtol=0, atol=tolerance * np.abs(found[1]).max())


def test_a_continuous_plant_runs(libraries):
    scenes = [Scene(lib, *SCENES["soft sphere on rigid ground"], time_step=0.0) for lib in libraries]
    states = []
    for scene in scenes:
        simulator = scene.lib.Simulator(scene.diagram, scene.root)
        simulator.get_mutable_integrator().set_fixed_step_mode(True)
        simulator.get_mutable_integrator().set_maximum_step_size(1e-3)
        simulator.AdvanceTo(0.05)
        states.append(scene.state())
    np.testing.assert_allclose(*states, rtol=0, atol=1e-9)


def test_a_pressure_off_by_a_thousandth_is_noticed(libraries, monkeypatch):
    compile_hydro = kernel_models.compile_hydro

    def off(*args):
        pairs = compile_hydro(*args)
        pairs.model.field[:, :4] *= 1.001
        return pairs

    monkeypatch.setattr(kernel_models, "compile_hydro", off)
    with pytest.raises(AssertionError):
        assert_same(*pair(libraries, "two soft spheres"), steps=1)


URDF = """<robot name="{name}"><link name="link"><inertial><mass value="1"/>
<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial><collision name="c">
<geometry>{shape}</geometry><drake:proximity_properties>{tags}</drake:proximity_properties></collision></link></robot>"""


def test_parsed_properties(libraries, monkeypatch):
    """A compliant ball, a rigid box and a box with a margin, from URDF, on a compliant ground."""
    monkeypatch.setattr(GeometryState, "point_contact_algorithm", "single_point")
    soft = '<drake:compliant_hydroelastic/><drake:hydroelastic_modulus value="3e5"/>'
    soft += '<drake:mesh_resolution_hint value=".04"/><drake:hunt_crossley_dissipation value="4"/>'
    models = {
        "a": ('<sphere radius=".1"/>', soft, 0.2),
        "b": ('<box size=".2 .2 .1"/>', "<drake:rigid_hydroelastic/>", 0.048),
        "c": ('<box size=".2 .2 .2"/>', soft + '<drake:hydroelastic_margin value="0.001"/>', 0.396),
    }
    states, counts = [], []
    for lib in libraries:
        parser = importlib.import_module(f"{lib.library}.multibody.parsing").Parser
        builder = lib.DiagramBuilder()
        plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
        for name, (shape, tags, _) in models.items():
            parser(plant).AddModelsFromString(URDF.format(name=name, shape=shape, tags=tags), "urdf")
        ground = lib.ProximityProperties()
        lib.AddCompliantHydroelasticPropertiesForHalfSpace(0.1, 1e6, ground)
        lib.AddContactMaterial(friction=lib.CoulombFriction(0.6, 0.6), properties=ground)
        world = plant.world_body()
        plant.RegisterCollisionGeometry(world, lib.RigidTransform(), lib.HalfSpace(), "ground", ground)
        plant.Finalize()
        diagram = builder.Build()
        root = diagram.CreateDefaultContext()
        context = plant.GetMyMutableContextFromRoot(root)
        for k, (name, (*_, z)) in enumerate(models.items()):
            body = plant.GetBodyByName("link", plant.GetModelInstanceByName(name))
            X = lib.RigidTransform(lib.RollPitchYaw(0.01, 0.02 * k, 0.3), [0.01 * k, 0, z])
            plant.SetFreeBodyPose(context, body, X)
        lib.Simulator(diagram, root).AdvanceTo(0.03)
        results = plant.get_contact_results_output_port().Eval(context)
        states.append(plant.GetPositionsAndVelocities(context))
        counts.append((results.num_hydroelastic_contacts(), results.num_point_pair_contacts()))
    assert counts[0] == counts[1]
    assert counts[0][0] == 3
    np.testing.assert_allclose(*states, rtol=0, atol=1e-9)
