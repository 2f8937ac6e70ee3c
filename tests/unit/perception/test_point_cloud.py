"""PointCloud: what it holds, and what is made of it."""

import copy

import numpy as np
import pytest

from sheldrake.common.value import AbstractValue, Value
from sheldrake.geometry._point_cloud import fitted_normals
from sheldrake.perception import BaseField, Concatenate, Fields, PointCloud

ALL = Fields(BaseField.kXYZs | BaseField.kNormals | BaseField.kRGBs)


def cloud_of(points, rgbs=None):
    points = np.asarray(points, float)
    cloud = PointCloud(len(points), Fields(BaseField.kXYZs if rgbs is None else BaseField.kXYZs | BaseField.kRGBs))
    cloud.mutable_xyzs()[:] = points.T
    if rgbs is not None:
        cloud.mutable_rgbs()[:] = np.asarray(rgbs).T
    return cloud


def test_fields_are_sets():
    both = Fields(BaseField.kXYZs) | Fields(BaseField.kRGBs)
    assert both == Fields(10) and both & Fields(6) == Fields(BaseField.kXYZs) and both != ALL
    assert both.base_fields() == 10 and both.has_base_fields() and not Fields(BaseField.kNone).has_base_fields()
    assert repr(both) == "Fields(base_fields=10)" and str(BaseField.kRGBs) == "BaseField.kRGBs"
    for wrong in (16, -1):
        with pytest.raises(RuntimeError, match="no combination of BaseField"):
            Fields(wrong)


def test_new_points_are_nowhere_and_black():
    cloud = PointCloud(2, ALL)
    assert cloud.size() == 2 and cloud.fields() == ALL
    assert np.isnan(cloud.xyzs()).all() and np.isnan(cloud.normals()).all() and not cloud.rgbs().any()
    assert (cloud.xyzs().dtype, cloud.rgbs().dtype) == (np.float32, np.uint8)
    assert cloud.xyzs().shape == (3, 2) and cloud.xyzs().flags.f_contiguous
    assert PointCloud().size() == 0 and PointCloud().fields() == Fields(BaseField.kXYZs)


def test_views_are_written_through_or_not_at_all():
    cloud = PointCloud(3, ALL)
    cloud.mutable_xyzs()[:] = np.arange(9).reshape(3, 3)
    cloud.mutable_xyz(1)[:] = 7
    cloud.mutable_rgb(2)[:] = [1, 2, 3]
    cloud.mutable_normal(0)[:] = [0, 0, 1]
    assert cloud.xyzs().tolist() == [[0, 7, 2], [3, 7, 5], [6, 7, 8]]
    assert cloud.xyz(1).tolist() == [7, 7, 7] and cloud.rgb(2).tolist() == [1, 2, 3]
    assert cloud.normal(0).tolist() == [0, 0, 1] and cloud.rgbs()[:, 2].tolist() == [1, 2, 3]
    for view in (cloud.xyzs(), cloud.rgbs(), cloud.normals()):
        with pytest.raises(ValueError, match="read-only"):
            view[...] = 0
    cloud.xyz(1)[...] = 0
    assert cloud.xyz(1).tolist() == [7, 7, 7], "of one point it is a copy"


def test_resize_and_fields_keep_what_stays():
    cloud = cloud_of([[1, 2, 3], [4, 5, 6]], [[1, 2, 3], [4, 5, 6]])
    cloud.resize(3)
    assert cloud.xyz(1).tolist() == [4, 5, 6] and np.isnan(cloud.xyz(2)).all()
    cloud.resize(1)
    cloud.SetFields(Fields(BaseField.kXYZs | BaseField.kNormals))
    assert cloud.xyz(0).tolist() == [1, 2, 3] and np.isnan(cloud.normal(0)).all() and not cloud.has_rgbs()


