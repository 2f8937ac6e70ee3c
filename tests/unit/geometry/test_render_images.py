"""Pictures against what geometry says by hand."""

import copy

import numpy as np
import pytest
from render_scenes import (
    DOWN,
    LENS,
    Studio,
    box_depth,
    capsule_depth,
    core,
    cylinder_depth,
    ellipsoid_depth,
    looking_from,
    plane_depth,
    seen,
)

from sheldrake import geometry as g
from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.geometry._kernels import raster_image
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw
from sheldrake.systems.sensors import CameraInfo

SHAPES = {
    "box": (g.Box(0.5, 0.7, 0.9), lambda X: box_depth(X, (0.5, 0.7, 0.9))),
    "sphere": (g.Sphere(0.5), lambda X: ellipsoid_depth(X, np.full(3, 0.5))),
    "ellipsoid": (g.Ellipsoid(0.3, 0.4, 0.6), lambda X: ellipsoid_depth(X, np.array([0.3, 0.4, 0.6]))),
    "cylinder": (g.Cylinder(0.4, 0.8), lambda X: cylinder_depth(X, 0.4, 0.8)),
    "capsule": (g.Capsule(0.3, 0.6), lambda X: capsule_depth(X, 0.3, 0.6)),
    "plane": (g.HalfSpace(), plane_depth),
}
X_WG = RigidTransform(RollPitchYaw(0.3, -0.4, 0.5), [0.1, -0.2, 0.05])
VIEWS = {
    "from outside": looking_from([1.5, 1.1, 1.7]),
    "from below": looking_from([-1.2, 0.4, -1.3]),
    "from inside": X_WG @ RigidTransform(RollPitchYaw(2.5, 0.2, 0.1), [0.02, 0.03, 0.04]),
    "close": looking_from([0.55, 0.5, 0.6], target=(0.4, -0.3, 0.3)),
}


def almost_everywhere(depth, expected, tolerance):
    """Equal but for pixels whose rays touch an edge to within rounding."""
    finite = np.isfinite(expected) & np.isfinite(depth)
    differ = np.isfinite(depth) != np.isfinite(expected)
    return differ.sum() <= 1 and np.allclose(depth[finite], expected[finite], rtol=tolerance, atol=0.0)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", SHAPES)
def test_depth_is_that_of_the_shape(name, view):
    shape, by_hand = SHAPES[name]
    studio, X_WC = Studio(seen(shape, X_WG)), VIEWS[view]
    depth = studio.depths(X_WC, near=0.01, least=0.01)
    expected = by_hand(X_WG.inverse() @ X_WC)
    expected[expected > 90.0] = np.inf
    assert np.isfinite(expected).sum() > 100
    assert almost_everywhere(depth, expected, 1e-6)  # pictures have single precision
    labels = studio.labels(X_WC, near=0.01)
    assert np.array_equal(labels == 2, np.isfinite(depth)) and set(np.unique(labels)) <= {2, 32766}
    moved = looking_from([1.5, 1.1, 1.7]) @ RigidTransform([0.0, 0.0, 0.0005])
    if view == "from outside":  # a fault of half a millimetre does not pass
        assert not almost_everywhere(studio.depths(moved), expected, 1e-6)


def test_the_nearest_surface_is_seen_whatever_the_order():
    things = [seen(g.Box(1, 1, 0.1), RigidTransform([0, 0, -1]), label=1), seen(g.Sphere(0.2), label=2)]
    for order in (things, things[::-1]):
        labels = Studio(*order).labels(RigidTransform(DOWN, [0, 0, 2]))
        assert labels[22, 30] == 2 and labels[22, 37] == 1 and labels[0, 0] == g.RenderLabel.kEmpty
        assert (labels == 2).sum() > 20 and (labels == 1).sum() > 50


