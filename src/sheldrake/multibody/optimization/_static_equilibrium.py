"""Postures in which gravity, actuators and contacts balance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.autodiffutils import ExtractValue
from sheldrake.multibody.inverse_kinematics._kinematic import KinematicFunction
from sheldrake.multibody.math import SpatialForce
from sheldrake.multibody.optimization._contact_wrench import ContactWrench, touch
from sheldrake.multibody.optimization._motion_constraints import require_duals
from sheldrake.multibody.plant._contact.friction import CalcContactFrictionFromSurfaceProperties
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.solvers import Constraint, MathematicalProgram
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from sheldrake.geometry._ids import GeometryId
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import RigidBody
    from sheldrake.solvers import MathematicalProgramResult
    from sheldrake.systems.framework import Context


class StaticEquilibriumConstraint(KinematicFunction, Constraint):
    """0 = g(q) + B u + sum J' F of contact forces F; variables (q, u, forces)."""

    def __init__(self, plant: MultibodyPlant, context: Context, pairs: list):
        self._pairs, self._B = pairs, parts_of(plant).coordinates.actuation_matrix("StaticEquilibriumConstraint")
        nv = plant.num_velocities()
        self._set_plant(plant, context, nv, plant.num_actuated_dofs() + 3 * len(pairs))
        self._set_bounds(np.zeros(nv), np.zeros(nv))

    def _value(self, more: np.ndarray) -> np.ndarray:
        plant, context, nu = self._plant, self._context, self._plant.num_actuated_dofs()
        total = plant.CalcGravityGeneralizedForces(context) + self._B @ more[:nu]
        for pair, force in zip(self._pairs, more[nu:].reshape(-1, 3)):
            at = touch(plant, context, pair)
            total = total + (self._slope_of(at.body_B, at.p_BCb) - self._slope_of(at.body_A, at.p_ACa)).T @ force
        return total

    def _slope_of(self, body: RigidBody, p_BC: np.ndarray) -> np.ndarray:
        """Derivative by v of the velocity of a point of a body in the world, shape (3, nv)."""
        W, F = self._plant.world_frame(), body.body_frame()
        wrt = JacobianWrtVariable.kV
        return self._plant.CalcJacobianTranslationalVelocity(self._context, wrt, F, p_BC.reshape(3, 1), W, W)


class StaticFrictionConeComplementarityNonlinearConstraint(KinematicFunction, Constraint):
    """A force in the friction cone where bodies touch; variables (q, force f, alpha, beta).

    The values are f'((1 + mu^2) n n' - I) f >= 0, n'f - alpha = 0, distance - beta = 0, 0 <= alpha beta <= tolerance.
    """

    def __init__(self, plant: MultibodyPlant, context: Context, pair: tuple, tolerance: float):
        self._pair = pair
        inspector = plant.get_geometry_query_input_port().Eval(context).inspector()
        surfaces = [inspector.GetProximityProperties(g).GetProperty("material", "coulomb_friction") for g in pair]
        self._mu = CalcContactFrictionFromSurfaceProperties(*surfaces).static_friction()
        self._set_plant(plant, context, 4, 5)
        self._set_bounds(np.zeros(4), np.array([np.inf, 0.0, 0.0, tolerance]))

    def _value(self, more: np.ndarray) -> np.ndarray:
        f, (alpha, beta) = more[:3], more[3:]
        at = touch(self._plant, self._context, self._pair)
        normal = at.n_AB_W @ f
        cone = (1.0 + self._mu**2) * normal**2 - f @ f
        return np.array([cone, normal - alpha, at.distance - beta, alpha * beta], dtype=object)

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
        balance = StaticEquilibriumConstraint(plant, context, self._pairs)
        prog.AddConstraint(balance, np.concatenate((self._q, self._u, *self._forces)))
        self._cones = [self._add_cone(pair, force) for pair, force in zip(self._pairs, self._forces)]

    def _add_cone(self, pair: tuple, force: np.ndarray) -> StaticFrictionConeComplementarityNonlinearConstraint:
        slacks = np.array([Variable("alpha"), Variable("beta")], dtype=object)
        self._prog.AddDecisionVariables(slacks)
        self._prog.AddBoundingBoxConstraint(np.zeros(2), np.full(2, np.inf), slacks)
        cone = StaticFrictionConeComplementarityNonlinearConstraint(self._plant, self._context, pair, 1e-3)
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
        for pair, force in zip(self._pairs, self._forces):
            at = touch(self._plant, self._context, pair)
            F = SpatialForce(np.zeros(3), result.GetSolution(force))
            world, B = self._plant.world_frame(), at.body_B.body_frame()
            p_WCb = self._plant.CalcPointsPositions(self._context, B, at.p_BCb.reshape(3, 1), world)
            out.append(ContactWrench._make(at.body_A.index(), at.body_B.index(), ExtractValue(p_WCb).ravel(), F))
        return out

    def UpdateComplementarityTolerance(self, tol: float) -> None:
        """Sets how large the product of a contact's force and distance may be."""
        for cone in self._cones:
            cone.update_tolerance(tol)
