"""Cameras, options, and engines that users write."""

import copy
import logging

import numpy as np
import pytest
from render_scenes import DOWN, LENS, Studio, core, seen

from sheldrake import geometry as g
from sheldrake.common.yaml import yaml_dump_typed, yaml_load_typed
from sheldrake.math import RigidTransform
from sheldrake.systems.sensors import CameraInfo, ImageDepth32F, ImageLabel16I, ImageRgba8U


class Recorder(g.RenderEngine):
    """Draws nothing and remembers what it is told."""

    def __init__(self):
        g.RenderEngine.__init__(self)
        self.accepts = True
        self.poses, self.calls, self.X_WR = {}, [], None

    def UpdateViewpoint(self, X_WR):
        self.X_WR = X_WR

    def DoRegisterVisual(self, id, shape, properties, X_WG):
        self.GetRenderLabelOrThrow(properties)
        if self.accepts:
            self.poses[id] = X_WG
        return self.accepts

    def DoUpdateVisualPose(self, id, X_WG):
        self.poses[id] = X_WG

    def DoRemoveGeometry(self, id):
        del self.poses[id]
        return True

    def DoRenderColorImage(self, camera, color_image_out):
        self.calls.append(camera)
        color_image_out.mutable_data[...] = len(self.poses)

    def DoClone(self):
        new = Recorder()
        new.accepts, new.poses = self.accepts, dict(self.poses)
        Recorder.latest = new
        return new


def test_all_kinds_of_engines_are_there():
    assert g.kHasRenderEngineVtk and g.kHasRenderEngineGl and g.kHasRenderEngineGltfClient


def test_ranges_must_make_sense():
    for cls in (g.ClippingRange, g.DepthRange):
        for low, high in ((1, 0.5), (-1, 2), (0, 1), (1, 1), (1, np.inf), (np.nan, 1)):
            with pytest.raises(RuntimeError, match="range values must both be positive and finite"):
                cls(low, high)
    assert (g.ClippingRange(near=0.5, far=2).near(), g.ClippingRange(0.5, 2).far()) == (0.5, 2.0)
    depth = g.DepthRange(min_in=0.5, min_out=2)
    assert (depth.min_depth(), copy.deepcopy(depth).max_depth()) == (0.5, 2.0)
    with pytest.raises(TypeError):
        g.ClippingRange(1.0)


def test_cameras_hold_what_they_are_given():
    one = core(near=0.5, far=3.0)
    assert (one.renderer_name(), one.intrinsics(), one.clipping().far()) == ("r", LENS, 3.0)
    X = one.sensor_pose_in_camera_body()
    X.set_translation([1, 2, 3])
    assert (one.sensor_pose_in_camera_body().translation() == 0).all()
    color = g.ColorRenderCamera(core=one, show_window=True)
    assert g.ColorRenderCamera(color).show_window() and g.ColorRenderCamera(other=color).core().clipping().near() == 0.5
    assert not g.ColorRenderCamera(one).show_window()
    depth = g.DepthRenderCamera(one, g.DepthRange(0.5, 3.0))
    assert copy.copy(depth).depth_range().max_depth() == 3.0
    for low, high in ((0.4, 2.0), (0.6, 3.1)):
        with pytest.raises(RuntimeError, match=f"extends beyond the clipping planes; near = 0.5, far = 3, .* = {low}"):
            g.DepthRenderCamera(one, g.DepthRange(low, high))
    with pytest.raises(TypeError):
        g.RenderCameraCore("r", "lens", g.ClippingRange(1, 2), RigidTransform())


def test_options_have_drakes_defaults_and_survive_yaml():
    vtk, gl = g.RenderEngineVtkParams(), g.RenderEngineGlParams()
    assert vtk.default_diffuse is None and vtk.lights == [] and vtk.shadow_map_size == 256
    assert np.array_equal(gl.default_diffuse.rgba, [0.9, 0.7, 0.2, 1.0])
    assert np.array_equal(vtk.default_clear_color, gl.default_clear_color.rgba[:3])
    light = g.LightParameter()
    assert (light.type, light.frame, light.intensity, light.cone_angle) == ("directional", "camera", 1.0, 0.0)
    vtk.lights = [g.LightParameter(type="spot", position=[1, 2, 3])]
    text = yaml_dump_typed(vtk)
    again = yaml_load_typed(schema=g.RenderEngineVtkParams, data=text)
    assert again.lights[0].type == "spot" and again.lights[0].position.tolist() == [1.0, 2.0, 3.0]
    other = copy.deepcopy(vtk)
    other.lights[0].type = "point"
    assert vtk.lights[0].type == "spot"