def test_near_plane_cuts_exactly_and_shows_the_inside():
    studio = Studio(seen(g.Box(1, 1, 1)))
    X_WC = RigidTransform(DOWN, [0, 0, 2])
    assert studio.depths(X_WC)[22, 30] == 1.5
    assert studio.depths(X_WC, near=1.6, least=1.7)[22, 30] == 2.5
    tilted = RigidTransform(RollPitchYaw(np.pi + 0.5, 0.2, 0.0), [0, 0.4, 1.2])
    whole, cut = studio.depths(tilted), studio.depths(tilted, near=1.0, least=1.0)
    assert np.array_equal(cut[whole > 1.0], whole[whole > 1.0]) and (cut >= 1.0).all() and (whole < 1.0).any()


def test_far_plane_and_measured_range():
    studio, X_WC = Studio(seen(g.Box(1, 1, 1))), RigidTransform(DOWN, [0, 0, 2])
    assert np.isinf(studio.depths(X_WC, far=1.4, most=1.4)).all()
    assert studio.depths(X_WC, least=1.6)[22, 30] == 0.0
    assert np.isinf(studio.depths(X_WC, most=1.4)[22, 30])
    assert studio.labels(X_WC, far=1.4)[22, 30] == g.RenderLabel.kEmpty


def test_a_box_has_no_gaps_along_its_edges():
    """Pixels exactly on the diagonals of a face and on shared edges belong to somebody."""
    lens = CameraInfo(65, 65, 64.0, 64.0, 32.5, 32.5)
    depth = Studio(seen(g.Box(2, 2, 2))).depths(RigidTransform(DOWN, [0, 0, 2.0]), lens=lens)
    assert np.array_equal(depth, np.ones((65, 65)))


def test_faces_seen_from_their_edge_are_not_seen():
    """The camera is in the plane of a box's side, and so is a column of pixels: only the top has a depth."""
    for angle in np.linspace(0.0, 3.0, 20):
        X_WS = RigidTransform(RollPitchYaw(0.1, 0.2, angle), [0.3, -0.2, 0.1])
        studio = Studio(seen(g.Box(1, 1, 1), X_WS @ RigidTransform([0.5, 0, -0.5])))
        depth = studio.depths(X_WS @ RigidTransform(DOWN, [0, 0, 2]))
        hit = np.isfinite(depth)
        assert np.abs(depth[hit] - 2.0).max() < 1e-6 and hit[22, 31] and not hit[22, 29]


def test_light_shines_where_the_camera_looks():
    studio = Studio(seen(g.HalfSpace(), color=(1.0, 0.5, 0.25, 1.0)))
    for tilt in (0.0, 0.3, 0.9):
        X_WC = RigidTransform(RollPitchYaw(np.pi + tilt, 0, 0), [0, 0, 2])
        expected = np.floor(255 * np.cos(tilt) * np.array([1.0, 0.5, 0.25]) + 0.5)
        assert np.array_equal(studio.colors(X_WC)[30, 30], [*expected, 255])
    assert studio.colors(RigidTransform(RollPitchYaw(0.3, 0, 0), [0, 0, 2]))[0, 0].tolist() == [204, 229, 255, 255]


