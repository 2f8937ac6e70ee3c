"""How far a step looks ahead for contacts, and how exactly it solves them."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry._compiled.search import has_pairs
from sheldrake.geometry._kernels.hydro_model import HydroModel
from sheldrake.geometry._kernels.model import Geometry, GeometryModel, Margins, Material
from sheldrake.multibody.contact_solvers import _arrays
from sheldrake.multibody.contact_solvers._kernels.problem import SolverModel
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS
from sheldrake.multibody.tree._kernels.model import Dof, Tree, TreeModel

BOUNCE = 10.0
"""Half the speed up to which bodies without dissipation bounce to the height from which they fell [m/s]."""


def solver_model_of(
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    dt: float,
    approximation: str = "lagged",
    hydro_model: HydroModel | None = None,
    **options: Any,
) -> SolverModel:
    """The solver's constants for a tree and its geometry.

    Where pairs of geometries touch at several points, iterations stop at a smaller residual than Drake's: with Drake's,
    a body at rest creeps at 1e-8 m/s, with ours its velocity becomes exactly zero. A robot that moves needs no more
    than Drake's, relative to its momentum. With Drake's single points the tolerance is Drake's too, and so are the
    numbers. Where nothing can touch they are as well, but what rows of joints do linearly is in v*: mostly that is the
    answer.

    Args:
        tree_model: the tree.
        geometry_model: the proximity geometry.
        dt: time step [s].
        approximation: one of `APPROXIMATIONS`.
        hydro_model: pairs of geometries that touch along surfaces.
        options: more of `make_solver_model`.
    """
    several = touches_at_several_points(geometry_model)
    options.setdefault("relative_tolerance", _arrays.REST_TOLERANCE if several else _arrays.DRAKE_TOLERANCE)
    options.setdefault("moving_tolerance", _arrays.DRAKE_TOLERANCE if several else 0.0)
    options.setdefault("to_rest", several)
    options.setdefault("ahead", not can_touch(geometry_model, hydro_model))
    tree = tree_model.tree[:, [Tree.first_dof.at, Tree.num_dofs.at]]
    dof = tree_model.dof[:, [Dof.parent.at, Dof.depth.at, Dof.row.at]]
    return _arrays.make_solver_model(tree, dof, dt, approximation, **options)


def shared_solver_model(
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    hydro_model: HydroModel,
    dt: float,
    approximation: str,
    stiction_tolerance: float,
    near_rigid_threshold: float,
) -> SolverModel:
    """The solver's constants as `solver_model_of` makes them; plants whose solvers are the same share them."""
    seen = touches_at_several_points(geometry_model), can_touch(geometry_model, hydro_model)
    numbers = dt, approximation, stiction_tolerance, near_rigid_threshold
    key = tree_model.tree.tobytes(), tree_model.dof.tobytes(), *seen, *numbers
    model = _MADE.get(key)
    if model is None:
        options = dict(stiction_tolerance=stiction_tolerance, near_rigid_threshold=near_rigid_threshold)
        model = solver_model_of(tree_model, geometry_model, dt, approximation, hydro_model, **options)
        for array in model:
            array.flags.writeable = False
        if len(_MADE) >= _MOST_MADE:
            _MADE.clear()
        _MADE[key] = model
    return model


_MADE: dict[tuple[Any, ...], SolverModel] = {}
_MOST_MADE = 32


def set_margin(model: GeometryModel, approximation: str, dt: float) -> None:
    """Lets the contact search look ahead, as far as the approximation says.

    What does not dissipate has to be seen before its spring has taken energy, see `secant_force` of the laws.
    """
    kind = APPROXIMATIONS[approximation]
    model.margin[Margins.several_margin] = kind.margin(dt)
    elastic = model.material[:, Material.dissipation] == 0.0
    if kind.bounces and elastic.sum() > 1 and touches_at_several_points(model):
        model.margin[Margins.elastic_margin] = BOUNCE * dt


def can_touch(model: GeometryModel, hydro_model: HydroModel | None) -> bool:
    """Whether anything can, in points or along surfaces."""
    return has_pairs(model) or (hydro_model is not None and len(hydro_model.pair) > 0)


def touches_at_several_points(model: GeometryModel) -> bool:
    """Whether there is a pair of geometries that may touch at several points."""
    if not len(model.pair) and not len(model.cell):
        return False
    multi = model.geometry[:, Geometry.multi_point] == 1
    return bool(np.any(multi[model.pair].all(axis=1))) or (len(model.cell) > 0 and multi.sum() > 1)


def tamsi_limit_penalty(inertia: float, dt: float) -> tuple[float, float]:
    """(stiffness, damping) of kTamsi's joint limit: critically damped, with a period of about 60 steps.

    Args:
        inertia: the smaller of parent's and child's [kg or kg m²]: mass for a prismatic joint, inertia about the
            axis for a revolute one.
        dt: time step [s].
    """
    omega = 0.1 / dt
    return inertia * omega**2, 2.0 * inertia * omega


def supply_missing_material(model: GeometryModel, stiffness: float, dissipation: float, relaxation_time: float) -> None:
    """Replaces material numbers that are NaN: no property, and no default of the scene graph."""
    supplied = {
        Material.stiffness: stiffness,
        Material.dissipation: dissipation,
        Material.relaxation_time: relaxation_time,
    }
    for field, value in supplied.items():
        values = model.material[:, field]
        values[np.isnan(values)] = value
