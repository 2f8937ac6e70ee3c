"""Point clouds against pydrake's: the same numbers, point for point."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer


def of(library, module):
    return importlib.import_module(f"{library}.{module}")


def cloud(library, seed, size=300):
    p = of(library, "perception")
    rng = np.random.default_rng(seed)
    c = p.PointCloud(size, p.Fields(p.BaseField.kXYZs | p.BaseField.kRGBs | p.BaseField.kNormals))
    c.mutable_xyzs()[:] = rng.normal(size=(3, size))
    c.mutable_rgbs()[:] = rng.integers(0, 256, (3, size))
    c.mutable_normals()[:] = rng.normal(size=(3, size))
    c.mutable_xyzs()[:, ::50] = np.nan
    return c


def rows(c):
    """Positions, normals and colors of all points, sorted by position."""
    table = np.vstack([c.xyzs(), c.normals(), c.rgbs().astype(float)]).T
    return table[np.lexsort(np.round(c.xyzs(), 4))]


@pytest.mark.parametrize("seed", range(3))
def test_downsampling_and_cropping(seed):
    a, b = cloud("sheldrake", seed), cloud("pydrake", seed)
    for call in (lambda c: c.VoxelizedDownSample(0.7), lambda c: c.Crop([-1, -1, -0.5], [1, 0.5, 1])):
        assert np.allclose(rows(call(a)), rows(call(b)), atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_normals(seed):
    a, b = cloud("sheldrake", seed), cloud("pydrake", seed)
    for c in (a, b):
        c.mutable_xyzs()[:, ::50] = np.random.default_rng(9).normal(size=(3, 6))
        c.mutable_xyzs()[2] *= 0.01  # nearly flat: normals are well determined
    assert a.EstimateNormals(0.5, 8) == b.EstimateNormals(0.5, 8)
    for c in (a, b):
        c.FlipNormalsTowardPoint([0, 0, 10])
    x = a.xyzs().T.astype(float)
    determined = (np.linalg.norm(x[:, None] - x, axis=2) <= 0.5).sum(axis=1) >= 3
    assert determined.sum() > 250
    assert np.allclose(a.normals()[:, determined], b.normals()[:, determined], atol=2e-4)
    assert np.array_equal(np.isnan(a.normals()), np.isnan(b.normals()))


def points(library, fov=None):
    sensors, p, math = of(library, "systems.sensors"), of(library, "perception"), of(library, "math")
    rng = np.random.default_rng(2)
    camera = sensors.CameraInfo(20, 15, 30.0, 31.0, 9.0, 8.0) if fov is None else sensors.CameraInfo(20, 15, fov)
    system = p.DepthImageToPointCloud(camera, fields=p.BaseField.kXYZs | p.BaseField.kRGBs)
    depth, color = sensors.ImageDepth32F(20, 15), sensors.ImageRgba8U(20, 15)
    depth.mutable_data[...] = rng.uniform(0.5, 3, (15, 20, 1))
    depth.mutable_data[0, :3, 0] = [0, np.inf, np.nan]
    color.mutable_data[...] = rng.integers(0, 256, (15, 20, 4))
    context = system.CreateDefaultContext()
    system.depth_image_input_port().FixValue(context, depth)
    system.color_image_input_port().FixValue(context, color)
    pose = math.RigidTransform(math.RollPitchYaw(0.1, 0.2, 0.3), [1, 2, 3])
    system.camera_pose_input_port().FixValue(context, pose)
    result = system.point_cloud_output_port().Eval(context)
    return np.vstack([result.xyzs(), result.rgbs()])


def test_depth_images():
    assert np.allclose(points("sheldrake"), points("pydrake"), atol=1e-5, equal_nan=True)
    assert not np.allclose(points("sheldrake", 0.5), points("pydrake"), atol=1e-5, equal_nan=True), "the oracle sees it"


def concatenated(library):
    p, math = of(library, "perception"), of(library, "math")
    system = of(library, "systems.perception").PointCloudConcatenation(["a", "b", "c"])
    context = system.CreateDefaultContext()
    for i, name in enumerate("abc"):
        one = cloud(library, i, 60)
        one.SetFields(p.Fields(p.BaseField.kXYZs | (p.BaseField.kRGBs if i != 1 else p.BaseField.kNone)))
        system.GetInputPort(f"point_cloud_CiSi_{name}").FixValue(context, one)
        pose = math.RigidTransform(math.RollPitchYaw(0.1 * i, 0.2, 0.3), [1, 2, i])
        system.GetInputPort(f"X_FCi_{name}").FixValue(context, pose)
    whole = system.get_output_port().Eval(context)
    return np.vstack([whole.xyzs(), whole.rgbs()])


def test_concatenation():
    assert np.allclose(concatenated("sheldrake"), concatenated("pydrake"), atol=1e-5)
