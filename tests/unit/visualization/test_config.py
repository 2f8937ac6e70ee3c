"""Standard visualization: which visualizers a configuration adds."""

import copy

import pytest

from sheldrake.geometry import Meshcat, MeshcatVisualizer, Rgba, Role, SceneGraph
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.visualization import AddDefaultVisualization, ApplyVisualizationConfig, VisualizationConfig


class Plant(LeafSystem):
    """As much of a MultibodyPlant as is asked for."""

    def __init__(self, finalized=True):
        super().__init__()
        self.finalized = finalized

    def is_finalized(self):
        return self.finalized


def diagram(finalized=True):
    builder = DiagramBuilder()
    builder.AddNamedSystem("plant", Plant(finalized))
    builder.AddNamedSystem("scene_graph", SceneGraph())
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
    assert builder.HasSubsystemNamed("meshcat_visualizer(illustration)")
    builder.Build()


def test_choices_are_passed_on():
    builder, meshcat = diagram(), Meshcat(port=0)
    config = VisualizationConfig(publish_proximity=False, publish_period=0.25, enable_alpha_sliders=True)
    ApplyVisualizationConfig(config, builder, meshcat=meshcat)
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
    builder.AddNamedSystem("robot", Plant())
    with pytest.raises(RuntimeError, match="no system named 'plant'; it has robot"):
        AddDefaultVisualization(builder, Meshcat(port=0))
    builder = diagram()
    with pytest.raises(RuntimeError, match="no LCM bus 'other'"):
        ApplyVisualizationConfig(VisualizationConfig(lcm_bus="other"), builder)
    assert visualizers(builder) == {}


def test_config_is_a_value():
    config = VisualizationConfig(publish_contacts=False)
    assert copy.copy(config) == config != VisualizationConfig()
    assert [f.name for f in VisualizationConfig.__fields__][:2] == ["lcm_bus", "publish_period"]
    with pytest.raises(TypeError):
        VisualizationConfig(nothing=1)