@pytest.mark.parametrize("frame", ["world", "camera"])
def test_lights_follow_their_formulas(frame):
    X_WC = RigidTransform(DOWN, [0, 0, 2])
    X_FW = RigidTransform() if frame == "world" else X_WC.inverse()
    p_FL, axis = X_FW @ np.array([0.4, 0.0, 1.5]), X_FW.rotation() @ np.array([-0.4, 0.0, -1.5])
    thing = seen(g.HalfSpace(), color=(0.8, 0.6, 0.4, 1.0))
    kinds = {
        "directional": {"direction": axis, "intensity": 0.7},
        "point": {"position": p_FL, "attenuation_values": [1.0, 0.2, 0.3]},
        "spot": {"position": p_FL, "direction": axis, "cone_angle": 20.0, "color": g.Rgba(1, 1, 0)},
    }
    v, u = np.indices((48, 64))
    p_WP = np.stack([2 * (u - 30) / 50, -2 * (v - 22) / 60, 0 * u], axis=-1)
    way = p_WP - [0.4, 0.0, 1.5]
    distance = np.linalg.norm(way, axis=-1)
    lambert = -way[..., 2] / distance
    cosine = way @ [-0.4, 0.0, -1.5] / (distance * np.hypot(0.4, 1.5))
    expected = {
        "directional": 0.7 * 1.5 / np.hypot(0.4, 1.5) * np.ones((48, 64)),
        "point": lambert / (1.0 + 0.2 * distance + 0.3 * distance**2),
        "spot": np.where(cosine >= np.cos(np.radians(20.0)), lambert * cosine, 0.0),
    }
    for kind, numbers in kinds.items():
        light = g.LightParameter(type=kind, frame=frame, **numbers)
        pixels = Studio(thing, lights=[light]).colors(X_WC)[..., :3]
        by_hand = expected[kind][..., None] * [0.8, 0.6, 0.4] * light.color.rgba[:3] * 255
        assert np.abs(pixels - by_hand).max() <= 0.5 + 1e-6, kind
        assert pixels.max() > 60


def test_light_reflected_by_round_things_is_exact():
    """A sphere under a light from the camera: the cosine between normal and viewing axis, from depth alone."""
    studio = Studio(seen(g.Sphere(0.5), color=(1.0, 1.0, 1.0, 1.0)))
    X_WC = RigidTransform(DOWN, [0, 0, 2])
    depth, pixels = studio.depths(X_WC), studio.colors(X_WC)[..., 0].astype(float)
    normal_z = (2.0 - depth) / 0.5  # of the sphere's surface, towards the camera
    hit = np.isfinite(depth)
    assert np.abs(pixels - 255 * normal_z)[hit].max() < 0.51


def test_opacity_lets_what_is_behind_shine_through_both_sides():
    ground = seen(g.HalfSpace(), RigidTransform([0, 0, -1]), color=(0, 0, 1, 1), label=1)
    X_WC = RigidTransform(DOWN, [0, 0, 2])
    studio = Studio(ground, seen(g.Box(0.5, 0.5, 0.5), color=(1, 0, 0, 0.5)))
    assert np.abs(studio.colors(X_WC)[22, 30, :3] - np.array([191.25, 0, 63.75])).max() <= 1
    assert studio.labels(X_WC)[22, 30] == 2 and studio.depths(X_WC)[22, 30] == 1.75
    both = [
        seen(g.Box(0.5, 0.5, 0.1), RigidTransform([0, 0, z]), color=c, label=k)
        for k, (z, c) in enumerate([(0.0, (1, 0, 0, 0.5)), (0.5, (0, 1, 0, 0.5))], start=2)
    ]
    for order in (both, both[::-1]):  # the nearer one is laid over the farther one
        pixel = Studio(ground, *order).colors(X_WC)[22, 30, :3]
        assert np.abs(pixel - 255 * np.array([0.1875, 0.75, 0.0625])).max() <= 1.5
    hidden = Studio(ground, seen(g.Box(0.5, 0.5, 0.5), color=(1, 0, 0, 0.0)))
    assert hidden.colors(X_WC)[22, 30].tolist() == [0, 0, 255, 255] and hidden.labels(X_WC)[22, 30] == 2


def test_labels_that_are_not_drawn():
    studio = Studio(seen(g.Sphere(0.2), label=g.RenderLabel.kDoNotRender), seen(g.HalfSpace(), label=3))
    X_WC = RigidTransform(DOWN, [0, 0, 2])
    assert studio.labels(X_WC)[22, 30] == 3
    assert studio.depths(X_WC)[22, 30] == pytest.approx(1.8, abs=1e-6)


def test_an_empty_scene_is_background():
    studio = Studio(default_clear_color=[0.0, 0.5, 1.0])
    X_WC = RigidTransform()
    assert (studio.colors(X_WC) == [0, 128, 255, 255]).all()
    assert np.isinf(studio.depths(X_WC)).all() and (studio.labels(X_WC) == 32766).all()


