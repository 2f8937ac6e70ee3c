"""Cameras in diagrams: what they see, where they are, when."""

import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.perception import BaseField, DepthImageToPointCloud
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.sensors import CameraInfo, RgbdSensor, RgbdSensorAsync, RgbdSensorDiscrete

LENS = CameraInfo(64, 48, 50.0, 60.0, 30.5, 22.5)  # pixel (30, 22) looks straight ahead
MIDDLE = (22, 30)
DOWN = RotationMatrix.MakeXRotation(np.pi)
PORTS = ["color_image", "depth_image_32f", "depth_image_16u", "label_image", "body_pose_in_world", "image_time"]


def cameras(lens=LENS, X_BS=None):
    core = g.RenderCameraCore("r", lens, g.ClippingRange(0.05, 100.0), X_BS or RigidTransform())
    return g.ColorRenderCamera(core), g.DepthRenderCamera(core, g.DepthRange(0.1, 50.0))


class Falling:
    """A red ball of 0.1 m that falls past cameras, over a plate at z = -1."""

    def __init__(self, *sensors, period=0.001):
        self.builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(self.builder, period)
        self.ball = self.plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        self.plant.RegisterVisualGeometry(self.ball, RigidTransform(), g.Sphere(0.1), "ball", [1, 0, 0, 1])
        plate = g.Box(4, 4, 0.2)
        X_WP = RigidTransform([0, 0, -1.1])
        self.plant.RegisterVisualGeometry(self.plant.world_body(), X_WP, plate, "plate", [0, 0, 1, 1])
        self.plant.Finalize()
        self.scene_graph.AddRenderer("r", g.MakeRenderEngineVtk(g.RenderEngineVtkParams()))
        self.world = self.scene_graph.world_frame_id()
        self.sensors = [make(self) for make in sensors]
        for sensor in self.sensors:
            self.builder.AddSystem(sensor)
            self.builder.Connect(self.scene_graph.get_query_output_port(), sensor.get_input_port())

    def build(self):
        self.diagram = self.builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = self.simulator.get_mutable_context()
        return self

    def put(self, z):
        self.plant.SetFreeBodyPose(self.plant.GetMyContextFromRoot(self.context), self.ball, RigidTransform([0, 0, z]))

    def see(self, sensor, port):
        value = sensor.GetOutputPort(port).Eval(sensor.GetMyContextFromRoot(self.context))
        return value.data if hasattr(value, "data") and port.endswith(("image", "f", "u")) else value


def above(scene):
    return RgbdSensor(scene.world, RigidTransform(DOWN, [0, 0, 2]), *cameras())


def test_all_ports_show_the_scene():
    scene = Falling(above).build()
    (sensor,) = scene.sensors
    assert [sensor.get_output_port(k).get_name() for k in range(6)] == PORTS
    assert sensor.query_object_input_port().get_name() == "geometry_query"
    scene.put(0.5)
    assert scene.see(sensor, "color_image")[MIDDLE].tolist() == [255, 0, 0, 255]
    assert scene.see(sensor, "color_image")[0, 0].tolist() == [0, 0, 255, 255]
    depth = scene.see(sensor, "depth_image_32f")
    assert depth.shape == (48, 64, 1) and depth[MIDDLE] == pytest.approx(1.4, abs=1e-6) and depth[0, 0] == 3.0
    millimetres = scene.see(sensor, "depth_image_16u")
    assert millimetres[MIDDLE] in (1399, 1400) and millimetres[0, 0] == 3000  # rounded down in single precision
    labels = scene.see(sensor, "label_image")
    assert labels[MIDDLE] == int(scene.ball.index()) and labels[0, 0] == int(scene.plant.world_body().index())
    scene.context.SetTime(3.0)
    assert scene.see(sensor, "image_time").tolist() == [3.0]
    assert scene.see(sensor, "body_pose_in_world").IsExactlyEqualTo(RigidTransform(DOWN, [0, 0, 2]))


def test_pictures_change_with_the_state_and_are_kept_while_it_stays():
    scene = Falling(above).build()
    (sensor,) = scene.sensors
    for z in (0.5, 0.0, 1.0):
        scene.put(z)
        assert scene.see(sensor, "depth_image_32f")[MIDDLE] == pytest.approx(1.9 - z, abs=1e-6)
    port, mine = sensor.color_image_output_port(), sensor.GetMyContextFromRoot(scene.context)
    assert port.Eval(mine) is port.Eval(mine)


def test_a_camera_on_a_body_moves_with_it():
    scene = Falling()
    frame = scene.plant.GetBodyFrameIdOrThrow(scene.ball.index())
    X_BC = RigidTransform(DOWN, [0, 0, -0.1])  # at the bottom of the ball, which it does not see
    sensor = scene.builder.AddSystem(RgbdSensor(frame, X_BC, cameras()[1]))
    scene.builder.Connect(scene.scene_graph.get_query_output_port(), sensor.query_object_input_port())
    scene.build()
    for z in (0.5, 1.5):
        scene.put(z)
        assert scene.see(sensor, "depth_image_32f")[MIDDLE] == pytest.approx(z - 0.1 + 1.0, abs=1e-5)
        assert scene.see(sensor, "body_pose_in_world").translation() == pytest.approx([0, 0, z - 0.1])