def test_engines_are_added_named_and_removed():
    sg = g.SceneGraph()
    sg.AddRenderer("v", g.MakeRenderEngineVtk(g.RenderEngineVtkParams()))
    sg.AddRenderer(name="g", renderer=g.MakeRenderEngineGl())
    sg.AddRenderer("mine", Recorder())
    assert sg.RendererCount() == 3 and sg.RegisteredRendererNames() == ["g", "mine", "v"]
    assert sg.GetRendererTypeName("v") == "drake::geometry::render_vtk::internal::RenderEngineVtk"
    assert sg.GetRendererTypeName("g") == "drake::geometry::render_gl::internal::RenderEngineGl"
    assert sg.GetRendererTypeName("mine").endswith("Recorder") and sg.GetRendererTypeName("none") == ""
    assert sg.GetRendererParameterYaml("g").startswith("RenderEngineGlParams:\n  default_diffuse:")
    assert sg.GetRendererParameterYaml("none") == "" and "Unknown" in sg.GetRendererParameterYaml("mine")
    with pytest.raises(RuntimeError, match="A renderer with the name 'v' already exists"):
        sg.AddRenderer("v", g.MakeRenderEngineGl())
    with pytest.raises(RuntimeError, match="A renderer with the name 'w' does not exist"):
        sg.RemoveRenderer("w")
    with pytest.raises(TypeError, match="RenderEngine"):
        sg.AddRenderer("w", 3)
    context = sg.CreateDefaultContext()
    sg.RemoveRenderer("v")
    sg.RemoveRenderer(context, "g")
    sg.AddRenderer(context, "late", g.MakeRenderEngineGl())
    assert sg.RegisteredRendererNames() == ["g", "mine"] and sg.HasRenderer(context, "late")
    assert sg.RegisteredRendererNames(context) == ["late", "mine", "v"] and sg.RendererCount(context) == 3
    assert not sg.HasRenderer("late") and sg.HasRenderer(context=context, name="v")


def test_an_engine_of_ones_own_hears_of_everything():
    studio = Studio(seen(g.Sphere(1.0)), engine=Recorder())
    sg, source = studio.scene_graph, studio.source
    frame = sg.RegisterFrame(source, g.GeometryFrame("frame"))
    ball = sg.RegisterGeometry(source, frame, seen(g.Sphere(1.0), RigidTransform([0, 0, 1]), label=5))
    context = sg.CreateDefaultContext()
    poses = g.FramePoseVector()
    poses.set_value(frame, RigidTransform([1, 0, 0]))
    sg.get_source_pose_port(source).FixValue(context, poses)
    query = sg.get_query_output_port().Eval(context)
    camera = g.ColorRenderCamera(core())
    image = query.RenderColorImage(camera, frame, RigidTransform([0, 2, 0]))
    engine = Recorder.latest
    assert (image.data == 2).all() and engine.calls[0].core().renderer_name() == "r"
    assert engine.X_WR.translation().tolist() == [1, 2, 0]
    assert engine.poses[ball].translation().tolist() == [1, 0, 1]
    assert engine.poses[studio.ids[0]].translation().tolist() == [0, 0, 0]
    query.RenderColorImage(camera, frame, RigidTransform())
    assert Recorder.latest is engine and len(engine.calls) == 2  # no more clones
    sg.RemoveGeometry(context, source, ball)
    assert (query.RenderColorImage(camera, frame, RigidTransform()).data == 1).all()
    with pytest.raises(RuntimeError, match=r'Recorder: Tried to call pure virtual .*DoRenderLabelImage"'):
        query.RenderLabelImage(camera, frame, RigidTransform())


def test_engines_choose_and_are_chosen():
    sg = g.SceneGraph()
    source = sg.RegisterSource("source")
    for name in ("a", "b"):
        sg.AddRenderer(name, Recorder())
    for label, accepting in ((1, None), (2, {"a"}), (3, set()), (4, {"a", "b"})):
        thing = seen(g.Sphere(1.0), label=label)
        if accepting is not None:
            thing.mutable_perception_properties().AddProperty("renderer", "accepting", accepting)
        sg.RegisterAnchoredGeometry(source, thing)
    late = Recorder()
    late.accepts = False
    sg.AddRenderer("late", late)
    query = sg.get_query_output_port().Eval(sg.CreateDefaultContext())
    for name, count in (("a", 4), ("b", 3), ("late", 0)):
        camera = g.ColorRenderCamera(core(renderer=name))
        assert (query.RenderColorImage(camera, sg.world_frame_id(), RigidTransform()).data == count).all(), name


