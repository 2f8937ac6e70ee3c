"""What the visualizers draw, and what their options are, against pydrake's own page."""

import importlib
import time

import numpy as np
import pytest

pytest.importorskip("pydrake")

from newer_settings import newer_than
from pydrake_page import drawn

pytestmark = pytest.mark.peer

BALLS = """<sdf version='1.7'><model name='{0}'><link name='ball'><inertial><mass>{1}</mass></inertial>
<collision name='c1'><geometry><sphere><radius>.1</radius></sphere></geometry></collision>
<collision name='c2'><pose>0.5 0 0 0 0 0</pose><geometry><sphere><radius>.1</radius></sphere></geometry></collision>
</link></model></sdf>"""

ARM = """<robot name='r'><link name='base'/><link name='l1'><inertial><mass value='2'/><origin xyz='1 2 3'/>
<inertia ixx='.1' iyy='.2' izz='.25' ixy='.01' ixz='.02' iyz='0'/></inertial></link><link name='l2'/>
<joint name='j1' type='revolute'><axis xyz='0 0 1'/><parent link='base'/><child link='l1'/>
<limit lower='-1' upper='2' effort='1'/></joint>
<joint name='j2' type='prismatic'><axis xyz='0 0 1'/><parent link='l1'/><child link='l2'/></joint></robot>"""


def of(library, module):
    return importlib.import_module(f"{library}.{module}")


def plant_of(library, models, kind="urdf"):
    builder = of(library, "systems.framework").DiagramBuilder()
    plant, scene_graph = of(library, "multibody.plant").AddMultibodyPlantSceneGraph(builder, 1e-3)
    for model in models:
        of(library, "multibody.parsing").Parser(plant).AddModelsFromString(model, kind)
    return builder, plant, scene_graph


def ours(meshcat):
    return {
        path: {"object": e.object, "pose": e.pose, "properties": e.properties}
        for path, e in meshcat._hub.tree.items()
        if e.object is not None or e.pose is not None or e.properties
    }


@pytest.fixture(autouse=True)
def drakes_contact_points(monkeypatch):
    from sheldrake.geometry._state.state import GeometryState

    monkeypatch.setattr(GeometryState, "point_contact_algorithm", "single_point")


def contacts(library, models):
    """What is drawn of balls at rest on a plate."""
    builder, plant, _ = plant_of(library, models, "sdf")
    X = of(library, "math").RigidTransform
    friction = of(library, "multibody.plant").CoulombFriction(0.5, 0.5)
    plate = of(library, "geometry").Box(10, 10, 1)
    plant.RegisterCollisionGeometry(plant.world_body(), X([0, 0, -0.5]), plate, "g", friction)
    plant.Finalize()
    meshcat = of(library, "geometry").Meshcat()
    of(library, "multibody.meshcat").ContactVisualizer.AddToBuilder(builder, plant, meshcat)
    simulator = of(library, "systems.analysis").Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for i in range(len(models)):
        instance = plant.GetModelInstanceByName("ab"[i])
        plant.SetFreeBodyPose(context, plant.GetBodyByName("ball", instance), X([0, 2.0 * i, 0.1]))
    simulator.AdvanceTo(0.5)
    return drawn(meshcat) if library == "pydrake" else ours(meshcat)


@pytest.mark.parametrize("names", ["a", "ab"])
def test_contact_arrows_have_drakes_paths_places_and_lengths(names):
    models = [BALLS.format(name, 1 + i) for i, name in enumerate(names)]
    theirs, mine = contacts("pydrake", models), contacts("sheldrake", models)
    arrows = [path for path in theirs if "/point/" in path]
    assert len(arrows) == 4 * len(names)
    for path in arrows:
        assert (theirs[path]["object"] is None) == (mine[path]["object"] is None), path
        if path.endswith("cylinder"):
            assert mine[path]["properties"]["scale"] == pytest.approx(theirs[path]["properties"]["scale"], rel=1e-6)
            geometry = theirs[path]["object"]["geometries"][0]
            assert mine[path]["object"].shape.radius() == geometry["radiusTop"] == geometry["radiusBottom"]
            assert mine[path]["object"].shape.length() == geometry["height"]
        else:
            assert np.allclose(mine[path]["pose"], theirs[path]["pose"][:3], atol=1e-6), path
    assert {path for path in mine if "/point/" in path} == set(arrows)


@pytest.mark.parametrize("module, name", [
    ("multibody.meshcat", "ContactVisualizerParams"),
    ("visualization", "VisualizationConfig"),
    ("geometry", "MeshcatVisualizerParams"),
])  # fmt: skip
def test_options_have_drakes_names_and_defaults(module, name):
    theirs, mine = (getattr(of(library, module), name) for library in ("pydrake", "sheldrake"))
    newer = newer_than(theirs, f"{module}.{name}")
    assert [f.name for f in mine.__fields__ if f.name not in newer] == [f.name for f in theirs.__fields__]
    for field in theirs.__fields__:
        a, b = getattr(theirs(), field.name), getattr(mine(), field.name)
        assert repr(a).rpartition(".")[2] == repr(b).rpartition(".")[2] or a == b, field.name


