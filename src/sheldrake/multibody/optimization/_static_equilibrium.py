"""Postures in which gravity, actuators and contacts balance."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.autodiffutils import ExtractValue
from sheldrake.multibody.inverse_kinematics._kinematic import KinematicFunction
from sheldrake.multibody.math import SpatialForce
from sheldrake.multibody.optimization._contact_wrench import ContactWrench, Floats, floats, touches
from sheldrake.multibody.optimization._motion_constraints import require_duals
from sheldrake.multibody.plant._contact.friction import CalcContactFrictionFromSurfaceProperties
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.solvers import Constraint, MathematicalProgram
from sheldrake.solvers._arrays import variables_at
from sheldrake.symbolic import Variable
from sheldrake.systems.framework._engine.store import CONTINUOUS

if TYPE_CHECKING:
    from sheldrake.geometry._ids import GeometryId
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import RigidBody
    from sheldrake.solvers import MathematicalProgramResult
    from sheldrake.systems.framework import Context


class _Contact(NamedTuple):
    """Where a pair of geometries is nearest.

    Attributes:
        normal: From A into B, in the world, shape (3,).
        distance: Signed [m].
        J: The velocity of Cb less that of Ca, by v, in the world, shape (3, nv).
    """

    normal: Floats
    distance: Floats
    J: Floats


class _Posture(NamedTuple):
    """What constraints ask of positions: generalized forces of gravity, shape (nv,), and the contacts."""

    gravity: Floats
    contacts: list[_Contact]


class _Motion(NamedTuple):
    """How a body moves: velocities by v, of turning and of its origin in the world, shape (3, nv); R_WB."""

    J_w: Floats
    J_v: Floats
    R_WB: Floats

    def velocity_of(self, p_BC: Floats) -> Floats:
        """The velocity of a point of it by v, w x p_BC_W being a matrix times w."""
        p_W, p_W_by_q = self.R_WB.value @ p_BC.value, self.R_WB.value @ p_BC.by_q
        p_W_by_q += p_BC.value @ self.R_WB.by_q
        by_w, by_w_by_q, by_q = _CROSS @ p_W, _CROSS @ p_W_by_q, self.J_v.by_q.copy()
        by_q += (by_w @ self.J_w.by_q.reshape(3, -1)).reshape(by_q.shape)
        by_q += (by_w_by_q.transpose(2, 0, 1) @ self.J_w.value).transpose(1, 2, 0)
        return Floats(self.J_v.value + by_w @ self.J_w.value, by_q)


_CROSS = np.zeros((3, 3, 3))  # (w x p)_i = sum of _CROSS_ijk w_j p_k
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _CROSS[_i, _j, _k], _CROSS[_i, _k, _j] = 1.0, -1.0


class _Postures:
    """Postures of a plant of AutoDiffXd; the last one is kept, for the constraints of a program share their points.

    Args:
        plant: The plant.
        context: Its context, where positions are put.
        pairs: The geometries in contact.
    """

    def __init__(self, plant: MultibodyPlant, context: Context, pairs: list):
        self.plant, self.context, self.pairs = plant, context, pairs
        self._key: tuple[bytes, int] | None = None
        self._last: _Posture | None = None

    def _writes(self) -> int:
        """How often anything was written in the context."""
        return int(self.context._store.i[CONTINUOUS])

    def at(self, q: np.ndarray) -> _Posture:
        """The posture at positions of floats."""
        asked = q.tobytes()
        if self._last is None or self._key != (asked, self._writes()):
            self._last = None
            self.plant.SetPositions(self.context, variables_at(q))
            found = self._found(len(q))
            self._key, self._last = (asked, self._writes()), found
        return self._last

    def _found(self, nq: int) -> _Posture:
        motions: dict[RigidBody, _Motion] = {}

        def velocity_of(body: RigidBody, p_BC: Floats) -> Floats:
            if body not in motions:
                motions[body] = self._motion_of(body, nq)
            return motions[body].velocity_of(p_BC)

        contacts = []
        for at in touches(self.plant, self.context, self.pairs):
            of_B, of_A = velocity_of(at.body_B, at.p_BCb), velocity_of(at.body_A, at.p_ACa)
            contacts.append(_Contact(at.n_AB_W, at.distance, Floats(of_B.value - of_A.value, of_B.by_q - of_A.by_q)))
        return _Posture(floats(self.plant.CalcGravityGeneralizedForces(self.context), nq), contacts)

    def _motion_of(self, body: RigidBody, nq: int) -> _Motion:
        W, wrt = self.plant.world_frame(), JacobianWrtVariable.kV
        J = self.plant.CalcJacobianSpatialVelocity(self.context, wrt, body.body_frame(), np.zeros(3), W, W)
        J_WB, R_WB = floats(J, nq), self.plant.EvalBodyPoseInWorld(self.context, body).rotation().matrix()
        J_w, J_v = (Floats(*(a[k : k + 3] for a in J_WB)) for k in (0, 3))
        return _Motion(J_w, J_v, floats(R_WB, nq))


class _OfPosture(KinematicFunction, Constraint):
    """A constraint on a posture and on more variables: values and derivatives come at once."""

    _postures: _Postures

    def _set_postures(self, postures: _Postures, num_outputs: int, more_vars: int) -> None:
        self._postures = postures
        self._set_plant(postures.plant, postures.context, num_outputs, more_vars)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[0]

    _eval_duals = Constraint._eval_duals


class StaticEquilibriumConstraint(_OfPosture):
    """0 = g(q) + B u + sum J' F of contact forces F; variables (q, u, forces)."""

    def __init__(self, postures: _Postures):
        plant = postures.plant
        self._B = parts_of(plant).coordinates.actuation_matrix("StaticEquilibriumConstraint")
        nv = plant.num_velocities()
        self._set_postures(postures, nv, plant.num_actuated_dofs() + 3 * len(postures.pairs))
        self._set_bounds(np.zeros(nv), np.zeros(nv))

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q, more = self._split(x)
        here, nu = self._postures.at(q), self._plant.num_actuated_dofs()
        total, by_q, by_others = here.gravity.value + self._B @ more[:nu], here.gravity.by_q.copy(), [self._B]
        for contact, force in zip(here.contacts, more[nu:].reshape(-1, 3)):
            total += force @ contact.J.value
            by_q += (force @ contact.J.by_q.reshape(3, -1)).reshape(by_q.shape)
            by_others.append(contact.J.value.T)
        return total, np.hstack((by_q, *by_others))


