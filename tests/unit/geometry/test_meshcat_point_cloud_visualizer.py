"""MeshcatPointCloudVisualizer: what is drawn of a cloud, where and how often."""

import numpy as np
import pytest

from sheldrake.geometry import Meshcat, MeshcatPointCloudVisualizer, Rgba
from sheldrake.math import RigidTransform
from sheldrake.perception import BaseField, Fields, PointCloud
from sheldrake.systems.analysis import Simulator


def drawn(meshcat):
    return meshcat._hub.tree.get("/drake/cloud")


def test_points_colors_size_and_pose():
    meshcat = Meshcat(port=0)
    visualizer = MeshcatPointCloudVisualizer(meshcat, "cloud")
    visualizer.set_point_size(0.1)
    visualizer.set_default_rgba(Rgba(1, 0, 0))
    context = visualizer.CreateDefaultContext()
    cloud = PointCloud(2, Fields(BaseField.kXYZs | BaseField.kRGBs))
    cloud.mutable_xyzs()[:], cloud.mutable_rgbs()[:] = [[1, np.nan], [2, 0], [3, 0]], 9
    visualizer.cloud_input_port().FixValue(context, cloud)
    visualizer.ForcedPublish(context)
    assert drawn(meshcat).object.points.tolist() == [[1, 2, 3]] and drawn(meshcat).object.size == 0.1
    assert drawn(meshcat).object.colors.tolist() == [[9, 9, 9]]
    assert np.array_equal(drawn(meshcat).pose, np.eye(4)[:3])
    visualizer.pose_input_port().FixValue(context, RigidTransform([1, 0, 0]))
    cloud.SetFields(Fields(BaseField.kXYZs))
    visualizer.cloud_input_port().FixValue(context, cloud)
    visualizer.ForcedPublish(context)
    assert drawn(meshcat).pose[0, 3] == 1 and drawn(meshcat).object.colors.tolist() == [255, 0, 0]
    visualizer.Delete()
    assert not meshcat.HasPath("cloud")


@pytest.mark.parametrize("period", [0.25, 0.0])
def test_it_publishes_as_time_goes(period):
    meshcat = Meshcat(port=0)
    visualizer = MeshcatPointCloudVisualizer(meshcat, "cloud", period)
    simulator = Simulator(visualizer)
    visualizer.cloud_input_port().FixValue(simulator.get_mutable_context(), PointCloud(1))
    simulator.AdvanceTo(0.5)
    assert drawn(meshcat) is not None


def test_errors():
    meshcat = Meshcat(port=0)
    with pytest.raises(RuntimeError, match="must not be negative, got -1"):
        MeshcatPointCloudVisualizer(meshcat, "cloud", -1.0)
    visualizer = MeshcatPointCloudVisualizer(meshcat, "cloud")
    with pytest.raises(RuntimeError, match="cloud"):
        visualizer.ForcedPublish(visualizer.CreateDefaultContext())
