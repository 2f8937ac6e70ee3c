"""Random numbers, vectors, rotations and poses as YAML describes them."""

from __future__ import annotations

import copy
import importlib
import math
import typing
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._distributions import (
    Deterministic,
    Distribution,
    DistributionVector,
    Gaussian,
    Schema,
    Uniform,
    UniformDiscrete,
    _DeterministicVector,
    _family,
    _GaussianVector,
    _UniformVector,
    random_variable,
)
from sheldrake.common._options import Vector3
from sheldrake.common._overloads import Mismatch, incompatible
from sheldrake.common._random import RandomGenerator
from sheldrake.common._scalars import as_scalar

if TYPE_CHECKING:
    from types import ModuleType

    from sheldrake.common._types import Scalars
    from sheldrake.math._rigid_transform import RigidTransform
    from sheldrake.math._rotation_matrix import RotationMatrix

__all__ = [
    "Deterministic",
    "DeterministicVector",
    "DeterministicVectorX",
    "Distribution",
    "DistributionVector",
    "Gaussian",
    "GaussianVector",
    "GaussianVectorX",
    "GetDeterministicValue",
    "IsDeterministic",
    "Mean",
    "Rotation",
    "Sample",
    "ToDistribution",
    "ToDistributionVector",
    "ToSymbolic",
    "Transform",
    "Uniform",
    "UniformDiscrete",
    "UniformVector",
    "UniformVectorX",
]

DeterministicVector = _family("DeterministicVector", _DeterministicVector, "value")
GaussianVector = _family("GaussianVector", _GaussianVector, "mean", "stddev", loose="stddev")
UniformVector = _family("UniformVector", _UniformVector, "min", "max")
DeterministicVectorX = DeterministicVector[None]
GaussianVectorX = GaussianVector[None]
UniformVectorX = UniformVector[None]

_Number = typing.Union[float, Deterministic, Gaussian, Uniform, UniformDiscrete]  # noqa: UP007
_Vector3 = typing.Union[Vector3, DeterministicVector[3], GaussianVector[3], UniformVector[3]]  # type: ignore # noqa: UP007


def _math() -> ModuleType:
    """Rotations live one floor up; they are looked up when a schema turns into one."""
    return importlib.import_module("sheldrake.math")


for _cls in (Deterministic, Distribution, DistributionVector, Gaussian, Uniform, UniformDiscrete):
    _cls.__module__ = __name__


def ToDistribution(var: Any) -> Distribution:
    """`var`, a number or a Distribution, as a Distribution of its own."""
    if isinstance(var, Distribution):
        return copy.copy(var)
    try:
        return Deterministic(as_scalar(float, var))
    except Mismatch:
        raise incompatible("ToDistribution", ["(var: float or Distribution)"], (var,), {}) from None


def ToDistributionVector(vec: Any) -> Any:
    """`vec`, numbers or a distribution of one or several, as a DistributionVector of its own."""
    if isinstance(vec, DistributionVector):
        return copy.copy(vec)
    if isinstance(vec, Deterministic):
        return DeterministicVectorX([vec.value])
    if isinstance(vec, Gaussian):
        return GaussianVectorX([vec.mean], [vec.stddev])
    if isinstance(vec, Uniform):
        return UniformVectorX([vec.min], [vec.max])
    try:
        return DeterministicVectorX(vec)
    except TypeError:
        raise incompatible("ToDistributionVector", ["(vec: array or DistributionVector)"], (vec,), {}) from None


def _distribution(call: str, var: Any) -> Any:
    try:
        return (
            ToDistributionVector(var)
            if np.ndim(var) > 0 or isinstance(var, DistributionVector)
            else ToDistribution(var)
        )
    except TypeError:
        raise incompatible(call, ["(a number, a vector or a distribution)"], (var,), {}) from None


def Sample(var: Distribution | float, generator: RandomGenerator) -> float:
    """A random value of a number or Distribution."""
    if not isinstance(var, (Distribution, float, int, np.floating)):
        raise incompatible("Sample", ["(var: float or Distribution, generator)"], (var, generator), {})
    return ToDistribution(var).Sample(generator)


def Mean(var: Distribution | float) -> float:
    """The expected value of a number or Distribution."""
    if not isinstance(var, (Distribution, float, int, np.floating)):
        raise incompatible("Mean", ["(var: float or Distribution)"], (var,), {})
    return ToDistribution(var).Mean()


