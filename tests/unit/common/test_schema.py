import copy

import numpy as np
import pytest

from sheldrake.common import RandomGenerator, schema
from sheldrake.common.schema import (
    Deterministic,
    DeterministicVector,
    Gaussian,
    GaussianVector,
    GaussianVectorX,
    Rotation,
    Transform,
    Uniform,
    UniformDiscrete,
    UniformVector,
    UniformVectorX,
)
from sheldrake.common.yaml import yaml_dump_typed, yaml_load_typed
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix


def test_statistics_of_samples():
    generator = RandomGenerator(1)
    for distribution, mean, deviation in (
        (Deterministic(2.0), 2.0, 0.0),
        (Gaussian(mean=1.0, stddev=2.0), 1.0, 2.0),
        (Uniform(min=1.0, max=4.0), 2.5, 3.0 / np.sqrt(12.0)),
        (UniformDiscrete(values=[1.0, 2.0, 6.0]), 3.0, np.sqrt(14.0 / 3.0)),
    ):
        samples = [distribution.Sample(generator) for _ in range(4000)]
        assert distribution.Mean() == mean
        assert np.mean(samples) == pytest.approx(mean, abs=5 * deviation / np.sqrt(4000))
        assert np.std(samples) == pytest.approx(deviation, abs=0.05 * deviation)
        expression = distribution.ToSymbolic()
        middle = {v: 0.5 if "uniform" in v.get_name() else 0.0 for v in expression.GetVariables()}
        assert min(samples) <= expression.Evaluate(middle) <= max(samples)


def test_vectors():
    generator = RandomGenerator(1)
    assert GaussianVectorX([1, 2], [0.0]).Sample(generator).tolist() == [1.0, 2.0]
    assert UniformVectorX([1, 2], [3, 4]).Mean().tolist() == [2.0, 3.0]
    assert DeterministicVector[3]([1, 2, 3]).Sample(generator).tolist() == [1.0, 2.0, 3.0]
    assert str(UniformVector[2]([1, 2], [3, 4]).ToSymbolic()[0]).endswith("random_uniform_0)")
    with pytest.raises(TypeError):
        DeterministicVector[3]([1, 2])
    with pytest.raises(RuntimeError, match="size 2 mean but size 3 dev"):
        GaussianVectorX([1, 2], [1, 2, 3]).Sample(generator)
    with pytest.raises(RuntimeError, match="Invalid instantiation"):
        GaussianVector[7]


def test_deterministic_or_not():
    for value, known in (
        (3.0, True),
        (Gaussian(1, 0), True),
        (Gaussian(1, 2), False),
        (Uniform(1, 1), True),
        (UniformDiscrete([1]), True),
        (UniformDiscrete([1, 2]), False),
        ([1, 2], True),
        (GaussianVectorX([1, 2], [0, 1]), False),
        (UniformVectorX([1, 2], [1, 2]), True),
    ):
        assert schema.IsDeterministic(value) is known
        if known:
            assert np.all(schema.GetDeterministicValue(value) == schema.GetDeterministicValue(value))
        else:
            with pytest.raises(RuntimeError, match="contains a"):
                schema.GetDeterministicValue(value)
    assert schema.Mean(3) == schema.Sample(3.0, RandomGenerator()) == 3.0
    assert type(schema.ToDistribution(3.0)) is Deterministic
    assert type(schema.ToDistributionVector([1, 2])) is schema.DeterministicVectorX
    with pytest.raises(RuntimeError, match="empty"):
        UniformDiscrete().Mean()
    for wrong in (
        lambda: schema.Mean([1, 2]),
        lambda: schema.ToDistribution("a"),
        lambda: schema.Distribution(),
        lambda: schema.DistributionVector(),
        lambda: Gaussian(1),
        lambda: Gaussian("a", 2),
    ):
        with pytest.raises(TypeError):
            wrong()


def test_fields_are_checked_when_set():
    gaussian = Gaussian(1, 2)
    gaussian.mean = 3
    assert gaussian.Mean() == 3.0 and copy.deepcopy(gaussian).stddev == 2.0 and Gaussian(gaussian).mean == 3.0
    with pytest.raises(TypeError):
        gaussian.mean = "a"
    with pytest.raises(AttributeError):
        gaussian.meen = 1
    with pytest.raises(AttributeError):
        Transform(foo=3)
    with pytest.raises(TypeError):
        Transform(translation=[1, 2])
    with pytest.raises(TypeError):
        Rotation.Rpy([1, 2, 3])
    with pytest.raises(TypeError):
        Rotation(Rotation.Rpy())
    with pytest.raises(TypeError):
        Rotation().value = 3


