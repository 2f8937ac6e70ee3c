"""PID controllers.

A block with the integral as its state, native in a span, and the diagram that closes the loop around a plant.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kinds import called, count, instance_of
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.systems.controllers._kernels import pid
from sheldrake.systems.framework import Diagram, DiagramBuilder, InputPort, LeafSystem, OutputPort, System
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.primitives import Adder

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework._engine.memory import RootView


def _vector(call: str, name: str, value: ArrayLike) -> np.ndarray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros((0, 0, 0))
    if array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0]
    if array.ndim != 1:
        raise Mismatch(f"{call}(): incompatible constructor arguments; {name} must be a vector, got {value!r}.")
    return array


def _matrix(call: str, name: str, value: ArrayLike) -> np.ndarray:
    array = np.array(value, dtype=float)
    if array.ndim != 2:
        raise Mismatch(f"{call}(): incompatible constructor arguments; {name} must be a matrix, got {value!r}.")
    return array


_PROJECTION = called("float array of shape (m, n)")
_GAINS = {name: called("float | float array of shape (n,)") for name in ("kp", "ki", "kd")}
_PORTS = {"state_output_port_index": (count, 0), "plant_input_port_index": (count, 0)}


@kind("float array of shape (2 n, m)")
def _selector(value: ArrayLike | None) -> Any:
    """A matrix (one column would be gains), or None."""
    if value is not None and (np.ndim(value) != 2 or np.shape(value)[1] == 1):
        raise Mismatch
    return value


class PidController(LeafSystem):
    """Proportional, integral and derivative control of positions.

    u = output_projection (kp e_q + ki ∫e_q + kd e_v), where (e_q, e_v) = desired_state - state_projection state.

    Args:
        kp: Proportional gains, shape `(n,)`.
        ki: Integral gains [1/s], shape `(n,)`.
        kd: Derivative gains [s], shape `(n,)`.
        state_projection: Gives the controlled positions and velocities from the state, shape `(2 n, num_states)`; the
            identity if absent.
        output_projection: Shape `(num_outputs, n)`; the identity if absent.

    Raises:
        RuntimeError: sizes do not fit.
    """

    _generic = True

    @overloaded(
        overload(lambda self, *gains: self.__init__(None, None, *gains), **_GAINS),
        overload(lambda self, P, *gains: self.__init__(P, None, *gains), state_projection=_PROJECTION, **_GAINS),
        overload(state_projection=_PROJECTION, output_projection=_PROJECTION, **_GAINS),
    )
    def __init__(self, P: ArrayLike, O: ArrayLike, kp: ArrayLike, ki: ArrayLike, kd: ArrayLike):
        super().__init__()
        kp, ki, kd = (_vector("PidController", n, g) for n, g in (("kp", kp), ("ki", ki), ("kd", kd)))
        if not kp.size == ki.size == kd.size:
            raise RuntimeError(f"Gains must have equal length: |Kp| = {kp.size}, |Ki| = {ki.size}, |Kd| = {kd.size}")
        P, O = (None if m is None else _matrix("PidController", "projections", m) for m in (P, O))
        gains, n = np.stack([kp, ki, kd]), kp.size
        projects = np.array([P is not None, O is not None], dtype=np.int64)
        P, O = np.eye(2 * n) if P is None else P, np.eye(n) if O is None else O
        if P.shape[0] != 2 * n:
            raise RuntimeError(
                f"PidController(): State projection row dimension mismatch, expecting {2 * n}, is {P.shape[0]}"
            )
        if O.shape[1] != n:
            raise RuntimeError(
                f"PidController(): Output projection column dimension mismatch, expecting {n}, is {O.shape[1]}"
            )
        self._model: Any = pid.Pid(gains, np.ascontiguousarray(P), np.ascontiguousarray(O), projects)
        self.DeclareContinuousState(n)
        self.DeclareTimeDerivatives(pid.integral)
        self.DeclareVectorInputPort("estimated_state", P.shape[1])
        self.DeclareVectorInputPort("desired_state", 2 * n)
        self.DeclareVectorOutputPort("control", O.shape[0], pid.control)

    def _kernel_models(self, root: RootView) -> dict:
        return {"model": self._model}

    def get_Kp_vector(self) -> np.ndarray:
        """Returns the proportional gains, shape `(n,)`."""
        return self._model.kp.copy()

    def get_Ki_vector(self) -> np.ndarray:
        """Returns the integral gains [1/s], shape `(n,)`."""
        return self._model.ki.copy()

    def get_Kd_vector(self) -> np.ndarray:
        """Returns the derivative gains [s], shape `(n,)`."""
        return self._model.kd.copy()

    get_input_port_estimated_state = input_port(0, "Returns the input for the state.")
    get_input_port_desired_state = input_port(1, "Returns the input for the desired positions and velocities.")
    get_output_port_control = output_port(0, "Returns the output with the control.")


class PidControlledSystem(Diagram):
    """A plant with a PID controller around it.

    Inputs are `feedforward_control`, added to the controller's output, and `desired_state`; the output is the plant's
    state.

    Args:
        plant: A system with an input for control and an output with positions and velocities.
        feedback_selector: Gives the controlled positions and velocities from the plant's output, shape
            `(2 n, num_states)`; may be left out.
        kp: Proportional gains, shape `(n,)`, or one number for all.
        ki: Integral gains [1/s].
        kd: Derivative gains [s].
        state_output_port_index: Which output of the plant is its state.
        plant_input_port_index: Which input of the plant takes the control.
    """

    @overloaded(
        overload(plant=instance_of(System), feedback_selector=_selector, **_GAINS, **_PORTS),
        overload(
            lambda self, plant, *rest: self.__init__(plant, None, *rest),
            plant=instance_of(System),
            **_GAINS,
            **_PORTS,
        ),
    )
    def __init__(
        self,
        plant: System,
        selector: ArrayLike | None,
        kp: Any,
        ki: Any,
        kd: Any,
        state_output: int,
        plant_input: int,
    ):
        super().__init__()
        self._state_port = state_output
        target = plant.get_input_port(plant_input)
        gains = [g * np.ones(target.size()) if np.ndim(g) == 0 else g for g in (kp, ki, kd)]
        controller = PidController(*gains) if selector is None else PidController(selector, *gains)
        self._build(plant, plant.get_output_port(self._state_port), target, controller)

    def _build(self, plant: System, state: OutputPort, target: InputPort, controller: PidController) -> None:
        builder = DiagramBuilder()
        builder.AddSystem(plant)
        builder.AddSystem(controller)
        total = builder.AddSystem(Adder(2, target.size()))
        builder.Connect(controller.get_output_port_control(), total.get_input_port(0))
        builder.Connect(total.get_output_port(), target)
        builder.Connect(state, controller.get_input_port_estimated_state())
        builder.ExportInput(total.get_input_port(1), "feedforward_control")
        builder.ExportInput(controller.get_input_port_desired_state(), "desired_state")
        builder.ExportOutput(state, state.get_name())
        builder.BuildInto(self)

    get_control_input_port = input_port(0, "Returns the input added to the controller's output.")
    get_state_input_port = input_port(1, "Returns the input for the desired positions and velocities.")
    get_state_output_port = output_port(0, "Returns the output with the plant's state.")