def ToSymbolic(var: Any) -> Any:
    """A number or Distribution as an expression of random variables."""
    if not isinstance(var, (Distribution, float, int, np.floating)):
        raise incompatible("ToSymbolic", ["(var: float or Distribution)"], (var,), {})
    return ToDistribution(var).ToSymbolic()


def IsDeterministic(var: Any = None, *, vec: Any = None) -> bool:
    """Whether a number or its distribution (`var`), or a vector or its (`vec`), has only one possible value."""
    d = _distribution("IsDeterministic", vec if var is None else var)
    if isinstance(d, Gaussian):
        return d.stddev == 0.0
    if isinstance(d, Uniform):
        return d.min == d.max
    if isinstance(d, UniformDiscrete):
        return len(d.values) == 1
    if isinstance(d, _GaussianVector):
        return not d.stddev.any()
    if isinstance(d, _UniformVector):
        return bool((d.min == d.max).all())
    return True


def GetDeterministicValue(var: Any = None, *, vec: Any = None) -> Any:
    """The only possible value of a number or its distribution (`var`), or of a vector or its (`vec`).

    Raises:
        RuntimeError: it has several.
    """
    d = _distribution("GetDeterministicValue", vec if var is None else var)
    if not IsDeterministic(d):
        raise RuntimeError(f"Attempt to GetDeterministicValue() on a variant that contains a {d!r}")
    return d.Mean()


class Rotation(Schema):
    """A rotation that may be random: `value` is an Identity, Rpy, AngleAxis or Uniform."""

    class Identity(Schema):
        """No rotation."""

    class Rpy(Schema):
        """Roll, pitch and yaw in `deg` [degrees], shape (3,), a vector or a distribution."""

        deg: _Vector3 = np.zeros(3)

    class AngleAxis(Schema):
        """A rotation by `angle_deg` [degrees] about `axis`, of any length, each known or random."""

        angle_deg: _Number = 0.0
        axis: _Vector3 = np.array([0.0, 0.0, 1.0])

    class Uniform(Schema):
        """Any rotation, all equally likely."""

    value: Identity | Rpy | AngleAxis | Uniform = Identity()

    def __init__(self, *args: Any, **kwargs: Any):
        """`Rotation()`, `Rotation(R)`, `Rotation(rpy)`, `Rotation(other)` or `Rotation(value=...)`."""
        m = _math()
        if len(args) == 1 and not kwargs and isinstance(args[0], (m.RotationMatrix, m.RollPitchYaw)):
            (source,) = args
            rpy = source if isinstance(source, m.RollPitchYaw) else source.ToRollPitchYaw()
            args, kwargs = (), {"value": Rotation.Rpy(deg=np.degrees(rpy.vector()))}
        super().__init__(*args, **kwargs)

    def IsDeterministic(self) -> bool:
        """Whether only one rotation is possible."""
        if isinstance(self.value, Rotation.Uniform):
            return False
        return all(IsDeterministic(getattr(self.value, field.name)) for field in self.value.__fields__)

    def GetDeterministicValue(self) -> RotationMatrix:
        """The RotationMatrix, if only one is possible.

        Raises:
            RuntimeError: several are.
        """
        if not self.IsDeterministic():
            raise RuntimeError(f"Rotation.GetDeterministicValue(): {self!r} is random.")
        parts = {field.name: GetDeterministicValue(getattr(self.value, field.name)) for field in self.value.__fields__}
        return self._matrix(float, parts)

    def ToSymbolic(self) -> RotationMatrix:
        """The rotation matrix as expressions of random variables."""
        Expression = importlib.import_module("sheldrake.symbolic").Expression
        parts = {}
        for field in self.value.__fields__:
            part = _distribution("ToSymbolic", getattr(self.value, field.name))
            parts[field.name] = part.ToSymbolic()
        return self._matrix(Expression, parts)

    def _matrix(self, T: type, parts: dict[str, Any]) -> Any:
        m, geometry = _math(), importlib.import_module("sheldrake.common.eigen_geometry")
        if isinstance(self.value, Rotation.Identity):
            return m.RotationMatrix_[T]()
        if isinstance(self.value, Rotation.Rpy):
            return m.RotationMatrix_[T](m.RollPitchYaw_[T](parts["deg"] * (math.pi / 180.0)))
        if isinstance(self.value, Rotation.AngleAxis):
            axis = parts["axis"]
            squares = sum(x * x for x in axis)
            length = m.sqrt(squares)
            angle = parts["angle_deg"] * (math.pi / 180.0)
            return m.RotationMatrix_[T](geometry.AngleAxis_[T](angle, [x / length for x in axis]))
        u, a, b = (random_variable("uniform", i) for i in range(3))
        r, s = m.sqrt(1.0 - u), m.sqrt(u)
        a, b = 2.0 * math.pi * a, 2.0 * math.pi * b
        wxyz = [r * m.sin(a), r * m.cos(a), s * m.sin(b), s * m.cos(b)]
        return m.RotationMatrix_[T](geometry.Quaternion_[T](wxyz))

    def _sample(self, generator: RandomGenerator) -> RotationMatrix:
        if isinstance(self.value, Rotation.Uniform):
            return _math().UniformlyRandomRotationMatrix(generator)
        parts = {
            field.name: _distribution("Sample", getattr(self.value, field.name)).Sample(generator)
            for field in self.value.__fields__
        }
        return self._matrix(float, parts)

    def set_rpy_deg(self, rpy_deg: Scalars) -> None:
        """Make this the rotation of roll, pitch and yaw [degrees], shape (3,)."""
        self.value = Rotation.Rpy(deg=rpy_deg)


