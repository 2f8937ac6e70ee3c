"""From depth images to points, and from the points of many cameras to one cloud."""

import numpy as np
import pytest

from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.perception import BaseField, DepthImageToPointCloud, Fields, PointCloud
from sheldrake.systems.perception import PointCloudConcatenation
from sheldrake.systems.sensors import CameraInfo, ImageDepth16U, ImageDepth32F, ImageRgba8U, PixelType

CAMERA = CameraInfo(40, 30, 50.0, 60.0, 19.0, 14.0)
X_PC = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1, 2, 3])


def converted(system, depth, **inputs):
    context = system.CreateDefaultContext()
    system.depth_image_input_port().FixValue(context, depth)
    for name, value in inputs.items():
        getattr(system, f"{name}_input_port")().FixValue(context, value)
    return system.point_cloud_output_port().Eval(context)


def plane(z):
    image = ImageDepth32F(40, 30)
    image.mutable_data[...] = z
    return image


def test_projecting_the_points_gives_the_pixels_back():
    depth = plane(0)
    depth.mutable_data[..., 0] = np.random.default_rng(3).uniform(0.5, 3, (30, 40))
    x, y, z = converted(DepthImageToPointCloud(CAMERA), depth).xyzs().astype(float)
    u, v = 50 * x / z + 19, 60 * y / z + 14
    assert u.reshape(30, 40) == pytest.approx(np.tile(np.arange(40.0), (30, 1)), abs=1e-4)
    assert v.reshape(30, 40) == pytest.approx(np.tile(np.arange(30.0)[:, None], (1, 40)), abs=1e-4)
    assert np.array_equal(z, depth.data.ravel().astype(float))


def test_the_pose_moves_the_points():
    still = converted(DepthImageToPointCloud(CAMERA), plane(2.0)).xyzs().astype(float)
    moved = converted(DepthImageToPointCloud(CAMERA), plane(2.0), camera_pose=X_PC).xyzs()
    assert moved == pytest.approx(X_PC.rotation().matrix() @ still + X_PC.translation()[:, None], abs=1e-5)


def test_pixels_without_depth():
    depth = plane(1.0)
    depth.mutable_data[0, :3, 0] = [0, np.inf, np.nan]
    points = converted(DepthImageToPointCloud(CAMERA), depth, camera_pose=X_PC).xyzs()
    assert np.isposinf(points[:, :2]).all() and np.isnan(points[:, 2]).all() and np.isfinite(points[:, 3:]).all()
    millimetres = ImageDepth16U(40, 30)
    millimetres.mutable_data[0, :4, 0] = [0, 65535, 65534, 500]
    points = converted(DepthImageToPointCloud(CAMERA, PixelType.kDepth16U, scale=0.001), millimetres).xyzs()
    assert np.isposinf(points[2, :2]).all() and points[2, 2:4] == pytest.approx([65.534, 0.5])


def test_colors_come_along():
    system = DepthImageToPointCloud(CAMERA, fields=BaseField.kXYZs | BaseField.kRGBs)
    color = ImageRgba8U(40, 30)
    color.mutable_data[...] = np.random.default_rng(1).integers(0, 256, (30, 40, 4))
    assert np.array_equal(converted(system, plane(1), color_image=color).rgbs().T, color.data[..., :3].reshape(-1, 3))
    assert not converted(system, plane(1)).rgbs().any()
    with pytest.raises(RuntimeError, match="color image has 2 x 2 pixels, the depth image 40 x 30"):
        converted(system, plane(1), color_image=ImageRgba8U(2, 2))


def test_wrong_pixels():
    with pytest.raises(RuntimeError, match="kDepth16U or kDepth32F, got PixelType"):
        DepthImageToPointCloud(CAMERA, PixelType.kRgba8U)


def test_clouds_of_many_cameras_become_one():
    system = PointCloudConcatenation(["a", "b"], default_rgb=[10, 20, 30])
    context = system.CreateDefaultContext()
    a, b = PointCloud(2), PointCloud(1, Fields(BaseField.kXYZs | BaseField.kRGBs))
    a.mutable_xyzs()[:] = np.array([[1, 2, 3], [np.nan, 0, 0]]).T
    b.mutable_xyzs()[:], b.mutable_rgbs()[:] = 5, 7
    for name, cloud, X in (("a", a, X_PC), ("b", b, RigidTransform())):
        system.GetInputPort(f"point_cloud_CiSi_{name}").FixValue(context, cloud)
        system.GetInputPort(f"X_FCi_{name}").FixValue(context, X)
    whole = system.GetOutputPort("point_cloud_FS").Eval(context)
    assert whole.xyzs().T == pytest.approx(np.array([[5, 5, 5], X_PC.multiply(np.array([1.0, 2, 3]))]), abs=1e-6)
    assert whole.rgbs().T.tolist() == [[7, 7, 7], [10, 20, 30]]
    with pytest.raises(RuntimeError, match="already has an input port"):
        PointCloudConcatenation(["a", "a"])
    with pytest.raises(ValueError, match="3 numbers"):
        PointCloudConcatenation(["a"], [1, 2])
