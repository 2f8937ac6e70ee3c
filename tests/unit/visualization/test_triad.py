"""AddFrameTriadIllustration: which axes are drawn where, and in which color."""

import numpy as np
import pytest

from sheldrake.geometry import Role
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.multibody.tree import FixedOffsetFrame
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.visualization import AddFrameTriadIllustration


@pytest.fixture
def scene():
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    body = plant.AddRigidBody("rod", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    frame = plant.AddFrame(FixedOffsetFrame("tip", body.body_frame(), RigidTransform([1.0, 0, 0])))
    return plant, scene_graph, body, frame


def axes(scene_graph, ids):
    """Returns name, direction, middle [m] and color of each axis."""
    inspector = scene_graph.model_inspector()
    found = []
    for geometry in ids:
        X_BA = inspector.GetPoseInFrame(geometry)
        color = inspector.GetProperties(geometry, Role.kIllustration).GetProperty("phong", "diffuse")
        direction = np.abs(X_BA.rotation().matrix()[:, 2])
        found.append((inspector.GetName(geometry), direction, X_BA.translation(), color.rgba))
    return found


def test_axes_of_a_body(scene):
    plant, scene_graph, body, _ = scene
    for i, (name, direction, middle, color) in enumerate(
        axes(scene_graph, AddFrameTriadIllustration(scene_graph=scene_graph, body=body))
    ):
        assert name == f"_frames::rod(1)::{'xyz'[i]}-axis"
        assert direction == pytest.approx(np.eye(3)[i]) and middle == pytest.approx(0.15 * np.eye(3)[i])
        assert color == pytest.approx([*np.eye(3)[i], 0.9])
    inspector = scene_graph.model_inspector()
    ids = inspector.GetGeometries(plant.GetBodyFrameIdOrThrow(body.index()), Role.kIllustration)
    assert len(ids) == 3


@pytest.mark.parametrize("by", ["frame", "frame_index"])
def test_axes_of_a_fixed_frame_are_darker_and_at_their_place(scene, by):
    plant, scene_graph, _, frame = scene
    which = {"frame": frame} if by == "frame" else {"frame_index": frame.index(), "plant": plant}
    X_FT = RigidTransform([0, 0, 7.0])
    ids = AddFrameTriadIllustration(scene_graph=scene_graph, **which, length=2.0, opacity=0.5, name="t", X_FT=X_FT)
    for i, (name, _, middle, color) in enumerate(axes(scene_graph, ids)):
        assert name == f"_frames::t::{'xyz'[i]}-axis"
        assert middle == pytest.approx([1, 0, 7] + np.eye(3)[i])
        assert color == pytest.approx([*0.5 * np.eye(3)[i], 0.5])


def test_axes_by_the_scene_graphs_number(scene):
    plant, scene_graph, body, _ = scene
    frame_id = plant.GetBodyFrameIdOrThrow(body.index())
    ids = AddFrameTriadIllustration(scene_graph=scene_graph, plant=plant, frame_id=frame_id)
    assert axes(scene_graph, ids)[0][0] == "_frames::rod(1)::x-axis"


def test_errors(scene):
    plant, scene_graph, body, frame = scene
    frame_id = plant.GetBodyFrameIdOrThrow(body.index())
    for wrong in ({}, {"body": body, "frame": frame}):
        with pytest.raises(ValueError, match="exactly one of body="):
            AddFrameTriadIllustration(scene_graph=scene_graph, **wrong)
    for argument, value in (("frame_index", frame.index()), ("frame_id", frame_id)):
        with pytest.raises(ValueError, match=f"{argument}=, the plant cannot be None"):
            AddFrameTriadIllustration(scene_graph=scene_graph, **{argument: value})
    with pytest.raises(ValueError, match="Mismatched body= and plant="):
        AddFrameTriadIllustration(scene_graph=scene_graph, body=body, plant=MultibodyPlant(0.0))
    AddFrameTriadIllustration(scene_graph=scene_graph, body=body)
    with pytest.raises(RuntimeError, match="_frames::rod"):
        AddFrameTriadIllustration(scene_graph=scene_graph, body=body)
