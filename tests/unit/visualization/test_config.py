"""Standard visualization: which visualizers a configuration adds."""

import copy

import pytest

from sheldrake.geometry import Meshcat, MeshcatVisualizer, Rgba, Role, SceneGraph
from sheldrake.lcm import DrakeLcm
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.lcm import LcmBuses
from sheldrake.visualization import AddDefaultVisualization, ApplyVisualizationConfig, VisualizationConfig


def diagram(finalized=True):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithDensity(500.0, 0.1))
    if finalized:
        plant.Finalize()
    return builder


def visualizers(builder):
    return {v._params.prefix: v._params for v in builder.GetSystems() if isinstance(v, MeshcatVisualizer)}


def test_default_shows_looks_and_collisions():
    builder, meshcat = diagram(), Meshcat(port=0)
    AddDefaultVisualization(builder, meshcat)
    found = visualizers(builder)
    assert found["illustration"].role == Role.kIllustration and found["illustration"].visible_by_default
    assert found["proximity"].role == Role.kProximity and not found["proximity"].visible_by_default
    assert found["proximity"].default_color == Rgba(0.8, 0, 0)
    assert found["inertia"].role == Role.kIllustration and not found["inertia"].visible_by_default
    assert builder.HasSubsystemNamed("meshcat_visualizer(illustration)")
    assert builder.HasSubsystemNamed("meshcat_contact_visualizer")
    assert builder.HasSubsystemNamed("inertia_visualizer")
    builder.Build()


def test_choices_are_passed_on():
    builder, meshcat = diagram(), Meshcat(port=0)
    config = VisualizationConfig(
        publish_proximity=False,
        publish_inertia=False,
        publish_contacts=False,
        publish_period=0.25,
        enable_alpha_sliders=True,
    )
    ApplyVisualizationConfig(config, builder, meshcat=meshcat)
    assert not builder.HasSubsystemNamed("meshcat_contact_visualizer")
    assert not builder.HasSubsystemNamed("inertia_visualizer")
    (params,) = visualizers(builder).values()
    assert params.publish_period == 0.25 and meshcat.GetSliderNames() == ["illustration α"]


def test_no_meshcat_is_made_when_not_wanted():
    builder = diagram()
    ApplyVisualizationConfig(VisualizationConfig(enable_meshcat_creation=False), builder)
    assert visualizers(builder) == {}


def test_errors_change_nothing():
    with pytest.raises(RuntimeError, match=r"call plant\.Finalize\(\) first"):
        AddDefaultVisualization(diagram(finalized=False), Meshcat(port=0))
    builder = DiagramBuilder()
    builder.AddNamedSystem("robot", SceneGraph())
    with pytest.raises(RuntimeError, match="no system named 'plant'; it has robot"):
        AddDefaultVisualization(builder, Meshcat(port=0))
    builder = diagram()
    with pytest.raises(RuntimeError, match="no LCM bus 'other'"):
        ApplyVisualizationConfig(VisualizationConfig(lcm_bus="other"), builder)
    assert visualizers(builder) == {}


def test_config_is_a_value():
    config = VisualizationConfig(publish_contacts=False)
    assert repr(copy.copy(config)) == repr(config) != repr(VisualizationConfig())
    assert [f.name for f in VisualizationConfig.__fields__][:2] == ["lcm_bus", "publish_period"]
    with pytest.raises(AttributeError, match="nothing"):
        VisualizationConfig(nothing=1)


def test_looks_collisions_and_contacts_are_published_where_a_bus_is_given():
    lcm, buses, channels = DrakeLcm("memq://"), LcmBuses(), set()
    lcm.SubscribeAllChannels(lambda channel, _: channels.add(channel))
    buses.Add("mine", lcm)
    for given in ({"lcm_buses": buses}, {"lcm": lcm}):
        builder = diagram()
        config = VisualizationConfig(lcm_bus="mine", enable_meshcat_creation=False)
        ApplyVisualizationConfig(config, builder, **given)
        built = builder.Build()
        built.ForcedPublish(built.CreateDefaultContext())
        while lcm.HandleSubscriptions(0):
            pass
        assert channels == {
            "CONTACT_RESULTS",
            *(f"DRAKE_VIEWER_{what}_ILLUSTRATION" for what in ("LOAD_ROBOT", "DRAW")),
            *(f"DRAKE_VIEWER_{what}_PROXIMITY" for what in ("LOAD_ROBOT", "DRAW")),
        }
        channels.clear()


def test_inertias_are_ellipsoids_of_water_that_only_their_own_visualizer_draws():
    builder, meshcat = diagram(), Meshcat(port=0)
    AddDefaultVisualization(builder, meshcat)
    built = builder.Build()
    built.ForcedPublish(built.CreateDefaultContext())
    tree = meshcat._hub.tree
    shape = tree.get("/drake/inertia/InertiaVisualizer/DefaultModelInstance/ball/$inertia(1)").object.shape
    radius = 0.1 * 0.5 ** (1 / 3)  # the ball's density is half that of water
    assert [shape.a(), shape.b(), shape.c()] == pytest.approx([radius] * 3, rel=1e-12)
    assert tree.get("/drake/inertia").properties["visible"] is False
    assert not meshcat.HasPath("illustration/InertiaVisualizer")