def test_default_colours_of_both_engines():
    X_WC = RigidTransform(DOWN, [0, 0, 2])
    thing = seen(g.HalfSpace(), color=None)
    assert Studio(thing).colors(X_WC)[0, 0].tolist() == [230, 115, 26, 255]
    assert Studio(thing, engine=g.MakeRenderEngineGl()).colors(X_WC)[0, 0].tolist() == [230, 179, 51, 255]
    assert Studio(thing, default_diffuse=[0, 1, 0, 1]).colors(X_WC)[0, 0].tolist() == [0, 255, 0, 255]


@pytest.mark.parametrize("kind", ["depths", "labels", "colors"])
def test_compiled_pictures_are_those_of_the_python_source(kind, monkeypatch):
    lens = CameraInfo(16, 12, 14.0, 14.0, 8.0, 6.0)
    things = [
        seen(shape, X_WG @ RigidTransform([k - 2.0, 0, 0]), label=k) for k, (shape, _) in enumerate(SHAPES.values())
    ]
    things.append(seen(g.Box(0.4, 0.4, 2), color=(0, 1, 0, 0.4), label=9))
    X_WC = looking_from([2.0, 2.5, 2.0])
    compiled = getattr(Studio(*things), kind)(X_WC, lens=lens)
    kernel = raster_image.draw
    monkeypatch.setattr(type(kernel), "native", lambda self, *args: self(*args))
    assert np.array_equal(getattr(Studio(*things), kind)(X_WC, lens=lens), compiled)


# ---- contexts


class Mover:
    """A sphere on a frame that moves."""

    def __init__(self):
        self.studio = Studio(seen(g.HalfSpace(), RigidTransform([0, 0, -1]), label=1))
        sg, source = self.studio.scene_graph, self.studio.source
        self.frame = sg.RegisterFrame(source, g.GeometryFrame("mover"))
        self.ball = sg.RegisterGeometry(source, self.frame, seen(g.Sphere(0.25), RigidTransform([0, 0, 0.25])))

    def context(self, z):
        context = self.studio.scene_graph.CreateDefaultContext()
        self.move(context, z)
        return context

    def move(self, context, z):
        poses = g.FramePoseVector()
        poses.set_value(self.frame, RigidTransform([0, 0, z]))
        self.studio.scene_graph.get_source_pose_port(self.studio.source).FixValue(context, poses)

    def depth(self, context, frame=None, X_PC=None):
        camera = g.DepthRenderCamera(core(), g.DepthRange(0.06, 90.0))
        query = self.studio.scene_graph.get_query_output_port().Eval(context)
        frame = self.studio.scene_graph.world_frame_id() if frame is None else frame
        X_PC = RigidTransform(DOWN, [0, 0, 3]) if X_PC is None else X_PC
        return float(query.RenderDepthImage(camera, frame, X_PC).data[22, 30, 0])


def test_pictures_follow_the_poses_of_their_context():
    mover = Mover()
    low, high = mover.context(0.0), mover.context(1.0)
    for _ in range(2):
        assert mover.depth(low) == pytest.approx(2.5, abs=1e-6) and mover.depth(high) == pytest.approx(1.5, abs=1e-6)
    mover.move(low, -0.5)
    assert mover.depth(low) == pytest.approx(3.0, abs=1e-6) and mover.depth(high) == pytest.approx(1.5, abs=1e-6)
    twin = copy.deepcopy(low)
    mover.move(twin, 0.25)
    assert mover.depth(twin) == pytest.approx(2.25, abs=1e-6) and mover.depth(low) == pytest.approx(3.0, abs=1e-6)


def test_a_camera_moves_with_its_frame():
    mover = Mover()
    for z in (0.5, 2.0):
        down = RigidTransform(DOWN, [0, 0, -0.1])  # below the ball
        assert mover.depth(mover.context(z), mover.frame, down) == pytest.approx(1.0 + z - 0.1, abs=1e-5)