class StaticFrictionConeComplementarityNonlinearConstraint(_OfPosture):
    """A force in the friction cone where bodies touch; variables (q, force f, alpha, beta).

    The values are f'((1 + mu^2) n n' - I) f >= 0, n'f - alpha = 0, distance - beta = 0, 0 <= alpha beta <= tolerance.
    """

    def __init__(self, postures: _Postures, which: int, tolerance: float):
        self._which, pair = which, postures.pairs[which]
        inspector = postures.plant.get_geometry_query_input_port().Eval(postures.context).inspector()
        surfaces = [inspector.GetProximityProperties(g).GetProperty("material", "coulomb_friction") for g in pair]
        self._mu = CalcContactFrictionFromSurfaceProperties(*surfaces).static_friction()
        self._set_postures(postures, 4, 5)
        self._set_bounds(np.zeros(4), np.array([np.inf, 0.0, 0.0, tolerance]))

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q, more = self._split(x)
        at, f, (alpha, beta) = self._postures.at(q).contacts[self._which], more[:3], more[3:]
        normal, normal_by_q, steepness = at.normal.value @ f, f @ at.normal.by_q, 1.0 + self._mu**2
        values = np.array([steepness * normal**2 - f @ f, normal - alpha, at.distance.value - beta, alpha * beta])
        J, nq = np.zeros((4, len(x))), len(q)
        J[0, :nq], J[0, nq : nq + 3] = (
            2.0 * steepness * normal * normal_by_q,
            2.0 * (steepness * normal * at.normal.value - f),
        )
        J[1, :nq], J[1, nq : nq + 3], J[1, nq + 3] = normal_by_q, at.normal.value, -1.0
        J[2, :nq], J[2, nq + 4] = at.distance.by_q, -1.0
        J[3, nq + 3 :] = beta, alpha
        return values, J

    def update_tolerance(self, tolerance: float) -> None:
        """Sets how large alpha beta may be."""
        self._set_bounds(self._lower, np.array([np.inf, 0.0, 0.0, tolerance]))


