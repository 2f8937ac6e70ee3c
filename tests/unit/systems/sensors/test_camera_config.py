"""CameraConfig and what ApplyCameraConfig makes of it."""

import numpy as np
import pytest

from sheldrake.common.schema import Transform
from sheldrake.common.yaml import yaml_dump_typed, yaml_load_typed
from sheldrake.geometry import (
    MakeRenderEngineGl,
    MakeRenderEngineVtk,
    RenderEngineGlParams,
    RenderEngineVtkParams,
    Rgba,
    Sphere,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.multibody.tree import FixedOffsetFrame, SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.sensors import ApplyCameraConfig, CameraConfig, RgbdSensor, RgbdSensorAsync
from sheldrake.visualization import VideoWriter


@pytest.fixture
def made():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    body = plant.AddRigidBody("arm", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.RegisterVisualGeometry(body, RigidTransform(), Sphere(0.1), "ball", [1, 0, 0, 1])
    plant.AddFrame(FixedOffsetFrame("wrist", body, RigidTransform([0, 0, 0.5])))
    plant.Finalize()
    return builder, plant, scene_graph


def test_defaults_are_drakes():
    config = CameraConfig()
    assert (config.width, config.height, config.fps, config.z_near, config.z_far) == (640, 480, 10.0, 0.1, 5.0)
    assert (config.clipping_near, config.clipping_far, config.renderer_name) == (0.01, 500.0, "default")
    assert (config.rgb, config.depth, config.label, config.name) == (True, False, False, "preview_camera")
    assert config.focal_x() == config.focal_y() == pytest.approx(240 / np.tan(np.pi / 8))
    assert config.principal_point().tolist() == [319.5, 239.5]
    assert np.array_equal(config.background.rgba, [204 / 255, 229 / 255, 1, 1])


@pytest.mark.parametrize(
    ("focal", "expected"),
    [
        (CameraConfig.FocalLength(x=100), (100, 100)),
        (CameraConfig.FocalLength(y=120), (120, 120)),
        (CameraConfig.FocalLength(x=100, y=120), (100, 120)),
        (CameraConfig.FovDegrees(x=60), (320 * 3**0.5, 320 * 3**0.5)),
        (CameraConfig.FovDegrees(x=60, y=90), (320 * 3**0.5, 240)),
    ],
)
def test_lenses(focal, expected):
    config = CameraConfig(focal=focal, center_x=100.0)
    assert (config.focal_x(), config.focal_y()) == pytest.approx(expected)
    lens = config.MakeCameras()[0].core().intrinsics()
    assert (lens.focal_x(), lens.focal_y(), lens.center_x(), lens.center_y()) == pytest.approx((*expected, 100, 239.5))


def test_cameras_of_a_configuration():
    config = CameraConfig(
        X_BC=Transform(translation=[1, 0, 0]), X_BD=Transform(translation=[2, 0, 0]), show_rgb=True, clipping_near=0.05
    )
    color, depth = config.MakeCameras()
    assert color.show_window() and color.core().clipping().near() == 0.05
    assert color.core().sensor_pose_in_camera_body().translation().tolist() == [1, 0, 0]
    assert depth.core().sensor_pose_in_camera_body().translation().tolist() == [2, 0, 0]
    assert depth.depth_range().max_depth() == 5.0 and depth.core().renderer_name() == "default"


def test_yaml_both_ways():
    text = """
width: 320
focal: !FocalLength { x: 300 }
X_PB: { base_frame: wrist, translation: [0, 0, 1], rotation: !Rpy { deg: [90, 0, 0] } }
renderer_class: !RenderEngineVtkParams { default_diffuse: [1, 0, 0, 1] }
background: { rgba: [0, 0, 0, 1] }
"""
    config = yaml_load_typed(schema=CameraConfig, data=text)
    assert config.focal_x() == 300 and config.X_PB.base_frame == "wrist" and config.height == 480
    assert config.renderer_class.default_diffuse.tolist() == [1, 0, 0, 1] and config.background.r() == 0
    again = yaml_load_typed(schema=CameraConfig, data=yaml_dump_typed(config))
    assert yaml_dump_typed(again) == yaml_dump_typed(config)
    plain = yaml_load_typed(schema=CameraConfig, data="focal: !FovDegrees { y: 30 }\nrenderer_class: RenderEngineGl\n")
    assert plain.focal.y == 30 and plain.renderer_class == "RenderEngineGl"


def test_a_camera_is_added(made):
    builder, plant, scene_graph = made
    where = Transform(base_frame="wrist", translation=[0, 0, -2.5])
    middle = {"center_x": 32.5, "center_y": 24.5}  # pixel (32, 24) looks straight ahead
    ApplyCameraConfig(CameraConfig(name="eye", X_PB=where, depth=True, width=64, height=48, **middle), builder)
    sensor = builder.GetSubsystemByName("rgbd_sensor_eye")
    assert isinstance(sensor, RgbdSensor) and scene_graph.GetRendererTypeName("default").endswith("RenderEngineVtk")
    assert sensor.default_parent_frame_id() == plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("arm").index())
    assert sensor.default_X_PB().translation().tolist() == [0, 0, -2.0]  # the wrist is fixed to the arm
    diagram = builder.Build()
    context = sensor.GetMyContextFromRoot(diagram.CreateDefaultContext())
    assert sensor.color_image_output_port().Eval(context).data[24, 32, :3].tolist() == [255, 0, 0]
    assert sensor.depth_image_32F_output_port().Eval(context).data[24, 32, 0] == pytest.approx(1.9, abs=1e-6)


def test_delayed_cameras_have_only_what_they_were_asked_for(made):
    builder, plant, scene_graph = made
    config = CameraConfig(name="slow", output_delay=0.05, capture_offset=0.01, rgb=False, depth=True)
    ApplyCameraConfig(config, builder, plant=plant, scene_graph=scene_graph)
    sensor = builder.GetSubsystemByName("rgbd_sensor_slow")
    assert isinstance(sensor, RgbdSensorAsync) and sensor.default_color_render_camera() is None
    assert (sensor.fps(), sensor.capture_offset(), sensor.output_delay()) == (10.0, 0.01, 0.05)


def test_nothing_is_added_without_images(made):
    builder, _, scene_graph = made
    before = len(builder.GetSystems())
    ApplyCameraConfig(CameraConfig(rgb=False, name=""), builder)
    assert len(builder.GetSystems()) == before and scene_graph.RendererCount() == 0


def test_engines_are_made_once_and_must_fit(made):
    builder, _, scene_graph = made
    ApplyCameraConfig(CameraConfig(name="a", background=Rgba(0, 0, 0)), builder)
    assert "default_clear_color: [0.0, 0.0, 0.0]" in scene_graph.GetRendererParameterYaml("default")
    ApplyCameraConfig(CameraConfig(name="b", renderer_class="RenderEngineVtk"), builder)
    same = RenderEngineVtkParams(default_clear_color=[0, 0, 0])
    ApplyCameraConfig(CameraConfig(name="c", renderer_class=same), builder)
    gl = CameraConfig(name="d", renderer_name="gl", renderer_class=RenderEngineGlParams())
    ApplyCameraConfig(gl, builder)
    assert scene_graph.RegisteredRendererNames() == ["default", "gl"]
    assert scene_graph.GetRendererTypeName("gl").endswith("RenderEngineGl")
    with pytest.raises(RuntimeError, match="already exists and doesn't match"):
        ApplyCameraConfig(CameraConfig(name="e", renderer_class=RenderEngineVtkParams()), builder)
    with pytest.raises(RuntimeError, match="already used with a different type"):
        ApplyCameraConfig(CameraConfig(name="f", renderer_class="RenderEngineGl"), builder)
    ApplyCameraConfig(CameraConfig(name="g", renderer_name="g", renderer_class="RenderEngineGltfClient"), builder)
    assert scene_graph.GetRendererTypeName("g").endswith("RenderEngineGltfClient")


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        ({"fps": -1}, r"FPS \(-1\) must be a finite, positive"),
        ({"fps": np.inf}, "FPS"),
        ({"name": ""}, "name cannot be empty"),
        ({"renderer_name": ""}, "renderer_name cannot be empty"),
        ({"renderer_class": "Foo"}, "'Foo' must be empty"),
        ({"width": -1}, "Invalid camera configuration|invalid camera configuration"),
        ({"z_near": -1}, "depth range"),
        ({"clipping_near": 200}, "extends beyond the clipping planes"),
        ({"focal": CameraConfig.FocalLength()}, "at least x or y for FocalLength"),
        ({"focal": CameraConfig.FovDegrees()}, "at least x or y for FovDegrees"),
        ({"capture_offset": -1.0}, "capture_offset"),
        ({"X_PB": Transform(base_frame="nobody")}, "nobody"),
    ],
)
def test_configurations_that_make_no_sense(wrong, match, made):
    builder, _, scene_graph = made
    before = len(builder.GetSystems())
    with pytest.raises(RuntimeError, match=match):
        ApplyCameraConfig(CameraConfig(**wrong), builder)
    assert len(builder.GetSystems()) == before and scene_graph.RendererCount() == 0


