"""A force from outside on one body, as the applied_spatial_force port takes them."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, SupportsIndex

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.common.value import _register_value_type
from sheldrake.multibody.math import SpatialForce
from sheldrake.multibody.tree import BodyIndex

if TYPE_CHECKING:
    from sheldrake.common._types import Scalars


class ExternallyAppliedSpatialForce:
    """A force from outside on one body B at a point Bq fixed to it."""

    __slots__ = ("F_Bq_W", "_body_index", "_p_BoBq_B")

    def __init__(self) -> None:
        self._body_index = BodyIndex()
        self._p_BoBq_B = np.zeros(3)
        self.F_Bq_W = SpatialForce.Zero()

    @property
    def body_index(self) -> BodyIndex:
        """The body."""
        return self._body_index

    @body_index.setter
    def body_index(self, value: SupportsIndex) -> None:
        self._body_index = value if isinstance(value, BodyIndex) else BodyIndex(value)

    @property
    def p_BoBq_B(self) -> np.ndarray:
        """The point [m], shape (3,)."""
        return self._p_BoBq_B

    @p_BoBq_B.setter
    def p_BoBq_B(self, value: Scalars) -> None:
        array = np.asarray(value)
        if array.size != 3:
            raise Mismatch(f"ExternallyAppliedSpatialForce.p_BoBq_B: incompatible function arguments; got {value!r}.")
        self._p_BoBq_B = (array.astype(float) if array.dtype != object else array.copy()).reshape(3)

    def __copy__(self) -> ExternallyAppliedSpatialForce:
        new = object.__new__(ExternallyAppliedSpatialForce)
        new._body_index, new._p_BoBq_B, new.F_Bq_W = self._body_index, self._p_BoBq_B.copy(), self.F_Bq_W
        return new

    def __deepcopy__(self, memo: dict) -> ExternallyAppliedSpatialForce:
        new = copy.copy(self)
        new.F_Bq_W = copy.copy(self.F_Bq_W)
        return new

    def __repr__(self) -> str:
        return (
            f"ExternallyAppliedSpatialForce(body_index={self.body_index!r}, p_BoBq_B={self.p_BoBq_B.tolist()}, "
            f"F_Bq_W={self.F_Bq_W!r})"
        )


_register_value_type(ExternallyAppliedSpatialForce, with_list=True)