def test_sensors_have_poses_of_their_own_in_the_body():
    color, _ = cameras(X_BS=RigidTransform([0.4, 0, 0]))
    _, depth = cameras(X_BS=RigidTransform([0, 0, 0.25]))
    scene = Falling(lambda s: RgbdSensor(s.world, RigidTransform(DOWN, [0, 0, 2]), color, depth)).build()
    (sensor,) = scene.sensors
    scene.put(0.0)
    assert scene.see(sensor, "depth_image_32f")[MIDDLE] == pytest.approx(1.65, abs=1e-6)
    assert scene.see(sensor, "color_image")[MIDDLE].tolist() == [0, 0, 255, 255]
    assert scene.see(sensor, "color_image")[22, 30 - 10][:3].tolist() == [250, 0, 0]  # not seen from straight above
    assert scene.see(sensor, "body_pose_in_world").translation().tolist() == [0, 0, 2]


def test_mounting_is_a_parameter():
    scene = Falling(above).build()
    (sensor,) = scene.sensors
    scene.put(0.0)
    mine = sensor.GetMyContextFromRoot(scene.context)
    sensor.SetX_PB(mine, RigidTransform(DOWN, [0, 0, 3]))
    assert scene.see(sensor, "depth_image_32f")[MIDDLE] == pytest.approx(2.9, abs=1e-6)
    sensor.SetParentFrameId(mine, scene.plant.GetBodyFrameIdOrThrow(scene.ball.index()))
    scene.put(0.5)
    assert scene.see(sensor, "body_pose_in_world").translation().tolist() == [0, 0, 3.5]
    small = CameraInfo(32, 24, 1.0)
    color, depth = cameras(small)
    sensor.SetColorRenderCamera(mine, color)
    sensor.SetDepthRenderCamera(mine, depth)
    shapes = [scene.see(sensor, name).shape[:2] for name in PORTS[:4]]
    assert shapes == [(24, 32)] * 4 and sensor.GetColorRenderCamera(mine).core().intrinsics() is small
    assert sensor.default_X_PB().translation().tolist() == [0, 0, 2] and sensor.default_parent_frame_id() == scene.world
    sensor.set_default_X_PB(RigidTransform([1, 2, 3]))
    sensor.set_default_color_render_camera(color)
    sensor.set_default_depth_render_camera(depth)
    fresh = sensor.CreateDefaultContext()
    assert sensor.GetX_PB(fresh).translation().tolist() == [1, 2, 3] and sensor.GetX_PB(mine).translation()[2] == 3
    assert sensor.color_image_output_port().Allocate().get_value().shape == (24, 32, 4)


def test_signatures_of_the_constructor():
    color, depth = cameras()
    frame, X = g.FrameId.get_new_id(), RigidTransform()
    assert RgbdSensor(frame, X, depth, True).default_color_render_camera().show_window()
    named = RgbdSensor(parent_id=frame, X_PB=X, color_camera=color, depth_camera=depth)
    assert named.default_color_render_camera() is color and named.default_depth_render_camera() is depth
    for wrong in ((color,), (depth, color), (), (color, depth, True)):
        with pytest.raises(TypeError, match="incompatible"):
            RgbdSensor(frame, X, *wrong)


def test_the_input_must_be_connected():
    sensor = RgbdSensor(g.FrameId.get_new_id(), RigidTransform(), cameras()[1])
    with pytest.raises(RuntimeError, match=r"geometry_query.*not connected"):
        sensor.color_image_output_port().Eval(sensor.CreateDefaultContext())


def fall(t):
    return -9.81 / 2 * t * t


def test_discrete_camera_holds_its_pictures():
    scene = Falling(lambda s: RgbdSensorDiscrete(above(s), 0.1, render_label_image=False)).build()
    (camera,) = scene.sensors
    names = [camera.get_output_port(k).get_name() for k in range(camera.num_output_ports())]
    assert names == [name for name in PORTS if name != "label_image"]
    assert camera.period() == 0.1 and camera.sensor().query_object_input_port().get_name() == "geometry_query"
    assert RgbdSensorDiscrete.kDefaultPeriod == 1 / 30
    scene.simulator.AdvanceTo(0.25)
    assert scene.see(camera, "image_time")[0] == pytest.approx(0.2)
    seen = 2.0 - scene.see(camera, "depth_image_32f")[MIDDLE] - 0.1
    assert seen == pytest.approx(fall(0.2), abs=2e-3)  # explicit steps of 1 ms
    assert scene.see(camera, "body_pose_in_world").translation().tolist() == [0, 0, 2]
    with_labels = RgbdSensorDiscrete(RgbdSensor(scene.world, RigidTransform(), cameras()[1]))
    assert with_labels.label_image_output_port().get_name() == "label_image"


def late(scene, color=True, depth=True, label=True, **times):
    both = cameras()
    arguments = {"fps": 10.0, "capture_offset": 0.02, "output_delay": 0.05, **times}
    return RgbdSensorAsync(
        scene.scene_graph,
        scene.world,
        RigidTransform(DOWN, [0, 0, 2]),
        **arguments,
        color_camera=both[0] if color else None,
        depth_camera=both[1] if depth else None,
        render_label_image=label,
    )


