"""Forces of contact as functions of variables."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.common._no_constructor import no_constructor
from sheldrake.common.value import _register_value_type
from sheldrake.multibody.inverse_kinematics._kinematic import KinematicFunction
from sheldrake.multibody.math import SpatialForce
from sheldrake.multibody.optimization._motion_constraints import require_duals
from sheldrake.solvers._functions.evaluators import EvaluatorBase

if TYPE_CHECKING:
    from sheldrake.autodiffutils import AutoDiffXd
    from sheldrake.geometry import GeometryId
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import BodyIndex, RigidBody
    from sheldrake.systems.framework import Context


@no_constructor()
class ContactWrench:
    """The wrench that body A applies to body B at a point Cb.

    Attributes:
        bodyA_index: Body A.
        bodyB_index: Body B.
        p_WCb_W: Point Cb in the world [m], shape (3,).
        F_Cb_W: The wrench at Cb, in the world [N m, N].
    """

    bodyA_index: BodyIndex
    bodyB_index: BodyIndex
    p_WCb_W: np.ndarray
    F_Cb_W: SpatialForce

    @classmethod
    def _make(cls, A: BodyIndex, B: BodyIndex, p_WCb: np.ndarray, F: SpatialForce) -> ContactWrench:
        out = cls.__new__(cls)
        out.bodyA_index, out.bodyB_index, out.p_WCb_W, out.F_Cb_W = A, B, p_WCb, F
        return out


_register_value_type(ContactWrench)


class ContactWrenchFromForceInWorldFrameEvaluator(KinematicFunction, EvaluatorBase):
    """The wrench of a force without torque; variables (q, force in the world [N]), values (torque, force).

    Args:
        plant: A plant of AutoDiffXd.
        context: Its context.
        geometry_id_pair: The geometries (A, B) in contact.
    """

    def __init__(self, plant: MultibodyPlant, context: Context, geometry_id_pair: tuple[GeometryId, GeometryId]):
        require_duals(type(self).__name__, plant, context)
        self._set_plant(plant, context, 6, 3)
        self._description = "contact_wrench_from_pure_force_in_world_frame"
        self.geometry_id_pair = tuple(geometry_id_pair)

    def _value(self, more: np.ndarray) -> np.ndarray:
        return np.concatenate((np.zeros(3), more))


class Touch(NamedTuple):
    """Nearest points Ca, Cb of two geometries: their bodies and places in these, direction from A into B, distance."""

    body_A: RigidBody
    body_B: RigidBody
    p_ACa: np.ndarray
    p_BCb: np.ndarray
    n_AB_W: np.ndarray
    distance: float | AutoDiffXd


def touch(plant: MultibodyPlant, context: Context, pair: tuple) -> Touch:
    """The nearest points of a pair of geometries at the positions in the context."""
    query = plant.get_geometry_query_input_port().Eval(context)
    found = query.ComputeSignedDistancePairClosestPoints(*pair)
    inspector, bodies, points = query.inspector(), [], []
    for geometry, p_GC in ((found.id_A, found.p_ACa), (found.id_B, found.p_BCb)):
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
        assert body is not None  # pairs are of bodies of the plant
        bodies.append(body)
        X_BG = inspector.GetPoseInFrame(geometry)
        points.append(X_BG.rotation().matrix() @ p_GC + X_BG.translation())
    return Touch(bodies[0], bodies[1], points[0], points[1], -found.nhat_BA_W, found.distance)