def test_rotations():
    for rotation, expected in (
        (Rotation(), RotationMatrix()),
        (Rotation(value=Rotation.Rpy(deg=[10, 20, 30])), RotationMatrix(RollPitchYaw(np.radians([10, 20, 30])))),
        (Rotation(value=Rotation.AngleAxis(angle_deg=90, axis=[0, 0, 2])), RotationMatrix.MakeZRotation(np.pi / 2)),
        (Rotation(RotationMatrix.MakeXRotation(0.3)), RotationMatrix.MakeXRotation(0.3)),
        (Rotation(RollPitchYaw(0.1, 0.2, 0.3)), RotationMatrix(RollPitchYaw(0.1, 0.2, 0.3))),
    ):
        assert rotation.IsDeterministic()
        np.testing.assert_allclose(rotation.GetDeterministicValue().matrix(), expected.matrix(), atol=1e-15)
        symbolic = [x.Evaluate() for x in rotation.ToSymbolic().matrix().flat]
        np.testing.assert_allclose(symbolic, expected.matrix().ravel(), atol=1e-15)
    for random in (
        Rotation(value=Rotation.Uniform()),
        Rotation(value=Rotation.Rpy(deg=GaussianVector[3]([1, 2, 3], [1, 2, 3]))),
        Rotation(value=Rotation.AngleAxis(angle_deg=Uniform(0, 10), axis=[0, 0, 1])),
    ):
        assert not random.IsDeterministic()
        with pytest.raises(RuntimeError, match="is random"):
            random.GetDeterministicValue()
        X = Transform(rotation=random)
        assert X.Sample(RandomGenerator(1)).rotation().IsValid() and X.Mean().rotation().IsValid()
    rotation = Rotation()
    rotation.set_rpy_deg(rpy_deg=[1, 2, 3])
    assert rotation.value.deg.tolist() == [1.0, 2.0, 3.0]


def test_transforms():
    X = Transform(base_frame="a", translation=[1, 2, 3], rotation=Rotation(value=Rotation.Rpy(deg=[0, 0, 90])))
    twin = copy.copy(X)
    twin.set_rotation_rpy_deg([0, 0, 0])
    assert X.IsDeterministic() and X.GetDeterministicValue().IsNearlyEqualTo(X.Mean(), 1e-15)
    np.testing.assert_allclose(X.GetDeterministicValue() @ [1, 0, 0], [1, 3, 3], atol=1e-15)
    assert Transform(RigidTransform([1, 2, 3])).translation.tolist() == [1, 2, 3]
    random = Transform(translation=UniformVector[3]([1, 2, 3], [4, 5, 6]))
    p = random.Sample(generator=RandomGenerator(1)).translation()
    assert ((p >= [1, 2, 3]) & (p <= [4, 5, 6])).all() and random.Mean().translation().tolist() == [2.5, 3.5, 4.5]
    with pytest.raises(RuntimeError, match="is random"):
        random.GetDeterministicValue()
    assert repr(Transform()) == (
        "Transform(base_frame=None, translation=array([0., 0., 0.]), rotation=Rotation(value=Identity()))"
    )


@pytest.mark.parametrize(
    "text",
    [
        "base_frame: a\ntranslation: [1.0, 2.0, 3.0]\nrotation: !Rpy\n  deg: [10.0, 20.0, 30.0]\n",
        "translation: !UniformVector\n  min: [1.0, 2.0, 3.0]\n  max: [4.0, 5.0, 6.0]\nrotation: !Uniform {}\n",
        "translation: [0.0, 0.0, 0.0]\nrotation: {}\n",
        "translation: [0.0, 0.0, 0.0]\nrotation: !AngleAxis\n  angle_deg: !Gaussian\n    mean: 1.0\n    stddev: 2.0\n"
        "  axis: [0.0, 0.0, 1.0]\n",
    ],
)
def test_yaml_round_trip(text):
    assert yaml_dump_typed(yaml_load_typed(schema=Transform, data=text)) == text


def test_a_sample_of_a_pose_in_another_frame_is_refused():
    generator = RandomGenerator(3)
    for frame in (None, "world"):
        sample = schema.Transform(base_frame=frame, translation=[1.0, 2.0, 3.0]).Sample(generator)
        np.testing.assert_array_equal(sample.translation(), [1.0, 2.0, 3.0])
    with pytest.raises(RuntimeError, match="in frame 'hand', not in the world"):
        schema.Transform(base_frame="hand").Sample(generator)
