"""DrakeVisualizer: what it publishes when, and its errors."""

import pytest

from sheldrake.geometry import (
    DrakeVisualizer,
    DrakeVisualizerParams,
    GeometryFrame,
    GeometryInstance,
    IllustrationProperties,
    MakePhongIllustrationProperties,
    MeshcatCone,
    Role,
    SceneGraph,
    Sphere,
)
from sheldrake.lcm import DrakeLcm
from sheldrake.lcm._messages import lcmt_viewer_draw, lcmt_viewer_load_robot
from sheldrake.math import RigidTransform
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder


def ball(shape=None):
    """A scene graph with one ball on the world."""
    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("src")
    instance = GeometryInstance(RigidTransform(), shape or Sphere(0.5), "ball")
    instance.set_illustration_properties(MakePhongIllustrationProperties([1, 0, 0, 1]))
    geometry = scene_graph.RegisterAnchoredGeometry(source, instance)
    return scene_graph, source, geometry


def listening():
    lcm, heard = DrakeLcm("memq://"), []
    lcm.SubscribeAllChannels(lambda channel, raw: heard.append((channel, bytes(raw))))

    def messages():
        while lcm.HandleSubscriptions(0):
            pass
        found, heard[:] = list(heard), []
        return found

    return lcm, messages


def test_geometries_are_told_again_only_when_they_change():
    scene_graph, source, geometry = ball()
    lcm, messages = listening()
    builder = DiagramBuilder()
    builder.AddSystem(scene_graph)
    DrakeVisualizer.AddToBuilder(builder, scene_graph.get_query_output_port(), lcm)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1 / 64.0)
    load, draw = "DRAKE_VIEWER_LOAD_ROBOT", "DRAKE_VIEWER_DRAW"
    assert [channel for channel, _ in messages()] == [load, draw, draw]
    context = scene_graph.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    scene_graph.RemoveRole(context, source, geometry, Role.kIllustration)
    simulator.AdvanceTo(2 / 64.0)
    (first, told), (second, _) = messages()
    assert (first, second) == (load, draw) and lcmt_viewer_load_robot.decode(told).link == []


def test_a_model_is_told_at_once():
    scene_graph, source, _ = ball()
    frame = scene_graph.RegisterFrame(source, GeometryFrame("arm", 7))
    instance = GeometryInstance(RigidTransform([1, 0, 0]), Sphere(0.25), "hand")
    instance.set_illustration_properties(IllustrationProperties())
    scene_graph.RegisterGeometry(source, frame, instance)
    lcm, messages = listening()
    DrakeVisualizer.DispatchLoadMessage(scene_graph, lcm, DrakeVisualizerParams(use_role_channel_suffix=True))
    ((channel, raw),) = messages()
    assert channel == "DRAKE_VIEWER_LOAD_ROBOT_ILLUSTRATION"
    world, arm = lcmt_viewer_load_robot.decode(raw).link
    assert (world.name, world.robot_num, arm.name, arm.robot_num) == ("world", 0, "src::arm", 7)
    assert world.geom[0].color == [1, 0, 0, 1]
    assert arm.geom[0].position == [1, 0, 0] and arm.geom[0].float_data == [0.25]


def test_messages_go_there_and_back():
    draw = lcmt_viewer_draw(timestamp=5, num_links=2, link_name=["a", "b"], robot_num=[1, 2])
    draw.position, draw.quaternion = [[1, 2, 3], [4, 5, 6]], [[1, 0, 0, 0], [0, 0, 0, 1]]
    again = lcmt_viewer_draw.decode(draw.encode())
    assert (again.position, again.quaternion) == (draw.position, draw.quaternion)
    assert lcmt_viewer_draw().position == [] and lcmt_viewer_draw.decode(lcmt_viewer_draw().encode()).position == []


def test_wrong_use():
    with pytest.raises(RuntimeError, match="positive publish period; 0 was given"):
        DrakeVisualizer(params=DrakeVisualizerParams(publish_period=0.0))
    with pytest.raises(RuntimeError, match="choose proximity, perception, or illustration"):
        DrakeVisualizer(params=DrakeVisualizerParams(role=Role.kUnassigned))
    with pytest.raises(RuntimeError, match="lcm is None"):
        DrakeVisualizer.DispatchLoadMessage(SceneGraph(), None)
    with pytest.raises(RuntimeError, match="does not support MeshcatCone"):
        DrakeVisualizer.DispatchLoadMessage(ball(MeshcatCone(1, 2, 3))[0], DrakeLcm("memq://"))
    with pytest.raises(TypeError, match=r"accepted: .builder: DiagramBuilder, scene_graph: SceneGraph"):
        DrakeVisualizer.AddToBuilder(DiagramBuilder(), None)
    lonely = DrakeVisualizer(DrakeLcm("memq://"))
    with pytest.raises(RuntimeError, match="'query_object' is not connected"):
        lonely.ForcedPublish(lonely.CreateDefaultContext())
