"""Controllers that know the dynamics of a multibody plant.

Each keeps a plant of its own for the model, and a context of that plant for the state it reads from its input.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import NumberEnum
from sheldrake.common.kernel import Kernel
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import MultibodyForces_
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.systems.controllers._kernels import inverse_dynamics as kernels
from sheldrake.systems.controllers._pid import PidController, _vector
from sheldrake.systems.framework import Diagram, DiagramBuilder, InputPort, LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.primitives import Adder, ConstantVectorSource, MatrixGain

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.tree._multibody_forces import MultibodyForces
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._vector import BasicVector


class InverseDynamicsMode(NumberEnum):
    """What `InverseDynamics` computes: forces for accelerations, or forces that hold against gravity."""

    kInverseDynamics = 0
    kGravityCompensation = 1


class _PlantKeeper(LeafSystem):
    """A system that computes with a plant, in a context of its own; on doubles by a kernel, with its parameters."""

    _generic = True
    _kept_systems = (("_plant", "_plant_context"),)

    _plant: MultibodyPlant
    _forces: tuple[Any, Any] = None, None
    """A plant, and room for the forces of its force elements: a copy on another scalar has another plant."""

    def _keep(self, plant: MultibodyPlant, plant_context: Any = None) -> None:
        self._plant = plant
        given = plant_context is not None
        self._plant_context = plant_context.Clone() if given else plant.CreateDefaultContext()

    def _compute_with(self, kernel: Kernel) -> None:
        """A kernel computes the first output port on doubles."""
        model = parts_of(self._plant).elements.model(type(self).__name__)
        n, bodies = model.nv, model.num_bodies
        v, vdot, force, F, A = *np.zeros((3, n)), *np.zeros((2, bodies, 6))
        motion = kernels.Motion(v, vdot, force, F, A)
        self._declare_scratch(kernels.Work(make_work(model.tree), motion))
        self._compute_natively(0, kernel)

    def _kernel_models(self, root: Any) -> dict:
        model = parts_of(self._plant).elements.model(type(self).__name__)
        p = parts_of(self._plant).contexts.view(self._plant_context).p.copy()
        return {"tree_model": model.tree, "force_model": model.forces, "p_model": p}

    def _plant_at(self, x: np.ndarray) -> Context:
        self._plant.SetPositionsAndVelocities(self._plant_context, x)
        return self._plant_context

    def _applied_forces(self, context: Context) -> MultibodyForces:
        plant, forces = self._forces
        if plant is not self._plant:
            forces = MultibodyForces_[self._plant._scalar](self._plant)
            self._forces = self._plant, forces
        self._plant.CalcForceElementsContribution(context, forces)
        return forces

    get_input_port_estimated_state = input_port("estimated_state", "Returns the input for the plant's state.")


@checked
class InverseDynamics(_PlantKeeper):
    """Generalized forces that give a plant desired accelerations, or that hold it against gravity.

    Args:
        plant: The plant, finalized. It is not part of the diagram; only its parameters are used.
        mode: Which of the two.
        plant_context: Holds the plant's parameters; defaults if absent.

    Raises:
        RuntimeError: the plant is not finalized.
    """

    InverseDynamicsMode = InverseDynamicsMode
    kInverseDynamics = InverseDynamicsMode.kInverseDynamics
    kGravityCompensation = InverseDynamicsMode.kGravityCompensation

    def __init__(
        self,
        plant: MultibodyPlant,
        mode: Any = InverseDynamicsMode.kInverseDynamics,
        plant_context: Context | None = None,
    ):
        super().__init__()
        states = plant.num_positions() + plant.num_velocities()
        self._mode = mode
        self._keep(plant, plant_context)
        self.DeclareVectorInputPort("estimated_state", states)
        if mode is InverseDynamicsMode.kInverseDynamics:
            self.DeclareVectorInputPort("desired_acceleration", plant.num_velocities())
        self.DeclareVectorOutputPort("generalized_force", plant.num_velocities(), self._calc_force)
        gravity = self.is_pure_gravity_compensation()
        self._compute_with(kernels.force_against_gravity if gravity else kernels.force_for_acceleration)

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        x = np.array(self.get_input_port(0).Eval(context))
        plant = self._plant
        if self.is_pure_gravity_compensation():
            output.SetFromVector(-plant.CalcGravityGeneralizedForces(self._plant_at(x)))
            return
        plant_context = self._plant_at(x)
        vdot = np.array(self.get_input_port(1).Eval(context))
        output.SetFromVector(plant.CalcInverseDynamics(plant_context, vdot, self._applied_forces(plant_context)))

    def is_pure_gravity_compensation(self) -> bool:
        """Tells whether only gravity is compensated."""
        return self._mode is InverseDynamicsMode.kGravityCompensation

    def get_input_port_desired_acceleration(self) -> InputPort:
        """Returns the input for desired accelerations [rad/s^2 or m/s^2].

        Raises:
            RuntimeError: only gravity is compensated.
        """
        if self.is_pure_gravity_compensation():
            raise RuntimeError("InverseDynamics: gravity compensation has no input for a desired acceleration.")
        return self.GetInputPort("desired_acceleration")

    get_output_port_generalized_force = output_port(0, "Returns the output with generalized forces [Nm or N].")


def _require_fully_actuated(call: str, plant: MultibodyPlant, *gains: np.ndarray) -> None:
    n = plant.num_positions()
    if plant.num_velocities() != n or plant.num_actuated_dofs() != n:
        raise RuntimeError(
            f"{call}(): the plant must be fully actuated, with as many positions as velocities; it has {n} positions, "
            f"{plant.num_velocities()} velocities and {plant.num_actuated_dofs()} actuated degrees of freedom."
        )
    for gain in gains:
        if gain.size != n:
            raise RuntimeError(f"{call}(): {n} positions need {n} gains of each kind, got {gain.size}.")


@checked
class InverseDynamicsController(Diagram):
    """Tracks a desired state: inverse dynamics of the accelerations that a PID law asks for.

    τ = inverse dynamics of (v̇_desired + kp (q_d - q) + kd (v_d - v) + ki ∫(q_d - q)).

    Args:
        robot: The plant, finalized and fully actuated.
        kp: Proportional gains [1/s^2], shape `(n,)`.
        ki: Integral gains [1/s^3].
        kd: Derivative gains [1/s].
        has_reference_acceleration: There is an input for desired accelerations; otherwise they are zero.
        plant_context: Holds the plant's parameters; defaults if absent.

    Raises:
        RuntimeError: the plant is not fully actuated, or gains have another size.
    """

    def __init__(
        self,
        robot: MultibodyPlant,
        kp: ArrayLike,
        ki: ArrayLike,
        kd: ArrayLike,
        has_reference_acceleration: bool,
        plant_context: Context | None = None,
    ):
        super().__init__()
        call = "InverseDynamicsController"
        gains = [_vector(call, n, g) for n, g in (("kp", kp), ("ki", ki), ("kd", kd))]
        _require_fully_actuated(call, robot, *gains)
        self._plant, n = robot, robot.num_velocities()
        builder = DiagramBuilder()
        dynamics = builder.AddSystem(InverseDynamics(robot, plant_context=plant_context))
        self._pid = builder.AddSystem(PidController(*gains))
        total = builder.AddSystem(Adder(2, n))
        to_actuators = np.linalg.inv(robot.MakeActuationMatrix())
        actuation = builder.AddSystem(MatrixGain(to_actuators))
        builder.Connect(self._pid.get_output_port_control(), total.get_input_port(0))
        builder.Connect(total.get_output_port(), dynamics.get_input_port_desired_acceleration())
        builder.Connect(dynamics.get_output_port_generalized_force(), actuation.get_input_port())
        state = builder.ExportInput(dynamics.get_input_port_estimated_state(), "estimated_state")
        builder.ConnectInput(state, self._pid.get_input_port_estimated_state())
        builder.ExportInput(self._pid.get_input_port_desired_state(), "desired_state")
        if has_reference_acceleration:
            builder.ExportInput(total.get_input_port(1), "desired_acceleration")
        else:
            zero = builder.AddSystem(ConstantVectorSource(np.zeros(n)))
            builder.Connect(zero.get_output_port(), total.get_input_port(1))
        builder.ExportOutput(actuation.get_output_port(), "actuation")
        builder.ExportOutput(dynamics.get_output_port_generalized_force(), "generalized_force")
        builder.BuildInto(self)

    def set_integral_value(self, context: Context, value: ArrayLike, /) -> None:
        """Sets the integral of the error in positions, shape `(n,)`."""
        self.GetMutableSubsystemContext(self._pid, context).SetContinuousState(value)

    def get_multibody_plant_for_control(self) -> MultibodyPlant:
        """Returns the plant."""
        return self._plant

    get_input_port_estimated_state = input_port("estimated_state", "Returns the input for the plant's state.")
    get_input_port_desired_state = input_port("desired_state", "Returns the input for the desired state.")
    get_input_port_desired_acceleration = input_port(
        "desired_acceleration", "Returns the input for desired accelerations; there is one if so constructed."
    )
    get_output_port_control = output_port(
        "actuation", "Returns the output with actuation [Nm or N], one element for each actuator."
    )
    get_output_port_generalized_force = output_port(
        "generalized_force", "Returns the output with generalized forces [Nm or N]."
    )


@checked
class JointStiffnessController(_PlantKeeper):
    """Makes the joints of a plant springs and dampers about a desired state, gravity compensated.

    actuation = B⁻¹ (kp (q_d - q) + kd (v_d - v) - τ_gravity - τ_applied), τ_applied being springs' and dampers' in the
    plant; Coriolis forces are left alone.

    Args:
        plant: The plant, finalized and fully actuated.
        kp: Stiffness [Nm/rad or N/m], shape `(n,)`.
        kd: Damping [Nm s/rad or N s/m], shape `(n,)`.

    Raises:
        RuntimeError: the plant is not fully actuated, or gains have another size.
    """

    def __init__(self, plant: MultibodyPlant, kp: ArrayLike, kd: ArrayLike):
        super().__init__()
        self._kp, self._kd = (_vector("JointStiffnessController", n, g) for n, g in (("kp", kp), ("kd", kd)))
        _require_fully_actuated("JointStiffnessController", plant, self._kp, self._kd)
        self._keep(plant)
        self._to_actuators = np.linalg.inv(plant.MakeActuationMatrix())
        states = plant.num_multibody_states()
        self.DeclareVectorInputPort("estimated_state", states)
        self.DeclareVectorInputPort("desired_state", states)
        self.DeclareVectorOutputPort("actuation", plant.num_actuated_dofs(), self._calc_actuation)
        self._compute_with(kernels.actuation_of_springs)

    def _kernel_models(self, root: Any) -> dict:
        stiffness = kernels.Stiffness(self._kp, self._kd, np.ascontiguousarray(self._to_actuators))
        return super()._kernel_models(root) | {"stiffness_model": stiffness}

    def _calc_actuation(self, context: Context, output: BasicVector) -> None:
        x, desired = (np.array(self.get_input_port(i).Eval(context)) for i in range(2))
        n = self._plant.num_positions()
        forces = self._applied_forces(self._plant_at(x))
        at_rest = self._plant_at(np.concatenate([x[:n], np.zeros(n)]))
        tau = self._plant.CalcInverseDynamics(at_rest, np.zeros(n), forces)
        tau = tau + self._kp * (desired[:n] - x[:n]) + self._kd * (desired[n:] - x[n:])
        output.SetFromVector(self._to_actuators @ tau)

    def get_multibody_plant(self) -> MultibodyPlant:
        """Returns the plant."""
        return self._plant

    get_input_port_desired_state = input_port("desired_state", "Returns the input for the desired state.")
    get_output_port_actuation = output_port(
        0, "Returns the output with actuation [Nm or N], one element for each actuator."
    )
