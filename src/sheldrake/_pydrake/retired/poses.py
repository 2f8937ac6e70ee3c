"""PoseVector, FrameVelocity, PoseBundle and PoseAggregator: how poses went to viewers before there was a query port."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.common.value import AbstractValue
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.math import SpatialVelocity
from sheldrake.systems.framework import BasicVector, InputPort, LeafSystem

from .hints import hint

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework._context.context import Context

__all__ = ["FrameVelocity", "PoseAggregator", "PoseBundle", "PoseVector"]

_QUERY = "use SceneGraph.get_query_output_port() and QueryObject.GetPoseInWorld()"


class PoseVector(BasicVector):
    """Retired: use an abstract port of `RigidTransform`. A position [m], then a quaternion w, x, y, z.

    Args:
        rotation: Orientation, a Quaternion.
        translation: Position [m], shape (3,).
    """

    kSize: ClassVar[int] = 7

    def __init__(self, rotation: Any = None, translation: Any = None):
        hint("PoseVector is retired: use an abstract port of RigidTransform.")
        super().__init__([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        if rotation is not None:
            self.set_rotation(rotation)
        if translation is not None:
            self.set_translation(translation)

    def get_translation(self) -> np.ndarray:
        """The position [m], shape (3,)."""
        return self.CopyToVector()[:3]

    def set_translation(self, p: ArrayLike) -> None:
        """Sets the position [m], shape (3,)."""
        self.SetFromVector(np.concatenate([np.asarray(p, dtype=float), self.CopyToVector()[3:]]))

    def get_rotation(self) -> Quaternion:
        """The orientation."""
        return Quaternion(self.CopyToVector()[3:])

    def set_rotation(self, q: Quaternion) -> None:
        """Sets the orientation, a Quaternion."""
        self.SetFromVector(np.concatenate([self.CopyToVector()[:3], q.wxyz()]))

    def get_transform(self) -> RigidTransform:
        """Both as a transform."""
        return RigidTransform(quaternion=self.get_rotation(), p=self.get_translation())

    def set_transform(self, X: RigidTransform) -> None:
        """Sets both from a transform."""
        self.set_rotation(RotationMatrix(X.rotation()).ToQuaternion())
        self.set_translation(X.translation())


class FrameVelocity(BasicVector):
    """Retired: use an abstract port of `SpatialVelocity`. Angular [rad/s], then linear velocity [m/s].

    Args:
        velocity: A SpatialVelocity.
    """

    kSize: ClassVar[int] = 6

    def __init__(self, velocity: ArrayLike | None = None):
        hint("FrameVelocity is retired: use an abstract port of SpatialVelocity.")
        super().__init__(6 * [0.0])
        if velocity is not None:
            self.set_velocity(velocity)

    def get_velocity(self) -> SpatialVelocity:
        """The velocity."""
        return SpatialVelocity(self.CopyToVector())

    def set_velocity(self, velocity: Any) -> None:
        """Sets the velocity."""
        self.SetFromVector(velocity.get_coeffs())


class PoseBundle:
    """Retired: use `QueryObject.GetPoseInWorld`. Poses, velocities, names and numbers of models of several frames.

    Args:
        num_poses: How many.
    """

    def __init__(self, num_poses: int):
        hint(f"PoseBundle is retired: {_QUERY}.")
        self._poses = [RigidTransform() for _ in range(num_poses)]
        self._velocities = [SpatialVelocity.Zero() for _ in range(num_poses)]
        self._names = num_poses * [""]
        self._instances = num_poses * [0]

    def get_num_poses(self) -> int:
        """How many."""
        return len(self._poses)

    def get_transform(self, index: int) -> RigidTransform:
        """A pose."""
        return self._poses[index]

    def set_transform(self, index: int, pose: Any) -> None:
        """Sets a pose."""
        self._poses[index] = RigidTransform(pose)

    def get_velocity(self, index: int) -> SpatialVelocity:
        """A velocity."""
        return self._velocities[index]

    def set_velocity(self, index: int, velocity: Any) -> None:
        """Sets a velocity, a FrameVelocity or a SpatialVelocity."""
        self._velocities[index] = velocity.get_velocity() if hasattr(velocity, "get_velocity") else velocity

    def get_name(self, index: int) -> str:
        """A name."""
        return self._names[index]

    def set_name(self, index: int, name: str) -> None:
        """Sets a name."""
        self._names[index] = name

    def get_model_instance_id(self, index: int) -> int:
        """The number of the model a frame belongs to."""
        return self._instances[index]

    def set_model_instance_id(self, index: int, id: int) -> None:
        """Sets the number of the model a frame belongs to."""
        self._instances[index] = int(id)


class _PoseVelocityInputPorts(NamedTuple):
    pose_input_port: InputPort
    velocity_input_port: InputPort


class PoseAggregator(LeafSystem):
    """Retired: use `SceneGraph`, which collects poses. Makes one PoseBundle of what its input ports bring."""

    def __init__(self) -> None:
        hint(f"PoseAggregator is retired: {_QUERY}.")
        super().__init__()
        self._parts: list[tuple[str, int, Any, Any]] = []
        self.DeclareAbstractOutputPort("pose_bundle", lambda: AbstractValue.Make(PoseBundle(0)), self._collect)

    def AddSingleInput(self, name: str, model_instance_id: int) -> InputPort:
        """A port of 7 numbers, a PoseVector."""
        port = self.DeclareVectorInputPort(f"{name}_{self.num_input_ports()}", PoseVector())
        self._parts.append((name, model_instance_id, port, None))
        return port

    def AddSinglePoseAndVelocityInput(self, name: str, model_instance_id: int) -> _PoseVelocityInputPorts:
        """A port of 7 numbers, a PoseVector, and one of 6, a FrameVelocity."""
        pose = self.AddSingleInput(name, model_instance_id)
        velocity = self.DeclareVectorInputPort(f"{name}_{self.num_input_ports()}", FrameVelocity())
        self._parts[-1] = (name, model_instance_id, pose, velocity)
        return _PoseVelocityInputPorts(pose, velocity)

    def AddBundleInput(self, bundle_name: str, num_poses: int) -> InputPort:
        """A port of a PoseBundle; its frames' names begin with that of the bundle."""
        port = self.DeclareAbstractInputPort(
            f"{bundle_name}_{self.num_input_ports()}", AbstractValue.Make(PoseBundle(num_poses))
        )
        self._parts.append((bundle_name, -1, port, PoseBundle))
        return port

    def _collect(self, context: Context, output: AbstractValue) -> None:
        frames: list[tuple[str, int, Any, Any]] = []
        for name, instance, port, velocity in self._parts:
            if velocity is PoseBundle:
                frames += _frames_of(f"{name}::", port.Eval(context))
            else:
                values = np.array(port.Eval(context))
                pose = RigidTransform(quaternion=Quaternion(values[3:]), p=values[:3])
                V = SpatialVelocity.Zero() if velocity is None else SpatialVelocity(np.array(velocity.Eval(context)))
                frames.append((name, instance, pose, V))
        bundle = PoseBundle(len(frames))
        for i, (name, instance, pose, V) in enumerate(frames):
            bundle.set_name(i, name)
            bundle.set_model_instance_id(i, instance)
            bundle.set_transform(i, pose)
            bundle.set_velocity(i, V)
        output.set_value(bundle)


def _frames_of(prefix: str, bundle: PoseBundle) -> list[tuple[str, int, Any, Any]]:
    return [
        (
            prefix + bundle.get_name(i),
            bundle.get_model_instance_id(i),
            bundle.get_transform(i),
            bundle.get_velocity(i),
        )
        for i in range(bundle.get_num_poses())
    ]
