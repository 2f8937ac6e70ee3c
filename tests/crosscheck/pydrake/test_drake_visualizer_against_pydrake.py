"""What DrakeVisualizer tells viewers: the same scene through both libraries gives the same messages."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from sheldrake.lcm._messages import lcmt_viewer_draw, lcmt_viewer_load_robot

pytestmark = pytest.mark.peer

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def scene(lib, mesh):
    """A scene of every shape on the world, a frame and its child; some without color, some without a role."""
    scene_graph = lib.SceneGraph()
    source = scene_graph.RegisterSource("src")
    frame = scene_graph.RegisterFrame(source, lib.GeometryFrame("frame", 3))
    child = scene_graph.RegisterFrame(source, frame, lib.GeometryFrame("child", 4))
    empty = scene_graph.RegisterFrame(source, lib.GeometryFrame("empty", 5))
    X = lib.RigidTransform(lib.RollPitchYaw(0.1, 0.2, 0.3), [1, 2, 3])
    shapes = [lib.Box(1, 2, 3), lib.Sphere(0.5), lib.Cylinder(0.1, 0.2), lib.Capsule(0.3, 0.4), lib.Ellipsoid(1, 2, 3)]
    shapes += [lib.HalfSpace(), lib.Mesh(mesh, 2.0), lib.Convex(mesh, np.array([1.0, 2, 3]))]
    for i, shape in enumerate(shapes):
        owner = [scene_graph.world_frame_id(), frame, child][i % 3]
        geometry = scene_graph.RegisterGeometry(source, owner, lib.GeometryInstance(X, shape, f"g{i}"))
        looks = lib.IllustrationProperties()
        if i != 1:
            looks.AddProperty("phong", "diffuse", lib.Rgba(0.1 * i, 0.2, 0.3, 0.4))
        if i != 4:
            scene_graph.AssignRole(source, geometry, looks)
        if i != 3:
            scene_graph.AssignRole(source, geometry, lib.ProximityProperties())
    return scene_graph, source, (frame, child, empty)


def messages(name, mesh, role, suffix):
    """Loads and draws that a library publishes in 0.04 s."""
    lib = importlib.import_module(f"{name}.all")
    lcm = lib.DrakeLcm("memq://")
    heard = []
    lcm.SubscribeAllChannels(lambda channel, raw: heard.append((channel, bytes(raw))))
    scene_graph, source, (frame, child, empty) = scene(lib, mesh)
    builder = lib.DiagramBuilder()
    builder.AddSystem(scene_graph)
    params = lib.DrakeVisualizerParams(role=getattr(lib.Role, role), use_role_channel_suffix=suffix)
    visualizer = lib.DrakeVisualizer.AddToBuilder(builder, scene_graph, lcm, params)
    builder.ExportInput(scene_graph.get_source_pose_port(source), "poses")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    poses = lib.FramePoseVector()
    poses.set_value(frame, lib.RigidTransform([0.1, 0.2, 0.3]))
    poses.set_value(child, lib.RigidTransform(lib.RollPitchYaw(0, 0, 1), [1, 0, 0]))
    poses.set_value(empty, lib.RigidTransform())
    diagram.get_input_port().FixValue(context, poses)
    lib.Simulator(diagram, context).AdvanceTo(0.04)
    while lcm.HandleSubscriptions(0):
        pass
    # Deformable bodies will not come: only Drake sends that there are none.
    return visualizer.get_name(), [message for message in heard if "DEFORMABLE" not in message[0]]


def facets(geometry):
    """A mesh in numbers as a set of triangles, whatever comes first."""
    count, triangles = (int(n) for n in geometry.float_data[:2])
    vertices = np.reshape(geometry.float_data[2 : 2 + 3 * count], (count, 3))
    indices = np.reshape(geometry.float_data[2 + 3 * count :], (triangles, 3)).astype(int)
    found = set()
    for corners in vertices[indices]:
        ring = [tuple(np.round(corner, 6) + 0.0) for corner in corners]
        first = ring.index(min(ring))
        found.add(tuple(ring[first:] + ring[:first]))
    return found


def said(geometry):
    mesh = geometry.type == geometry.MESH and not geometry.string_data
    numbers = facets(geometry) if mesh else np.round(geometry.float_data, 6).tolist()
    rounded = [np.round(values, 6).tolist() for values in (geometry.position, geometry.quaternion, geometry.color)]
    return geometry.type, geometry.string_data, rounded, numbers


@pytest.mark.parametrize("suffix", [False, True])
@pytest.mark.parametrize("role", ["kIllustration", "kProximity", "kPerception"])
def test_the_same_messages(tmp_path, role, suffix):
    pytest.importorskip("pydrake")
    (tmp_path / "mesh.obj").write_text(CORNERS)
    mesh = str(tmp_path / "mesh.obj")
    (our_name, ours), (their_name, theirs) = (messages(lib, mesh, role, suffix) for lib in ("sheldrake", "pydrake"))
    assert our_name == their_name
    assert [channel for channel, _ in ours] == [channel for channel, _ in theirs] and len(ours) >= 4
    for (channel, mine), (_, other) in zip(ours, theirs):
        kind = lcmt_viewer_load_robot if "LOAD" in channel else lcmt_viewer_draw
        a, b = kind.decode(mine), kind.decode(other)
        if kind is lcmt_viewer_draw:
            assert (a.timestamp, a.link_name, a.robot_num) == (b.timestamp, b.link_name, b.robot_num)
            assert np.array(a.position) == pytest.approx(np.array(b.position))
            assert np.array(a.quaternion) == pytest.approx(np.array(b.quaternion))
            continue
        assert [(link.name, link.robot_num) for link in a.link] == [(link.name, link.robot_num) for link in b.link]
        for mine_of, other_of in zip(a.link, b.link):
            assert [said(g) for g in mine_of.geom] == [said(g) for g in other_of.geom]