def test_an_engine_by_itself():
    engine, id = g.MakeRenderEngineVtk(g.RenderEngineVtkParams()), g.GeometryId.get_new_id()
    assert engine.default_render_label() == g.RenderLabel.kDontCare
    assert g.RenderEngine().default_render_label() == g.RenderLabel.kUnspecified
    assert engine.RegisterVisual(id, g.HalfSpace(), g.PerceptionProperties(), RigidTransform(), needs_updates=True)
    assert engine.has_geometry(id)
    engine.UpdateViewpoint(RigidTransform(DOWN, [0, 0, 2]))
    depth, label, color = ImageDepth32F(64, 48), ImageLabel16I(64, 48), ImageRgba8U(64, 48)
    twin = engine.Clone()
    engine.RenderDepthImage(g.DepthRenderCamera(core(), g.DepthRange(0.1, 10)), depth)
    engine.RenderLabelImage(g.ColorRenderCamera(core()), label)
    assert (depth.data == 2.0).all() and (label.data == g.RenderLabel.kDontCare).all()
    assert engine.RemoveGeometry(id) and not engine.RemoveGeometry(id) and not engine.has_geometry(id)
    engine.RenderLabelImage(g.ColorRenderCamera(core()), label)
    assert (label.data == g.RenderLabel.kEmpty).all()
    twin.RenderColorImage(g.ColorRenderCamera(core()), color)
    assert twin.has_geometry(id) and (color.data == [230, 115, 26, 255]).all()


def test_wrong_images_labels_and_lights():
    engine = g.MakeRenderEngineGl()
    with pytest.raises(RuntimeError, match=r"Image: \(4, 4\), intrinsics: \(64, 48\)"):
        engine.RenderColorImage(g.ColorRenderCamera(core()), ImageRgba8U(4, 4))
    with pytest.raises(RuntimeError, match="nullptr"):
        engine.RenderColorImage(g.ColorRenderCamera(core()), None)
    g.RenderEngine.ThrowIfInvalid(CameraInfo(4, 4, 1.0), ImageLabel16I(4, 4), "label")
    for label in (g.RenderLabel.kUnspecified, g.RenderLabel.kEmpty):
        with pytest.raises(RuntimeError, match="'unspecified' or 'empty' render labels"):
            Studio(seen(g.Sphere(1.0), label=label))
    with pytest.raises(RuntimeError, match="unspecified"):
        Recorder().GetRenderLabelOrThrow(g.PerceptionProperties())
    with pytest.raises(RuntimeError, match="different type"):
        wrong = g.PerceptionProperties()
        wrong.AddProperty("label", "id", 3)
        engine.GetRenderLabelOrThrow(wrong)
    with pytest.raises(RuntimeError, match=r"RenderEngineVtk given an invalid light type.*'laser'"):
        Studio(lights=[g.LightParameter(type="laser")])
    with pytest.raises(RuntimeError, match=r"RenderEngineVtk given an invalid frame.*'moon'"):
        Studio(lights=[g.LightParameter(frame="moon")])
    with pytest.raises(RuntimeError, match="does not support MeshcatCone"):
        Studio(seen(g.MeshcatCone(1, 0.2, 0.2)))


def test_a_refused_geometry_changes_nothing():
    studio = Studio()
    with pytest.raises(RuntimeError):
        bad = seen(g.Sphere(1.0), label=g.RenderLabel.kEmpty)
        studio.scene_graph.RegisterAnchoredGeometry(studio.source, bad)
    assert studio.scene_graph.model_inspector().num_geometries() == 0


def test_what_cannot_be_drawn_is_said(caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        g.MakeRenderEngineVtk(g.RenderEngineVtkParams(cast_shadows=True, environment_map=g.EnvironmentMap()))
    assert "environment_map, cast_shadows" in caplog.text


@pytest.mark.parametrize("size", [(2.5, 4), (4, 2.5), (4.0, 4), (None, 4), ("4", 4)])
def test_sizes_of_a_picture_are_whole_numbers(size):
    assert CameraInfo(np.int64(4), 4, 1.0).width() == 4
    with pytest.raises(TypeError, match=r"CameraInfo\(\): incompatible .* accepted: \(width: int, height: int"):
        CameraInfo(*size, 1.0)
