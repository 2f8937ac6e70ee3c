"""The visualizers and sliders of diagrams on floats and on derivatives, by keyword as scripts call them."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import (
    GeometryInstance,
    HalfSpace,
    MakePhongIllustrationProperties,
    Meshcat,
    MeshcatPointCloudVisualizer_,
    MeshcatVisualizer_,
    MeshcatVisualizerParams,
    SceneGraph_,
    Sphere,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.meshcat import ContactVisualizer_, ContactVisualizerParams, JointSliders_
from sheldrake.multibody.plant import CoulombFriction, MultibodyPlant_
from sheldrake.perception import PointCloud
from sheldrake.systems.analysis import Simulator_
from sheldrake.systems.framework import DiagramBuilder_
from sheldrake.visualization import MeshcatPoseSliders_


@pytest.mark.parametrize("T", [float, AutoDiffXd])
def test_scene_and_cloud(T):
    meshcat, builder = Meshcat(port=0), DiagramBuilder_[T]()
    scene_graph = builder.AddSystem(SceneGraph_[T]())
    source = scene_graph.RegisterSource("models")
    ball = scene_graph.RegisterAnchoredGeometry(source, GeometryInstance(RigidTransform(), Sphere(1.0), "ball"))
    scene_graph.AssignRole(source, ball, MakePhongIllustrationProperties([1, 0, 0, 1]))
    visualizer = MeshcatVisualizer_[T].AddToBuilder(
        builder=builder, scene_graph=scene_graph, meshcat=meshcat, params=MeshcatVisualizerParams()
    )
    assert isinstance(visualizer, MeshcatVisualizer_[T])
    cloud = builder.AddSystem(MeshcatPointCloudVisualizer_[T](meshcat=meshcat, path="cloud", publish_period=1 / 12.0))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    cloud.cloud_input_port().FixValue(cloud.GetMyContextFromRoot(context), AbstractValue.Make(PointCloud(4)))
    diagram.ForcedPublish(context)
    assert meshcat.HasPath("cloud") and meshcat.HasPath("visualizer/ball")


@pytest.mark.parametrize("T", [float, AutoDiffXd])
def test_contacts_and_sliders(T):
    meshcat, builder = Meshcat(port=0), DiagramBuilder_[T]()
    plant, scene_graph = builder.AddSystem(MultibodyPlant_[T](0.01)), builder.AddSystem(SceneGraph_[T]())
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    builder.Connect(plant.get_geometry_pose_output_port(), scene_graph.get_source_pose_port(plant.get_source_id()))
    builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    body, friction = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1)), CoulombFriction(1, 1)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), "shell", friction)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0, 0, 0.0999]))
    params = ContactVisualizerParams(prefix="forces", publish_period=0.01)
    visualizer = ContactVisualizer_[T].AddToBuilder(builder=builder, plant=plant, meshcat=meshcat, params=params)
    assert isinstance(visualizer, ContactVisualizer_[T])
    sliders = builder.AddSystem(JointSliders_[T](meshcat=meshcat, plant=plant, step=[0.25] * 7))
    simulator = Simulator_[T](builder.Build())
    simulator.AdvanceTo(0.02)
    arrow = meshcat._hub.tree.get("/drake/forces/point/ball+world")
    assert arrow.properties["visible"] is True and arrow.pose.dtype == float
    q = sliders.Run(diagram=simulator.get_system(), timeout=0.0, stop_button_keycode="")
    assert [float(x.value()) if T is AutoDiffXd else x for x in q] == pytest.approx([1, 0, 0, 0, 0, 0, 0.0], abs=0.13)


@pytest.mark.parametrize("T", [float, AutoDiffXd])
def test_pose_sliders(T):
    sliders = MeshcatPoseSliders_[T](meshcat=Meshcat(port=0), initial_pose=RigidTransform([0.5, 0, 0]))
    pose = sliders.Run(system=sliders, context=sliders.CreateDefaultContext(), timeout=0.0)
    assert np.allclose(pose.translation(), [0.5, 0, 0])