@pytest.mark.parametrize("options", [
    {}, {"lower_limit": -0.5, "upper_limit": 0.5}, {"step": 0.25}, {"lower_limit": 5.0}, {"upper_limit": -50.0},
    {"initial_value": np.linspace(-0.3, 0.7, 9)},
])  # fmt: skip
def test_joint_sliders_are_drakes(options):
    found = []
    for library in ("pydrake", "sheldrake"):
        _, plant, _ = plant_of(library, [ARM])
        plant.Finalize()
        meshcat = of(library, "geometry").Meshcat()
        sliders = of(library, "multibody.meshcat").JointSliders(meshcat, plant, **options)
        first = sliders.get_output_port().Eval(sliders.CreateDefaultContext())
        ends = [[meshcat.SetSliderValue(n, v) for v in (-99.0, 0.1234, 99.0)] for n in meshcat.GetSliderNames()]
        found.append((meshcat.GetSliderNames(), first.tolist(), ends))
    assert found[0][0] == found[1][0]
    assert found[1][1] == pytest.approx(found[0][1], abs=1e-12)
    assert np.allclose(found[0][2], found[1][2], atol=1e-12)


def standard(library):
    """What the standard configuration draws of an arm."""
    builder, plant, _ = plant_of(library, [ARM])
    plant.Finalize()
    meshcat = of(library, "geometry").Meshcat()
    visualization = of(library, "visualization")
    config = visualization.VisualizationConfig(enable_alpha_sliders=True)
    visualization.ApplyVisualizationConfig(config, builder, meshcat=meshcat)
    names = [s.get_name() for s in builder.GetSystems() if "meshcat" in s.get_name() or "inertia" in s.get_name()]
    diagram = builder.Build()
    diagram.ForcedPublish(diagram.CreateDefaultContext())
    return names, meshcat.GetSliderNames(), drawn(meshcat) if library == "pydrake" else ours(meshcat)


def test_standard_visualization_adds_and_draws_what_drakes_does():
    theirs, mine = standard("pydrake"), standard("sheldrake")
    assert mine[:2] == theirs[:2]
    inertias = [path for path in theirs[2] if "/InertiaVisualizer/" in path]
    assert len(inertias) == 6
    for path in inertias:
        a, b = mine[2][path]["pose"], theirs[2][path]["pose"][:3]
        assert np.allclose(a[:, 3], b[:, 3], atol=1e-9), path
        # An ellipsoid's axes may point either way.
        assert np.allclose(np.abs(np.sum(a[:, :3] * b[:, :3], axis=0)), 1, atol=1e-9), path
        if "$inertia" in path:
            half_axes = np.array(theirs[2][path]["object"]["object"]["matrix"])[[0, 5, 10]]
            shape = mine[2][path]["object"].shape
            assert [shape.a(), shape.b(), shape.c()] == pytest.approx(half_axes, rel=1e-9)
            assert mine[2][path]["object"].rgba.rgba.tolist() == [0, 0, 1, 1]
    for prefix in ("illustration", "proximity", "inertia"):
        path = f"/drake/{prefix}"
        assert mine[2][path]["properties"]["visible"] == theirs[2][path]["properties"]["visible"]


def test_a_wrong_ellipsoid_is_caught():
    """The oracle sees a density of 1001 instead of 1000 kg/m^3."""
    from sheldrake.visualization import _inertia_visualizer

    density = _inertia_visualizer._DENSITY
    _inertia_visualizer._DENSITY = 1001.0
    try:
        with pytest.raises(AssertionError):
            test_standard_visualization_adds_and_draws_what_drakes_does()
    finally:
        _inertia_visualizer._DENSITY = density


def friction_unsaid(library):
    """State after 0.2 s of a ball sliding on ground, neither of which says its friction."""
    builder, plant, _ = plant_of(library, [])
    X, shapes = of(library, "math").RigidTransform, of(library, "geometry")
    M = of(library, "multibody.tree").SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    ball = plant.AddRigidBody("ball", M)
    plant.RegisterCollisionGeometry(ball, X(), shapes.Sphere(0.1), "shell", shapes.ProximityProperties())
    plant.RegisterCollisionGeometry(plant.world_body(), X(), shapes.HalfSpace(), "g", shapes.ProximityProperties())
    plant.Finalize()
    simulator = of(library, "systems.analysis").Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositionsAndVelocities(context, [1, 0, 0, 0, 0, 0, 0.1, 0, 0, 0, 1, 0, 0])
    simulator.AdvanceTo(0.2)
    return plant.GetPositionsAndVelocities(context)


def test_geometry_without_friction_gets_the_scene_graphs():
    assert np.allclose(friction_unsaid("sheldrake"), friction_unsaid("pydrake"), rtol=1e-9, atol=1e-9)