class StaticEquilibriumProblem:
    """A program that finds a posture in which all forces balance and contacts keep to their friction cones.

    Args:
        plant: A plant of AutoDiffXd, connected to a SceneGraph.
        context: Its context, part of that of the diagram.
        ignored_collision_pairs: Pairs of geometries that neither touch nor keep apart.
    """

    def __init__(
        self, plant: MultibodyPlant, context: Context, ignored_collision_pairs: set[tuple[GeometryId, GeometryId]]
    ):
        require_duals(type(self).__name__, plant, context)
        self._plant, self._context = plant, context
        inspector = plant.get_geometry_query_input_port().Eval(context).inspector()
        ignored = {frozenset(pair) for pair in ignored_collision_pairs}
        candidates = sorted(tuple(pair) for pair in inspector.GetCollisionCandidates())
        self._pairs = [pair for pair in candidates if frozenset(pair) not in ignored]
        prog = self._prog = MathematicalProgram()
        self._q = prog.NewContinuousVariables(plant.num_positions())
        self._u = prog.NewContinuousVariables(plant.num_actuated_dofs())
        self._forces = [prog.NewContinuousVariables(3, "X") for _ in self._pairs]
        prog.AddBoundingBoxConstraint(plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits(), self._q)
        postures = _Postures(plant, context, self._pairs)
        balance = StaticEquilibriumConstraint(postures)
        prog.AddConstraint(balance, np.concatenate((self._q, self._u, *self._forces)))
        self._cones = [self._add_cone(postures, k, force) for k, force in enumerate(self._forces)]

    def _add_cone(
        self, postures: _Postures, which: int, force: np.ndarray
    ) -> StaticFrictionConeComplementarityNonlinearConstraint:
        slacks = np.array([Variable("alpha"), Variable("beta")], dtype=object)
        self._prog.AddDecisionVariables(slacks)
        self._prog.AddBoundingBoxConstraint(np.zeros(2), np.full(2, np.inf), slacks)
        cone = StaticFrictionConeComplementarityNonlinearConstraint(postures, which, 1e-3)
        self._prog.AddConstraint(cone, np.concatenate((self._q, force, slacks)))
        return cone

    def prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    get_mutable_prog = prog

    def q_vars(self) -> np.ndarray:
        """Returns the variables of the positions, shape (nq,)."""
        return self._q.copy()

    def u_vars(self) -> np.ndarray:
        """Returns the variables of the actuation, shape (nu,)."""
        return self._u.copy()

    def GetContactWrenchSolution(self, result: MathematicalProgramResult) -> list[ContactWrench]:
        """Returns the wrenches of all contacts of a solution."""
        self._plant.SetPositions(self._context, result.GetSolution(self._q))
        out = []
        for at, force in zip(touches(self._plant, self._context, self._pairs), self._forces):
            F = SpatialForce(np.zeros(3), result.GetSolution(force))
            world, B = self._plant.world_frame(), at.body_B.body_frame()
            p_WCb = self._plant.CalcPointsPositions(self._context, B, at.p_BCb.value.reshape(3, 1), world)
            out.append(ContactWrench._make(at.body_A.index(), at.body_B.index(), ExtractValue(p_WCb).ravel(), F))
        return out

    def UpdateComplementarityTolerance(self, tol: float) -> None:
        """Sets how large the product of a contact's force and distance may be."""
        for cone in self._cones:
            cone.update_tolerance(tol)