def test_renderers_that_are_there_are_used(made):
    builder, _, scene_graph = made
    scene_graph.AddRenderer("default", MakeRenderEngineGl())
    ApplyCameraConfig(CameraConfig(), builder)
    assert scene_graph.RendererCount() == 1
    scene_graph.AddRenderer("other", MakeRenderEngineVtk(RenderEngineVtkParams()))
    assert builder.HasSubsystemNamed("rgbd_sensor_preview_camera")


def test_a_film_of_a_camera_fixed_in_the_world(made, tmp_path):
    PIL_Image = pytest.importorskip("PIL.Image")
    builder, _, _ = made
    film = tmp_path / "film.gif"
    kinds = ["color", "depth", "label"]
    writer = VideoWriter.AddToBuilder(
        filename=film, builder=builder, sensor_pose=RigidTransform([0, 0, -2]), width=64, height=48, kinds=kinds
    )
    Simulator(builder.Build()).AdvanceTo(0.3)
    writer.Save()
    with PIL_Image.open(film) as pictures:
        assert pictures.size == (192, 48) and pictures.n_frames == 5
        first = np.asarray(pictures.convert("RGB"))
    assert np.abs(first[24, 32].astype(int) - [240, 0, 0]).max() < 16 and (first[24, 96] > 200).all()