def triads(library):
    """Axes of a body and of a frame: names, poses, colors, sizes."""
    _, plant, scene_graph = plant_of(library, [ARM])
    add, inspector = of(library, "visualization").AddFrameTriadIllustration, scene_graph.model_inspector()
    X = of(library, "math").RigidTransform([0.0, 0.0, 7.0])
    ids = add(scene_graph=scene_graph, body=plant.GetBodyByName("l1"))
    ids += add(scene_graph=scene_graph, frame=plant.GetFrameByName("j1_parent"), length=1.0, opacity=0.5, X_FT=X)
    found = []
    for g in ids:
        color = inspector.GetIllustrationProperties(g).GetProperty("phong", "diffuse")
        shape, pose = inspector.GetShape(g), inspector.GetPoseInFrame(g).GetAsMatrix34()
        found.append((inspector.GetName(g), pose, list(color.rgba), [shape.radius(), shape.length()]))
    return found


def test_triads_are_drakes():
    for mine, theirs in zip(triads("sheldrake"), triads("pydrake"), strict=True):
        assert mine[0] == theirs[0]
        # A cylinder looks the same turned about its axis, or upside down.
        assert np.allclose(np.abs(mine[1][:, 2]), np.abs(theirs[1][:, 2]), atol=1e-12)
        assert np.allclose(mine[1][:, 3], theirs[1][:, 3], atol=1e-12)
        assert mine[2] == pytest.approx(theirs[2]) and mine[3] == pytest.approx(theirs[3])


def colorized(library, shift=0.0):
    """Random depths and labels in color."""
    sensors, visualization = of(library, "systems.sensors"), of(library, "visualization")
    rng, found = np.random.default_rng(4), []
    depth, label = sensors.ImageDepth32F(31, 17), sensors.ImageLabel16I(31, 17)
    depth.mutable_data[...] = rng.uniform(0.5, 4, (17, 31, 1)) + shift
    depth.mutable_data[0, :3, 0] = [0, np.inf, np.nan]
    label.mutable_data[...] = rng.integers(0, 32768, (17, 31, 1))
    for system, image in ((visualization.ColorizeDepthImage(), depth), (visualization.ColorizeLabelImage(), label)):
        out = sensors.ImageRgba8U(1, 1)
        system.Calc(image, out)
        found.append(np.array(out.data))
    return found


def test_colors_of_images_are_drakes():
    for mine, theirs in zip(colorized("sheldrake"), colorized("pydrake"), strict=True):
        assert np.array_equal(mine, theirs)


SOFT_BALL = """<sdf version='1.7'><model name='a'><link name='ball'><inertial><mass>1</mass></inertial>
<collision name='soft'><geometry><sphere><radius>.1</radius></sphere></geometry>
<drake:proximity_properties><drake:compliant_hydroelastic/><drake:hydroelastic_modulus>1e5</drake:hydroelastic_modulus>
<drake:mesh_resolution_hint>.05</drake:mesh_resolution_hint></drake:proximity_properties></collision></link></model>
</sdf>"""


def surfaces(library):
    """What is drawn of a soft ball on a rigid plate."""
    builder, plant, _ = plant_of(library, [SOFT_BALL], "sdf")
    geometry, X = of(library, "geometry"), of(library, "math").RigidTransform
    rigid = geometry.ProximityProperties()
    friction = of(library, "multibody.plant").CoulombFriction(0.5, 0.5)
    geometry.AddContactMaterial(friction=friction, properties=rigid)
    geometry.AddRigidHydroelasticProperties(1.0, rigid)
    plant.RegisterCollisionGeometry(plant.world_body(), X([0, 0, -0.5]), geometry.Box(10, 10, 1), "g", rigid)
    plant.Finalize()
    meshcat = of(library, "geometry").Meshcat()
    of(library, "multibody.meshcat").ContactVisualizer.AddToBuilder(builder, plant, meshcat)
    simulator = of(library, "systems.analysis").Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, plant.GetBodyByName("ball"), X([0, 0, 0.1]))
    simulator.AdvanceTo(0.25)
    path = "/drake/contact_forces/hydroelastic/ball+world"
    if library == "sheldrake":
        return path, ours(meshcat)
    deadline = time.monotonic() + 60
    while path not in drawn(meshcat):  # pydrake draws surfaces in a thread of its own
        assert time.monotonic() < deadline
        time.sleep(0.1)
    time.sleep(0.5)
    return path, drawn(meshcat)


def test_contact_surfaces_and_their_arrows_are_drakes():
    path, theirs = surfaces("pydrake")
    _, mine = surfaces("sheldrake")
    assert np.allclose(mine[path]["pose"], theirs[path]["pose"][:3], atol=1e-6)
    force = f"{path}/force_C_W"
    # About the arrow's own axis its frame may be turned as it likes.
    assert np.allclose(mine[force]["pose"][:, 2:], theirs[force]["pose"][:3, 2:], atol=1e-6)
    assert np.allclose(mine[f"{force}/head"]["pose"], theirs[f"{force}/head"]["pose"][:3], atol=1e-6)
    for name in ("scale", "position"):
        a, b = (which[f"{force}/cylinder"]["properties"][name] for which in (mine, theirs))
        assert a == pytest.approx(b, rel=1e-5)
    colors = mine[f"{path}/contact_surface"]["object"].colors
    assert colors.min() >= 0 and colors.max() == 1, "the highest pressure is white"
