"""Forces of contact as functions of variables."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.common._no_constructor import no_constructor
from sheldrake.common.value import _register_value_type
from sheldrake.multibody.inverse_kinematics._kinematic import KinematicFunction
from sheldrake.multibody.math import SpatialForce
from sheldrake.multibody.optimization._motion_constraints import require_duals
from sheldrake.solvers._arrays import values_and_gradient
from sheldrake.solvers._functions.evaluators import EvaluatorBase

if TYPE_CHECKING:
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
    """Nearest points Ca, Cb of two geometries, of duals: their bodies and places in these, direction from A into B."""

    body_A: RigidBody
    body_B: RigidBody
    p_ACa: Floats
    p_BCb: Floats
    n_AB_W: Floats
    distance: Floats


class Floats(NamedTuple):
    """Values of shape (...) and their derivatives by q, shape (..., nq)."""

    value: np.ndarray
    by_q: np.ndarray


def floats(x: np.ndarray, nq: int) -> Floats:
    """Those of an array of AutoDiffXd."""
    values, by_q = values_and_gradient(x.ravel())
    return Floats(values.reshape(x.shape), (by_q if by_q.size else np.zeros((x.size, nq))).reshape(*x.shape, nq))


def touches(plant: MultibodyPlant, context: Context, pairs: list[tuple]) -> list[Touch]:
    """The nearest points of pairs of geometries at the positions in the context."""
    query, nq, out = plant.get_geometry_query_input_port().Eval(context), plant.num_positions(), []
    inspector = query.inspector()
    for found in query._signed_distances_of(pairs):
        of_pair = floats(np.array([*found.p_ACa, *found.p_BCb, *-found.nhat_BA_W, found.distance]), nq)
        p_GCa, p_GCb, n_AB_W = (Floats(*(a[k : k + 3] for a in of_pair)) for k in (0, 3, 6))
        bodies, points = [], []
        for geometry, p_GC in ((found.id_A, p_GCa), (found.id_B, p_GCb)):
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
            assert body is not None  # pairs are of bodies of the plant
            X_BG = inspector.GetPoseInFrame(geometry)
            R_BG = X_BG.rotation().matrix()
            bodies.append(body)
            points.append(Floats(R_BG @ p_GC.value + X_BG.translation(), R_BG @ p_GC.by_q))
        distance = Floats(of_pair.value[9], of_pair.by_q[9])
        out.append(Touch(bodies[0], bodies[1], points[0], points[1], n_AB_W, distance))
    return out
