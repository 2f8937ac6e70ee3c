"""Which kernels a step runs: those that its plant and scene need, no others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sheldrake.common.kernel import Kernel
from sheldrake.geometry._compiled.hydroelastic import hydro_kernels
from sheldrake.geometry._compiled.search import family_kernels, has_pairs
from sheldrake.geometry._kernels.contacts import box_pairs, half_space_pairs, sphere_pairs
from sheldrake.geometry._kernels.hydro_model import HydroModel, empty_hydro_model
from sheldrake.geometry._kernels.model import GeometryModel
from sheldrake.geometry._kernels.near import list_near_pairs
from sheldrake.geometry._kernels.order import sort_contacts
from sheldrake.geometry._kernels.spatial_hash import (
    close_box_pairs,
    close_convex_pairs,
    close_pairs,
    close_sphere_pairs,
)
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS
from sheldrake.multibody.plant._kernels.contacts import hydro_constraints, refuse_points
from sheldrake.multibody.plant._kernels.model import PlantModel
from sheldrake.multibody.plant._kernels.step import (
    contact_constraints,
    joint_constraints,
    next_state,
    next_state_with_momentum,
    smooth_motion,
)
from sheldrake.multibody.plant._kernels.surface_velocities import contact_drifts
from sheldrake.multibody.plant._step.tuning import can_touch, touches_at_several_points

_FORGETFUL = frozenset(
    {smooth_motion, contact_constraints, joint_constraints, next_state, next_state_with_momentum}
    | {half_space_pairs, list_near_pairs, sphere_pairs, box_pairs, sort_contacts}
    | {close_pairs, close_sphere_pairs, close_box_pairs, close_convex_pairs}
    | {kernel for kind in APPROXIMATIONS.values() for solver in (kind.as_drake, kind.to_rest) for kernel in solver}
)
"""Kernels that do the same with the same state, parameters and inputs, whatever they did before.

Which pairs are listed as near depends on that, but not what is found among them.
"""


def repeats(stages: Sequence[Any]) -> bool:
    """Whether a step changes nothing if the one before changed nothing: where no search remembers what met."""
    return all(isinstance(stage, Kernel) and stage in _FORGETFUL for stage in stages)


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


def discrete_stages(
    geometry_model: GeometryModel,
    plant_model: PlantModel,
    approximation: str = "lagged",
    hydro_model: HydroModel | None = None,
    strict: bool = False,
) -> list[Kernel]:
    """The kernels of a plant's step, in their order: those it needs, no others.

    Where pairs of geometries touch at several points, steps go on until what can rest does; else they are Drake's. So
    they are where nothing can touch, but the solver is that which knows of rows in v*.

    Args:
        geometry_model: pairs of geometries that touch in points.
        plant_model: actuators, limits and constraints.
        approximation: one of `APPROXIMATIONS`.
        hydro_model: pairs of geometries that touch along surfaces.
        strict: touching in points is an error.
    """
    chain: list[Kernel] = [smooth_motion]
    hydro_model = hydro_model or empty_hydro_model()
    chain += contact_stages(geometry_model, hydro_model, strict, contact_constraints)
    if len(hydro_model.pair):
        chain.append(hydro_constraints)
    if len(plant_model.belt) and len(chain) > 1:
        chain.append(contact_drifts)
    rows = plant_model.limit, plant_model.actuator, plant_model.constraint, plant_model.friction
    kind = APPROXIMATIONS[approximation]
    if kind.scalar_rows and any(len(a) for a in rows):
        chain.append(joint_constraints)
    if touches_at_several_points(geometry_model):
        return [*chain, *kind.to_rest, next_state_with_momentum]
    rows_alone = chain[-1] is joint_constraints and not can_touch(geometry_model, hydro_model)
    return [*chain, *(kind.to_rest if rows_alone else kind.as_drake), next_state]
