"""Hydroelastic contact of a plant: which stages its step needs for it, and what it reports."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.common.value import _register_value_type
from sheldrake.geometry._contact_search import family_kernels, has_pairs
from sheldrake.geometry._contact_surface import ContactSurface, surfaces_of
from sheldrake.geometry._hydro_compile import (
    HydroPairs,
    compile_hydro,
    explain_unsupported,
    has_surfaces,
    hydro_kernels,
)
from sheldrake.geometry._kernels import hydro_model as hydro
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable, empty_hydro_model
from sheldrake.geometry._kernels.model import GeometryModel
from sheldrake.multibody.contact_solvers._kernels import problem as columns
from sheldrake.multibody.math import SpatialForce, SpatialForce_
from sheldrake.multibody.plant._enums import ContactModel
from sheldrake.multibody.plant._kernels.contact_rows import contact_frame
from sheldrake.multibody.plant._kernels.hydro_rows import hydro_constraints, refuse_points
from sheldrake.multibody.plant._kernels.model import StepWork


class HydroelasticContactInfo:
    """The contact of two geometries along a surface; M belongs to body A, N to body B."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        raise TypeError("HydroelasticContactInfo: No constructor defined! It comes with ContactResults.")

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


def touch_along_surfaces(plant: Any, state: Any) -> bool:
    """Whether any geometry of the plant can make contact surfaces."""
    return plant._contact_model is not ContactModel.kPoint and has_surfaces(state)


def split_pairs(plant: Any, state: Any, model: GeometryModel, ids: list) -> HydroPairs:
    """Which pairs of geometries touch along surfaces: none with ContactModel.kPoint."""
    if plant._contact_model is ContactModel.kPoint:
        return HydroPairs(empty_hydro_model(), model)
    return compile_hydro(state, model, ids, plant._representation)


def contact_stages(model: GeometryModel, hydro_model: HydroModel, strict: bool, points: Kernel) -> list[Kernel]:
    """The stages that find contacts and make constraints or forces of points.

    Args:
        model: the pairs that touch in points.
        hydro_model: those that touch along surfaces.
        strict: pairs that touch in points are errors.
        points: what is done with points.
    """
    chain = [*family_kernels(model), refuse_points if strict else points] if has_pairs(model) else []
    return [*chain, *hydro_kernels(hydro_model)]


def step_stages(model: GeometryModel, hydro_model: HydroModel, strict: bool, points: Kernel) -> list[Kernel]:
    """The same for the discrete step, with the constraints of surfaces."""
    chain = contact_stages(model, hydro_model, strict, points)
    return [*chain, hydro_constraints] if len(hydro_model.pair) else chain


def explain_refused(plant: Any, state: Any, table: Any, ids: list) -> Exception:
    """Which geometries overlap that can have no contact surface."""
    for row in range(int(table.count[0])):
        if table.point[row, 9] > 0.0:
            a, b = table.pair[row, :2]
            return explain_unsupported(state, ids[a], ids[b])
    return RuntimeError(f"{plant._describe()}: geometries overlap that can have no contact surface.")


def step_surfaces(
    work: StepWork, hydro_model: HydroModel, ids: list, dt: float, scalar: type = float
) -> list[HydroelasticContactInfo]:
    """Contact surfaces of the last step, with the forces at its end."""
    surfaces = work.surfaces
    if surfaces.count[hydro.NUM_SURFACES] == 0:
        return []
    F_B_W = np.full((int(surfaces.count[hydro.NUM_FACES]), 6), 0.0, dtype=work.contacts.state.dtype)
    at, normal = int(columns.GAMMA), int(hydro.NORMAL)
    for f, c in enumerate(surfaces.contact[: len(F_B_W)].tolist()):
        if c >= 0:
            z = -surfaces.value[f, normal : normal + 3]
            x, y = contact_frame(tuple(z))
            gamma = work.contacts.state[c, at : at + 3]
            F_B_W[f, 3:] = (gamma[0] * np.array(x) + gamma[1] * np.array(y) + gamma[2] * z) / dt
    return infos_of(surfaces, hydro_model, ids, F_B_W, scalar)


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
    infos, count, first = [], int(surfaces.count[hydro.NUM_FACES]), int(hydro.CENTROID)
    for s, surface in surfaces_of(surfaces, hydro_model, ids):
        here = np.flatnonzero(surfaces.face[:count, hydro.SURFACE] == s)
        arms = surfaces.value[here, first : first + 3] - surface.centroid()
        F_A_W = -F_B_W[here]
        moment = F_A_W[:, :3] + np.cross(arms, F_A_W[:, 3:])
        total = np.concatenate([moment.sum(axis=0), F_A_W[:, 3:].sum(axis=0)])
        infos.append(HydroelasticContactInfo._make(surface, SpatialForce_[scalar](total)))
    return infos
