"""What carried poses and drew contacts in 2021 still does, with a hint."""

import numpy as np
import pytest

import sheldrake.all as m
from sheldrake._pydrake.retired import meshcat_visualizer as viewer
from sheldrake.common.deprecation import DrakeDeprecationWarning

pytestmark = pytest.mark.filterwarnings("ignore::sheldrake.common.deprecation.DrakeDeprecationWarning")


def test_a_pose_vector_is_seven_numbers():
    X = m.RigidTransform(m.RollPitchYaw(0.1, 0.2, 0.3), [1.0, 2.0, 3.0])
    with pytest.warns(DrakeDeprecationWarning, match="PoseVector"):
        pose = m.PoseVector(X.rotation().ToQuaternion(), X.translation())
    assert pose.get_transform().IsNearlyEqualTo(X, 1e-15)
    np.testing.assert_array_equal(pose.CopyToVector()[:3], [1, 2, 3])
    assert m.PoseVector().get_transform().IsExactlyEqualTo(m.RigidTransform()) and pose.size() == m.PoseVector.kSize
    copy = pose.Clone()
    copy.set_transform(m.RigidTransform())
    assert pose.get_transform().IsNearlyEqualTo(X, 1e-15)


def test_an_aggregator_makes_one_bundle_of_poses():
    aggregator = m.PoseAggregator()
    single = aggregator.AddSingleInput("ball", 3)
    both = aggregator.AddSinglePoseAndVelocityInput("arm", 4)
    many = aggregator.AddBundleInput("robot", 2)
    context = aggregator.CreateDefaultContext()
    single.FixValue(context, m.PoseVector(translation=[1, 0, 0]).CopyToVector())
    both.pose_input_port.FixValue(context, m.PoseVector(translation=[2, 0, 0]).CopyToVector())
    both.velocity_input_port.FixValue(context, m.FrameVelocity(m.SpatialVelocity([0, 0, 1], [5, 0, 0])).CopyToVector())
    bundle = m.PoseBundle(2)
    for i, name in enumerate(("hand", "foot")):
        bundle.set_name(i, name)
        bundle.set_model_instance_id(i, 7)
        bundle.set_transform(i, m.RigidTransform([0, i, 0]))
    many.FixValue(context, m.AbstractValue.Make(bundle))
    out = aggregator.get_output_port(0).Eval(context)
    assert [out.get_name(i) for i in range(out.get_num_poses())] == ["ball", "arm", "robot::hand", "robot::foot"]
    assert [out.get_model_instance_id(i) for i in range(4)] == [3, 4, 7, 7]
    positions = [out.get_transform(i).translation().tolist() for i in range(4)]
    assert positions == [[1, 0, 0], [2, 0, 0], [0, 0, 0], [0, 1, 0]]
    assert out.get_velocity(1).translational().tolist() == [5, 0, 0] and not any(out.get_velocity(0).rotational())


def test_contacts_clouds_and_triads_are_drawn_into_the_viewers_page():
    builder = m.DiagramBuilder()
    plant, scene_graph = m.AddMultibodyPlantSceneGraph(builder, 0.001)
    body = plant.AddRigidBody("ball", m.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    for owner, shape in ((body, m.Sphere(0.1)), (plant.world_body(), m.HalfSpace())):
        plant.RegisterCollisionGeometry(owner, m.RigidTransform(), shape, "shape", m.CoulombFriction(1, 1))
    plant.SetDefaultFloatingBaseBodyPose(body, m.RigidTransform([0, 0, 0.0999]))
    plant.Finalize()
    page = viewer.ConnectMeshcatVisualizer(builder, scene_graph, zmq_url=None)
    contacts = builder.AddSystem(viewer.MeshcatContactVisualizer(meshcat_viz=page, force_threshold=0.0001, plant=plant))
    builder.Connect(plant.get_contact_results_output_port(), contacts.GetInputPort("contact_results"))
    cloud = m.PointCloud(5)
    cloud.mutable_xyzs()[:] = 0.5
    source = builder.AddSystem(m.ConstantValueSource(m.AbstractValue.Make(cloud)))
    clouds = builder.AddSystem(viewer.MeshcatPointCloudVisualizer(page, X_WP=m.RigidTransform([0, 0, 1])))
    builder.Connect(source.get_output_port(), clouds.GetInputPort("point_cloud_P"))
    viewer.AddTriad(page.vis, "frame", "triads", length=0.5)
    m.Simulator(builder.Build()).AdvanceTo(0.1)
    for path in ("triads/frame/x-axis", "point_cloud/cloud", "/drake/contact_forces/point"):
        assert page.meshcat.HasPath(path), path