_ROTATIONS = (Rotation.Identity, Rotation.Rpy, Rotation.AngleAxis, Rotation.Uniform)


class Transform(Schema):
    """A pose in the frame `base_frame`, its `translation` [m] and `rotation` known or random."""

    base_frame: str | None = None
    translation: _Vector3 = np.zeros(3)
    rotation: Rotation = Rotation()

    def __init__(self, *args: Any, **kwargs: Any):
        """`Transform()`, `Transform(X)` of a RigidTransform, `Transform(other)`, or fields by name."""
        if len(args) == 1 and not kwargs and isinstance(args[0], _math().RigidTransform):
            X = args[0]
            args, kwargs = (), {"translation": X.translation(), "rotation": Rotation(X.rotation())}
        super().__init__(*args, **kwargs)

    def __setattr__(self, name: str, value: object) -> None:
        super().__setattr__(name, Rotation(value=value) if isinstance(value, _ROTATIONS) else value)

    def _yaml_get(self, name: str) -> Any:
        value = getattr(self, name)
        return value.value if name == "rotation" else value

    def set_rotation_rpy_deg(self, rpy_deg: Scalars) -> None:
        """Make the rotation that of roll, pitch and yaw [degrees], shape (3,)."""
        self.rotation = Rotation(value=Rotation.Rpy(deg=rpy_deg))

    def IsDeterministic(self) -> bool:
        """Whether only one pose is possible."""
        return IsDeterministic(self.translation) and self.rotation.IsDeterministic()

    def GetDeterministicValue(self) -> RigidTransform:
        """The RigidTransform, if only one is possible.

        Raises:
            RuntimeError: several are.
        """
        if not self.IsDeterministic():
            raise RuntimeError(f"Transform.GetDeterministicValue(): {self!r} is random.")
        return _math().RigidTransform(self.rotation.GetDeterministicValue(), GetDeterministicValue(self.translation))

    def ToSymbolic(self) -> RigidTransform:
        """The pose as expressions of random variables."""
        Expression = importlib.import_module("sheldrake.symbolic").Expression
        p = ToDistributionVector(self.translation).ToSymbolic()
        return _math().RigidTransform_[Expression](self.rotation.ToSymbolic(), p)

    def Mean(self) -> RigidTransform:
        """The pose for the expected value of every random variable."""
        m = _math()
        p = ToDistributionVector(self.translation).Mean()
        R = self.rotation.ToSymbolic().matrix()
        variables = {v for x in R.flat for v in x.GetVariables()}
        means = {v: 0.5 if v.get_name().startswith("random_uniform") else 0.0 for v in variables}
        numbers = [[x.Evaluate(means) for x in row] for row in R.tolist()]
        return m.RigidTransform(m.RotationMatrix(numbers), p)

    def Sample(self, generator: RandomGenerator) -> RigidTransform:
        """A random pose in the world.

        Raises:
            RuntimeError: the pose is in another frame, which a RigidTransform cannot tell.
        """
        if self.base_frame not in (None, "", "world"):
            raise RuntimeError(
                f"Transform.Sample(): the pose is in frame '{self.base_frame}', not in the world, and what is returned "
                "could not say so."
            )
        p = ToDistributionVector(self.translation).Sample(generator)
        return _math().RigidTransform(self.rotation._sample(generator), p)


_rotation = SimpleNamespace(name="rotation", type=Rotation.__fields__[0].type)
Transform.__fields__ = (*Transform.__fields__[:2], _rotation)
"""YAML has the value of the rotation where Python has the Rotation."""