def test_pictures_come_late():
    scene = Falling(late).build()
    (camera,) = scene.sensors
    assert scene.see(camera, "color_image").shape == (0, 0, 4) and np.isnan(scene.see(camera, "image_time")[0])
    for t, taken in ((0.06, None), (0.08, 0.02), (0.15, 0.02), (0.18, 0.12), (0.265, 0.12), (0.275, 0.22)):
        scene.simulator.AdvanceTo(t)
        time = scene.see(camera, "image_time")[0]
        if taken is None:
            assert np.isnan(time) and scene.see(camera, "depth_image_32f").size == 0
            continue
        assert time == pytest.approx(taken)
        ball = 2.0 - scene.see(camera, "depth_image_32f")[MIDDLE] - 0.1
        assert ball == pytest.approx(fall(taken), abs=2e-3)
        assert scene.see(camera, "color_image")[MIDDLE].tolist() == [255, 0, 0, 255]
        assert scene.see(camera, "label_image")[MIDDLE] == int(scene.ball.index())
        assert scene.see(camera, "depth_image_16u")[0, 0] == 3000
        assert scene.see(camera, "body_pose_in_world").translation().tolist() == [0, 0, 2]


def test_late_cameras_have_the_ports_they_need():
    scene = Falling()
    ports = {
        (True, False, False): ["color_image"],
        (False, True, False): ["depth_image_32f", "depth_image_16u"],
        (True, True, True): ["color_image", "depth_image_32f", "depth_image_16u", "label_image"],
    }
    for (color, depth, label), names in ports.items():
        camera = late(scene, color, depth, label)
        found = [camera.get_output_port(k).get_name() for k in range(camera.num_output_ports())]
        assert found == [*names, "body_pose_in_world", "image_time"]
        assert (camera.fps(), camera.capture_offset(), camera.output_delay()) == (10.0, 0.02, 0.05)
    with pytest.raises(RuntimeError, match="label_image"):
        late(scene, label=False).label_image_output_port()


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        ({"fps": -1.0}, "fps = -1.0 must be positive"),
        ({"capture_offset": -0.1}, "capture_offset"),
        ({"output_delay": 0.0}, "output_delay"),
        ({"output_delay": 0.1}, "less than 1 / fps"),
        ({"color": False, "depth": False, "label": False}, "color_camera or a depth_camera"),
        ({"color": False}, "labels need a color_camera"),
    ],
)
def test_late_cameras_that_make_no_sense(wrong, match):
    with pytest.raises(RuntimeError, match=match):
        late(Falling(), **wrong)


def test_a_depth_image_becomes_a_point_cloud_on_the_surfaces():
    """The points of all pixels are where things are, half a pixel off as in Drake's renderers."""
    X_WC = RigidTransform(RollPitchYaw(np.pi - 0.2, 0.1, 0), [0, 0, 2])
    scene = Falling(lambda s: RgbdSensor(s.world, X_WC, *cameras()))
    (sensor,) = scene.sensors
    # The renderer's ray of pixel (u, v) goes through (u + 1/2, v + 1/2).
    shifted = CameraInfo(64, 48, 50.0, 60.0, 30.0, 22.0)
    cloud = scene.builder.AddSystem(DepthImageToPointCloud(shifted, fields=BaseField.kXYZs | BaseField.kRGBs))
    scene.builder.Connect(sensor.depth_image_32F_output_port(), cloud.depth_image_input_port())
    scene.builder.Connect(sensor.color_image_output_port(), cloud.color_image_input_port())
    scene.builder.Connect(sensor.body_pose_in_world_output_port(), cloud.camera_pose_input_port())
    scene.build().put(0.3)
    points = cloud.point_cloud_output_port().Eval(cloud.GetMyContextFromRoot(scene.context))
    xyz, rgb = points.xyzs().T, points.rgbs().T
    ball = (rgb[:, 0] > 0) & (rgb[:, 2] == 0)
    plate = (rgb[:, 2] > 0) & (rgb[:, 0] == 0)
    assert ball.sum() > 20 and plate.sum() > 1000
    assert np.abs(np.linalg.norm(xyz[ball] - [0, 0, 0.3], axis=1) - 0.1).max() < 1e-5
    top = plate & (np.abs(xyz[:, :2]) < 1.999).all(axis=1)
    assert np.abs(xyz[top, 2] + 1.0).max() < 1e-5


def test_two_cameras_of_one_scene_do_not_disturb_each_other():
    below = lambda s: RgbdSensor(s.world, RigidTransform([0, 0, -0.9]), *cameras())  # noqa: E731
    scene = Falling(above, below).build()
    scene.put(0.5)
    for _ in range(2):
        depths = [scene.see(sensor, "depth_image_32f")[MIDDLE][0] for sensor in scene.sensors]
        assert depths == pytest.approx([1.4, 1.3], abs=1e-6)
        scene.context.SetTime(scene.context.get_time() + 1.0)