def test_sensor_pose_in_the_camera_is_heeded():
    studio = Studio(seen(g.HalfSpace()))
    lens = g.RenderCameraCore("r", LENS, g.ClippingRange(0.05, 100), RigidTransform([0, 0, 0.75]))
    camera = g.DepthRenderCamera(lens, g.DepthRange(0.1, 10))
    world = studio.scene_graph.world_frame_id()
    image = studio.query().RenderDepthImage(camera, world, RigidTransform(DOWN, [0, 0, 2]))
    assert (image.data == np.float32(1.25)).all()


def test_geometry_of_one_context_comes_goes_and_changes():
    mover = Mover()
    sg, source = mover.studio.scene_graph, mover.studio.source
    here, there = mover.context(0.0), mover.context(0.0)
    assert mover.depth(here) == pytest.approx(2.5, abs=1e-6)
    sg.ChangeShape(here, source, mover.ball, g.Box(0.5, 0.5, 0.5))
    assert mover.depth(here) == 2.5
    sg.ChangeShape(here, source, mover.ball, g.Box(0.5, 0.5, 0.5), RigidTransform([0, 0, 1.25]))
    assert mover.depth(here) == 1.5
    sg.RemoveRole(here, source, mover.ball, g.Role.kPerception)
    assert mover.depth(here) == 4.0 and mover.depth(there) == pytest.approx(2.5, abs=1e-6)
    sg.RegisterGeometry(here, source, mover.frame, seen(g.Box(0.5, 0.5, 0.5), label=8))
    assert mover.depth(here) == 2.75
    sg.RemoveGeometry(there, source, mover.ball)
    assert mover.depth(there) == 4.0 and mover.depth(mover.context(0.0)) == pytest.approx(2.5, abs=1e-6)


def test_a_copied_query_keeps_its_moment():
    mover = Mover()
    context = mover.context(0.0)
    query = copy.copy(mover.studio.scene_graph.get_query_output_port().Eval(context))
    mover.move(context, 1.0)
    camera = g.DepthRenderCamera(core(), g.DepthRange(0.06, 90.0))
    image = query.RenderDepthImage(camera, query.inspector().world_frame_id(), RigidTransform(DOWN, [0, 0, 3]))
    assert image.data[22, 30, 0] == pytest.approx(2.5, abs=1e-6)


def test_poses_with_derivatives_are_seen_at_their_values():
    mover = Mover()
    sg = mover.studio.scene_graph.ToAutoDiffXd()
    context = sg.CreateDefaultContext()
    p_WM = np.array([AutoDiffXd(0.0), AutoDiffXd(0.0), AutoDiffXd(0.5, [1.0])])
    poses = g.FramePoseVector_[AutoDiffXd]()
    poses.set_value(mover.frame, RigidTransform_[AutoDiffXd](p_WM))
    sg.get_source_pose_port(mover.studio.source).FixValue(context, poses)
    query = sg.get_query_output_port().Eval(context)
    camera = g.DepthRenderCamera(core(), g.DepthRange(0.06, 90.0))
    image = query.RenderDepthImage(camera, sg.world_frame_id(), RigidTransform(DOWN, [0, 0, 3]))
    assert image.data[22, 30, 0] == pytest.approx(2.0, abs=1e-6)
    z = query.GetPoseInWorld(mover.ball).translation()[2]
    assert z.value() == 0.75 and z.derivatives().tolist() == [1.0]


def test_errors_of_pictures():
    studio = Studio()
    world = studio.scene_graph.world_frame_id()
    with pytest.raises(RuntimeError, match="No renderer exists with name: 'other'"):
        studio.query().RenderColorImage(g.ColorRenderCamera(core(renderer="other")), world, RigidTransform())
    with pytest.raises(RuntimeError, match="has not been registered"):
        studio.query().RenderColorImage(g.ColorRenderCamera(core()), g.FrameId.get_new_id(), RigidTransform())
    with pytest.raises(RuntimeError, match="invalid QueryObject"):
        g.QueryObject().RenderColorImage(g.ColorRenderCamera(core()), world, RigidTransform())