def test_copies_are_their_own():
    cloud = cloud_of([[1, 2, 3]])
    empty = PointCloud(0, Fields(BaseField.kRGBs))
    empty.SetFrom(cloud)
    value = Value[PointCloud](cloud)
    for other in (copy.copy(cloud), copy.deepcopy(cloud), PointCloud(other=cloud), PointCloud(cloud), empty):
        other.mutable_xyz(0)[:] = 0
        assert cloud.xyz(0).tolist() == [1, 2, 3]
    assert AbstractValue.Make(cloud).get_value().size() == value.get_value().size() == 1


def test_crop_takes_what_is_in_the_box():
    cloud = cloud_of([[0, 0, 0], [1, 1, 1], [2, 0, 0], [np.nan] * 3], [[i] * 3 for i in range(4)])
    inside = cloud.Crop([0, 0, 0], [1, 1, 1])
    assert inside.rgbs()[0].tolist() == [0, 1]
    with pytest.raises(RuntimeError, match="not below"):
        cloud.Crop([1, 1, 1], [0, 0, 0])


def test_concatenate_in_order():
    both = Concatenate([cloud_of([[1, 1, 1]]), cloud_of([[2, 2, 2], [3, 3, 3]])])
    assert both.xyzs()[0].tolist() == [1, 2, 3] and both.size() == 3
    with pytest.raises(RuntimeError, match="same fields"):
        Concatenate([PointCloud(1), PointCloud(1, ALL)])
    with pytest.raises(RuntimeError, match="at least one"):
        Concatenate([])


def test_downsampling_keeps_the_mean_of_each_cube():
    rng = np.random.default_rng(5)
    points = rng.uniform(-1, 1, (2000, 3))
    cloud = cloud_of(points, rng.integers(0, 256, (2000, 3)))
    small = cloud.VoxelizedDownSample(0.5, parallelize=True)
    assert small.size() == 64
    cells = np.floor(points.astype(np.float32) / 0.5).astype(int)
    for i in range(small.size()):
        mine = (cells == np.floor(small.xyz(i) / 0.5)).all(axis=1)
        assert small.xyz(i) == pytest.approx(points[mine].mean(axis=0), abs=1e-6)
        assert np.abs(small.rgb(i) - cloud.rgbs()[:, mine].mean(axis=1)).max() < 1


def test_cells_of_a_huge_grid_keep_apart():
    """Counted through, the 10^24 cells between these points would not fit an integer; order is by x, then y, then z."""
    points = [[1e6, 0, 0], [0, 0, 1e6], [0, 1e6, 0], [-1e6, -1e6, -1e6], [0, 0, 1e6], [np.inf, 0, 0]]
    small = cloud_of(points).VoxelizedDownSample(0.01)
    assert np.array_equal(small.xyzs().T, [points[3], points[1], points[2], points[0]])
    assert cloud_of([[np.nan] * 3]).VoxelizedDownSample(0.01).size() == 0
    # Along one axis alone more cells than points times cells of an integer leave room for.
    far = np.array([[1e9, 0, 0], [-1e9, 1e9, 0], [1e9, 0, 0], [0, -1e9, 1e9]], np.float32)
    assert np.array_equal(cloud_of(far).VoxelizedDownSample(1e-9).xyzs().T, [far[1], far[3], far[0]])


def test_normals_and_colors_count_where_positions_do_and_normals_where_they_are_known():
    cloud = PointCloud(4, Fields(BaseField.kXYZs | BaseField.kNormals | BaseField.kRGBs))
    cloud.mutable_xyzs()[:] = np.array([[0.1, 0.1, 0.1], [0.2, 0.2, 0.2], [np.nan, 0.1, 0.1], [1.5, 0.1, 0.1]]).T
    cloud.mutable_normals()[:] = np.array([[0, 0, 1], [np.nan] * 3, [1, 0, 0], [np.nan] * 3]).T
    cloud.mutable_rgbs()[:] = np.array([[10, 20, 30], [20, 40, 60], [200, 0, 0], [7, 8, 9]]).T
    small = cloud.VoxelizedDownSample(1.0)
    np.testing.assert_array_equal(small.normals(), np.array([[0, 0, 1], [np.nan] * 3]).T)
    np.testing.assert_array_equal(small.rgbs(), np.array([[15, 30, 45], [7, 8, 9]]).T)


