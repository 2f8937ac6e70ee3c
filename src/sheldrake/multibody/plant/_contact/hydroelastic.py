"""Contact along surfaces, as a plant reports it."""

from __future__ import annotations

import copy

import numpy as np

from sheldrake.common._no_constructor import no_constructor
from sheldrake.common.value import _register_value_type
from sheldrake.geometry._kernels.hydro_model import Face, FaceValue, Found, HydroModel, HydroTable
from sheldrake.geometry._query.contact_surface import ContactSurface, surfaces_of
from sheldrake.multibody.math import SpatialForce, SpatialForce_


@no_constructor("It comes with ContactResults.")
class HydroelasticContactInfo:
    """The contact of two geometries along a surface; M belongs to body A, N to body B."""

    _surface: ContactSurface
    _F_Ac_W: SpatialForce

    @classmethod
    def _make(cls, surface: ContactSurface, F_Ac_W: SpatialForce) -> HydroelasticContactInfo:
        new = object.__new__(cls)
        new._surface, new._F_Ac_W = surface, F_Ac_W
        return new

    def contact_surface(self) -> ContactSurface:
        """The surface and its pressure, in W."""
        return self._surface

    def F_Ac_W(self) -> SpatialForce:
        """The force on body A at C, the centroid of the surface, in W [N m, N]."""
        return copy.copy(self._F_Ac_W)

    def __copy__(self) -> HydroelasticContactInfo:
        return HydroelasticContactInfo._make(self._surface, copy.copy(self._F_Ac_W))

    def __deepcopy__(self, memo: dict) -> HydroelasticContactInfo:
        return copy.copy(self)


_register_value_type(HydroelasticContactInfo)


def infos_of(
    surfaces: HydroTable, hydro_model: HydroModel, ids: list, F_B_W: np.ndarray, scalar: type = float
) -> list[HydroelasticContactInfo]:
    """Surfaces with the spatial force on A at their centroids.

    Args:
        surfaces: as they were found.
        hydro_model: what found them.
        ids: of the geometries.
        F_B_W: moment about the centroid and force on B of every face [N m, N], shape (num_faces or more, 6).
        scalar: of the numbers.
    """
    infos, count = [], int(surfaces.count[Found.num_faces])
    if not count:
        return []
    for s, surface in surfaces_of(surfaces, hydro_model, ids):
        here = np.flatnonzero(surfaces.face[:count, Face.surface] == s)
        arms = surfaces.value[here, FaceValue.p_WC.columns] - surface.centroid()
        F_A_W = -F_B_W[here]
        moment = F_A_W[:, :3] + np.cross(arms, F_A_W[:, 3:])
        total = np.concatenate([moment.sum(axis=0), F_A_W[:, 3:].sum(axis=0)])
        infos.append(HydroelasticContactInfo._make(surface, SpatialForce_[scalar](total)))
    return infos
