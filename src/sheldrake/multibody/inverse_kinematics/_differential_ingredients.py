"""Costs and constraints of differential inverse kinematics, and the recipe that lists them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._options import Options, Vector3, Vector6
from sheldrake.multibody.inverse_kinematics._differential import nullspace_rows
from sheldrake.planning import DofMask, JointLimits

if TYPE_CHECKING:
    from sheldrake.solvers._program.program import MathematicalProgram


class Step(NamedTuple):
    """What one solve knows: T is the task frame, Gs are the goal frames one after another.

    Attributes:
        prog: The program.
        v_next: Its variables: velocities of the active dofs, shape (n,).
        dt: Time step [s].
        q: Positions of all dofs.
        nominal_posture: Positions that free dofs are drawn to, of all dofs.
        active: Indices of the active dofs.
        active_dof: The same as a mask.
        collision_checker: The checker.
        checker_context: A context of it, at `q`.
        frames: The goal frames.
        p_TGs: Their positions [m], shape (3,) each.
        Vd_TGs: Their desired velocities [rad/s, m/s], shape (6 k,).
        Jv_TGs: Derivatives of their velocities by those of the active dofs, shape (6 k, n).
    """

    prog: MathematicalProgram
    v_next: np.ndarray
    dt: float
    q: np.ndarray
    nominal_posture: np.ndarray
    active: list[int]
    active_dof: DofMask
    collision_checker: Any
    checker_context: Any
    frames: list
    p_TGs: list[np.ndarray]
    Vd_TGs: np.ndarray
    Jv_TGs: np.ndarray

    def selector(self, masks: dict[str, np.ndarray]) -> np.ndarray:
        """The diagonal of S: one where an axis of a goal frame is followed."""
        every = np.ones(6)
        return np.concatenate([masks.get(f.scoped_name().get_full(), every) for f in self.frames])


def _demand(condition: object, owner: Any, field: str, rule: str) -> None:
    if not condition:
        config = owner._config
        raise RuntimeError(f"{type(owner).__name__}: {field} must be {rule}, got {getattr(config, field)}.")


class Ingredient:
    """Costs or constraints of a recipe; its kinds say which. Not made directly."""

    _config: Any

    def __init__(self, *args: Any, **kwargs: Any):
        raise TypeError("pydrake.multibody.inverse_kinematics.Ingredient: No constructor defined!")

    def GetConfig(self) -> Options:
        """Returns the settings."""
        return self._config.__copy__()

    def SetConfig(self, config: Options) -> None:
        """Replaces the settings.

        Raises:
            RuntimeError: a value is out of its range.
        """
        old: Any = getattr(self, "_config", None)
        self._config = config.__deepcopy__({})
        try:
            self._check()
        except RuntimeError:
            self._config = old
            raise

    def _check(self) -> None:
        """Raises RuntimeError for settings that are out of range."""

    def _add_to(self, step: Step) -> None:
        """Adds the ingredient to the program of a step."""
        raise NotImplementedError

    def _check_masks(self) -> None:
        for mask in self._config.cartesian_axis_masks.values():
            binary = np.isin(mask, (0.0, 1.0)).all()
            _demand(binary and mask.any(), self, "cartesian_axis_masks", "of zeros and ones, with at least one one")


class LeastSquaresCost(Ingredient):
    """The cost G |S (Vd_TGs - Jv_TGs v_next)|^2: goal frames move as desired.

    Args:
        config: Settings.
    """

    class Config(Options):
        """Settings of the cost.

        Attributes:
            cartesian_qp_weight: G.
            cartesian_axis_masks: By the scoped name of a goal frame, which axes of [w, v] count; all if absent.
            use_legacy_implementation: For old programs: the desired velocities count twice.
        """

        cartesian_qp_weight: float = 1.0
        cartesian_axis_masks: dict[str, Vector6] = {}
        use_legacy_implementation: bool = False

    def __init__(self, config: Config):
        self.SetConfig(config)

    def _check(self) -> None:
        config = self._config
        weight = config.cartesian_qp_weight
        _demand(np.isfinite(weight) and weight >= 0.0, self, "cartesian_qp_weight", "finite and not negative")
        self._check_masks()

    def _add_to(self, step: Step) -> None:
        S, weight = step.selector(self._config.cartesian_axis_masks), self._config.cartesian_qp_weight
        J, V = S[:, None] * step.Jv_TGs, S * step.Vd_TGs
        half = 1.0 if self._config.use_legacy_implementation else 2.0
        Q, b, c = half * weight * J.T @ J, -2.0 * weight * J.T @ V, weight * V @ V
        step.prog.AddQuadraticCost(Q, b, c, step.v_next, is_convex=True)


class JointCenteringCost(Ingredient):
    """The cost |P (v_next - K (nominal - q))|^2, where the rows of P span what S Jv_TGs leaves free.

    Args:
        config: Settings.
    """

    class Config(Options):
        """Settings of the cost.

        Attributes:
            posture_gain: K [1/s].
            cartesian_axis_masks: As those of the least-squares cost; they should be the same.
        """

        posture_gain: float = 1.0
        cartesian_axis_masks: dict[str, Vector6] = {}

    def __init__(self, config: Config):
        self.SetConfig(config)

    def _check(self) -> None:
        config = self._config
        gain = config.posture_gain
        _demand(np.isfinite(gain) and gain >= 0.0, self, "posture_gain", "finite and not negative")
        self._check_masks()

    def _add_to(self, step: Step) -> None:
        S = step.selector(self._config.cartesian_axis_masks)
        P = nullspace_rows(S[:, None] * step.Jv_TGs)
        if len(P):
            pull = self._config.posture_gain * (step.nominal_posture - step.q)[step.active]
            step.prog.Add2NormSquaredCost(P, P @ pull, step.v_next)


class CartesianPositionLimitConstraint(Ingredient):
    """Goal frames are within a box of the task frame after the step.

    Args:
        config: Settings.
    """

    class Config(Options):
        """The box.

        Attributes:
            p_TG_next_lower: Its lower corner [m], shape (3,).
            p_TG_next_upper: Its upper corner [m], shape (3,).
        """

        p_TG_next_lower: Vector3 = np.zeros(3)
        p_TG_next_upper: Vector3 = np.zeros(3)

    def __init__(self, config: Config):
        self.SetConfig(config)

    def _check(self) -> None:
        config = self._config
        _demand(np.all(config.p_TG_next_lower <= config.p_TG_next_upper), self, "p_TG_next_lower", "<= p_TG_next_upper")

    def _add_to(self, step: Step) -> None:
        for i, p_TG in enumerate(step.p_TGs):
            J = step.Jv_TGs[6 * i + 3 : 6 * i + 6] * step.dt
            low, high = self._config.p_TG_next_lower - p_TG, self._config.p_TG_next_upper - p_TG
            binding = step.prog.AddLinearConstraint(J, low, high, step.v_next)
            binding.evaluator().set_description("Cartesian position limit")


class CartesianVelocityLimitConstraint(Ingredient):
    """No element of the velocity of a goal frame is above a limit.

    Args:
        config: Settings.
    """

    class Config(Options):
        """The limit.

        Attributes:
            V_next_TG_limit: The largest elements [rad/s, m/s], shape (6,).
        """

        V_next_TG_limit: Vector6 = np.zeros(6)

    def __init__(self, config: Config):
        self.SetConfig(config)

    def _check(self) -> None:
        config = self._config
        _demand(np.all(config.V_next_TG_limit >= 0.0), self, "V_next_TG_limit", "not negative")

    def _add_to(self, step: Step) -> None:
        limit = np.tile(self._config.V_next_TG_limit, len(step.frames))
        binding = step.prog.AddLinearConstraint(step.Jv_TGs, -limit, limit, step.v_next)
        binding.evaluator().set_description("Cartesian velocity limit")


class CollisionConstraint(Ingredient):
    """The robot keeps its distance from obstacles and itself after the step.

    Args:
        config: Settings.
    """

    class Config(Options):
        """The distances.

        Attributes:
            safety_distance: What is kept [m].
            influence_distance: What is farther does not count [m].
        """

        safety_distance: float = 0.0
        influence_distance: float = np.inf

    def __init__(self, config: Config):
        self.SetConfig(config)
        self._select: Callable | None = None

    def _check(self) -> None:
        config = self._config
        _demand(np.isfinite(config.safety_distance), self, "safety_distance", "finite")
        _demand(config.influence_distance >= 0.0, self, "influence_distance", "not negative")

    def SetSelectDataForCollisionConstraintFunction(self, select_data_for_collision_constraint: Callable) -> None:
        """Sets what chooses the distances that count.

        Args:
            select_data_for_collision_constraint: Called with the active dofs, the clearances of the robot, and two
                empty arrays as pydrake has them; returns `(distances, jacobians)`, shapes (m,) and (m, n) with n
                active dofs, or None for none.
        """
        self._select = select_data_for_collision_constraint

    def _add_to(self, step: Step) -> None:
        clearance = step.collision_checker.CalcContextRobotClearance(
            step.checker_context, step.q, self._config.influence_distance
        )
        distances, J = clearance.distances(), clearance.jacobians()[:, step.active]
        if self._select is not None:
            chosen = self._select(step.active_dof, clearance, np.zeros(0), np.zeros((0, 0)))
            distances, J = (np.zeros(0), J[:0]) if chosen is None else map(np.asarray, chosen)
        if len(distances):
            low = (self._config.safety_distance - distances) / step.dt
            binding = step.prog.AddLinearConstraint(J, low, np.full(len(low), np.inf), step.v_next)
            binding.evaluator().set_description("Collision constraint")


class JointVelocityLimitConstraint(Ingredient):
    """Velocities are within limits, and that towards a near limit of position is scaled down to zero.

    Args:
        config: Settings.
        joint_limits: Limits of positions and velocities of the active dofs.
    """

    class Config(Options):
        """Where scaling begins and ends.

        Attributes:
            min_margin: Distance of a limit of position where the velocity towards it is zero [m or rad].
            influence_margin: Distance from which on the limit of velocity is whole [m or rad].
        """

        min_margin: float = 0.0025
        influence_margin: float = 0.1

    def __init__(self, config: Config, joint_limits: JointLimits):
        self.SetConfig(config)
        self.SetJointLimits(joint_limits)

    def _check(self) -> None:
        config = self._config
        _demand(config.min_margin >= 0.0, self, "min_margin", "not negative")
        _demand(config.influence_margin > config.min_margin, self, "influence_margin", "above min_margin")

    def GetJointLimits(self) -> JointLimits:
        """Returns the limits."""
        return self._limits

    def SetJointLimits(self, joint_limits: JointLimits) -> None:
        """Replaces the limits."""
        self._limits = joint_limits

    def _add_to(self, step: Step) -> None:
        limits, q = self._limits, step.q[step.active]
        if limits.num_positions() != q.size:
            raise RuntimeError(
                f"JointVelocityLimitConstraint: the limits are of {limits.num_positions()} dofs, {q.size} are active."
            )
        below, above = q - limits.position_lower(), limits.position_upper() - q
        low, high = limits.velocity_lower(), limits.velocity_upper()
        near_low = below < above
        low[near_low] = self._scaled(low[near_low], below[near_low])
        high[~near_low] = self._scaled(high[~near_low], above[~near_low])
        binding = step.prog.AddBoundingBoxConstraint(low, high, step.v_next)
        binding.evaluator().set_description("Joint velocity limit")

    def _scaled(self, limit: np.ndarray, distance: np.ndarray) -> np.ndarray:
        least, whole = self._config.min_margin, self._config.influence_margin
        scale = np.clip((distance - least) / (whole - least), 0.0, 1.0)
        return np.where(scale > 0.0, limit * np.maximum(scale, np.finfo(float).tiny), 0.0)


class Recipe:
    """The costs and constraints of a `DifferentialInverseKinematicsSystem`."""

    def __init__(self) -> None:
        self._ingredients: list[Ingredient] = []

    def AddIngredient(self, ingredient: Ingredient) -> None:
        """Adds a cost or a constraint.

        Raises:
            TypeError: it is no Ingredient.
        """
        if not isinstance(ingredient, Ingredient):
            raise TypeError(f"Recipe.AddIngredient(): expected an Ingredient, got {ingredient!r}.")
        self._ingredients.append(ingredient)

    def num_ingredients(self) -> int:
        """Returns how many there are."""
        return len(self._ingredients)

    def ingredient(self, i: int) -> Ingredient:
        """Returns one of them.

        Raises:
            RuntimeError: there is no such one.
        """
        if not 0 <= i < len(self._ingredients):
            raise RuntimeError(f"Recipe.ingredient(): there is no ingredient {i}, there are {len(self._ingredients)}.")
        return self._ingredients[i]