def test_normals_of_a_sphere_point_out():
    rng = np.random.default_rng(7)
    direction = rng.normal(size=(3, 4000))
    direction /= np.linalg.norm(direction, axis=0)
    cloud = cloud_of(direction.T)
    assert cloud.EstimateNormals(0.2, 12)
    cloud.FlipNormalsTowardPoint([0, 0, 0])
    # A chord of 0.2 bends by 0.1 rad at most.
    assert (np.einsum("ij,ij->j", cloud.normals(), direction) < -np.cos(0.12)).all()


def test_normals_with_few_neighbours():
    cloud = cloud_of([[0, 0, 0], [0.1, 0, 0], [5, 0, 0], [np.nan] * 3])
    assert not cloud.EstimateNormals(1.0, 3)
    assert abs(cloud.normal(0)[0]) < 1e-6 and np.linalg.norm(cloud.normal(0)) == pytest.approx(1)
    assert np.isnan(cloud.normals()[:, 2:]).all()
    for radius, count in ((0, 3), (1, 2)):
        with pytest.raises(RuntimeError, match="radius must be positive and num_closest at least 3"):
            cloud.EstimateNormals(radius, count)


def test_what_is_not_there_is_said():
    cloud = PointCloud(1, Fields(BaseField.kRGBs))
    for call in (cloud.xyzs, cloud.normals, lambda: cloud.VoxelizedDownSample(1), lambda: cloud.EstimateNormals(1, 3)):
        with pytest.raises(RuntimeError, match="has no"):
            call()
    with pytest.raises(RuntimeError, match="must have xyzs"):
        cloud.Crop([0] * 3, [1] * 3)
    with pytest.raises(RuntimeError, match="point 1 is not one of 1"):
        cloud.rgb(1)
    with pytest.raises(RuntimeError, match="without fields"):
        PointCloud(1, Fields(0))
    with pytest.raises(RuntimeError, match="negative"):
        PointCloud(-1)
    with pytest.raises(TypeError, match="got str"):
        PointCloud("3")


def test_normals_are_those_of_the_least_spread():
    """Against eigenvectors of NumPy, over clouds that are flat, straight, or far from the origin."""
    rng = np.random.default_rng(0)
    for scale, offset in ((1.0, 0.0), (1e-3, 0.0), (1.0, 1e3)):
        for spread in ((1.0, 1.0, 1.0), (1.0, 1.0, 1e-3), (1.0, 1e-3, 1e-3)):
            points = scale * rng.normal(size=(60, 3)) * spread + offset
            normals, complete = fitted_normals(points, 1e9, 60)
            assert complete
            away = points - points.mean(axis=0)
            variances, axes = np.linalg.eigh(away.T @ away)
            found = np.abs(normals @ axes)
            assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-14)
            rayleigh = np.einsum("ij,jk,ik->i", normals, away.T @ away, normals)
            assert (rayleigh <= variances[0] + 1e-9 * variances[2]).all()
            if variances[1] > 1.01 * variances[0]:
                assert (found[:, 0] > 1.0 - 1e-6).all()


def test_normals_of_exact_planes_and_lines():
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(25)], axis=1)
    normals, complete = fitted_normals(flat, 1.5, 9)
    assert complete
    np.testing.assert_array_equal(np.abs(normals), np.tile([0.0, 0.0, 1.0], (25, 1)))
    line = np.arange(6.0)[:, None] * [1.0, 1.0, 0.0]
    normals, _ = fitted_normals(line, 1.5, 2)
    np.testing.assert_allclose(normals @ [1.0, 1.0, 0.0], 0.0, atol=1e-15)
    assert np.isfinite(normals).all()
