"""Systems that work on point clouds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.math import RigidTransform
from sheldrake.perception import BaseField, Concatenate, Fields, PointCloud
from sheldrake.systems.framework import LeafSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context

__all__ = ["PointCloudConcatenation"]


class PointCloudConcatenation(LeafSystem):
    """Puts point clouds of several cameras Ci into one cloud in a common frame F.

    Ports: for each id, inputs "point_cloud_CiSi_{id}" and "X_FCi_{id}"; output "point_cloud_FS". Points that are not
    finite are left out. The last id's points come first.

    Args:
        id_list: Names of the clouds.
        default_rgb: Color, in 0..255, of the points of clouds without colors.

    Raises:
        RuntimeError: when a name comes twice.
        ValueError: when the color has not three numbers.
    """

    def __init__(self, id_list: Sequence[str], default_rgb: Any = (255.0, 255.0, 255.0)):
        super().__init__()
        self._default_rgb = np.asarray(default_rgb, dtype=float).ravel()
        if len(self._default_rgb) != 3:
            raise ValueError(f"PointCloudConcatenation(): default_rgb must have 3 numbers, got {default_rgb}.")
        self._ids = list(id_list)
        cloud, pose = AbstractValue.Make(PointCloud()), AbstractValue.Make(RigidTransform())
        for name in self._ids:
            self.DeclareAbstractInputPort(f"point_cloud_CiSi_{name}", cloud)
            self.DeclareAbstractInputPort(f"X_FCi_{name}", pose)
        fields = Fields(BaseField.kXYZs | BaseField.kRGBs)
        self.DeclareAbstractOutputPort(
            "point_cloud_FS", lambda: AbstractValue.Make(PointCloud(0, fields)), self.DoCalcOutput
        )

    def DoCalcOutput(self, context: Context, output: Any) -> None:
        """Fills the output port."""
        clouds = [self._cloud_in_F(context, i) for i in range(len(self._ids))]
        fields = Fields(BaseField.kXYZs | BaseField.kRGBs)
        output.set_value(Concatenate(clouds[::-1]) if clouds else PointCloud(0, fields))

    def _cloud_in_F(self, context: Context, i: int) -> PointCloud:
        """Returns the finite points of cloud number i in F, with colors."""
        cloud = self.get_input_port(2 * i).Eval(context)
        X_FC = self.get_input_port(2 * i + 1).Eval(context)
        p_CS = cloud.xyzs().astype(float)
        finite = np.isfinite(p_CS).all(axis=0)
        new = PointCloud(int(finite.sum()), Fields(BaseField.kXYZs | BaseField.kRGBs))
        new.mutable_xyzs()[...] = X_FC.rotation().matrix() @ p_CS[:, finite] + X_FC.translation()[:, None]
        new.mutable_rgbs()[...] = cloud.rgbs()[:, finite] if cloud.has_rgbs() else self._default_rgb[:, None]
        return new
