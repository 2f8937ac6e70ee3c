"""PID controllers.

A block with the integral as its state, native in a span, and the diagram that closes the loop around a plant.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.systems.controllers._kernels import pid
from sheldrake.systems.framework import Diagram, DiagramBuilder, InputPort, LeafSystem, OutputPort, System
from sheldrake.systems.primitives import Adder


def _vector(call: str, name: str, value: Any) -> np.ndarray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros((0, 0, 0))
    if array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0]
    if array.ndim != 1:
        raise TypeError(f"{call}(): incompatible constructor arguments; {name} must be a vector, got {value!r}.")
    return array


def _matrix(call: str, name: str, value: Any) -> np.ndarray:
    array = np.array(value, dtype=float)
    if array.ndim != 2:
        raise TypeError(f"{call}(): incompatible constructor arguments; {name} must be a matrix, got {value!r}.")
    return array


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

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__()
        names = ("kp", "ki", "kd")
        if len(args) + sum(n in kwargs for n in names) not in (3, 4, 5) or len(args) > 5:
            raise TypeError(
                "PidController(): incompatible constructor arguments; expected (kp, ki, kd), (state_projection, kp, "
                "ki, kd) or (state_projection, output_projection, kp, ki, kd)."
            )
        positional = list(args)
        gains = {n: kwargs[n] for n in names if n in kwargs}
        for name in reversed(names):
            if name not in gains:
                gains[name] = positional.pop()
        rest = [*positional, *(kwargs[n] for n in ("state_projection", "output_projection") if n in kwargs)]
        kp, ki, kd = (_vector("PidController", n, gains[n]) for n in names)
        if not kp.size == ki.size == kd.size:
            raise RuntimeError(f"Gains must have equal length: |Kp| = {kp.size}, |Ki| = {ki.size}, |Kd| = {kd.size}")
        self._set_up(np.stack([kp, ki, kd]), *(_matrix("PidController", "projections", m) for m in rest))

    def _set_up(self, gains: np.ndarray, P: np.ndarray | None = None, O: np.ndarray | None = None) -> None:
        n = gains.shape[1]
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
        self._model = pid.Pid(gains, np.ascontiguousarray(P), np.ascontiguousarray(O), projects)
        self.DeclareContinuousState(n)
        self._declare_time_derivatives(pid.integral)
        self.DeclareVectorInputPort("estimated_state", P.shape[1])
        self.DeclareVectorInputPort("desired_state", 2 * n)
        self.DeclareVectorOutputPort("control", O.shape[0], pid.control)

    def _kernel_models(self, root: Any) -> dict:
        return {"model": self._model}

    def get_Kp_vector(self) -> np.ndarray:
        """Returns the proportional gains, shape `(n,)`."""
        return self._model.gains[0].copy()

    def get_Ki_vector(self) -> np.ndarray:
        """Returns the integral gains [1/s], shape `(n,)`."""
        return self._model.gains[1].copy()

    def get_Kd_vector(self) -> np.ndarray:
        """Returns the derivative gains [s], shape `(n,)`."""
        return self._model.gains[2].copy()

    def get_input_port_estimated_state(self) -> InputPort:
        """Returns the input for the state."""
        return self.get_input_port(0)

    def get_input_port_desired_state(self) -> InputPort:
        """Returns the input for the desired positions and velocities."""
        return self.get_input_port(1)

    def get_output_port_control(self) -> OutputPort:
        """Returns the output with the control."""
        return self.get_output_port(0)


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

    def __init__(self, plant: System, *args: Any, **kwargs: Any):
        super().__init__()
        names = ["kp", "ki", "kd", "state_output_port_index", "plant_input_port_index"]
        first = kwargs.pop("feedback_selector", None)
        positional = list(args)
        if first is None and positional and np.ndim(positional[0]) == 2 and np.shape(positional[0])[1] != 1:
            first = positional.pop(0)
        given = {**dict(zip(names, positional)), **kwargs}
        if not {"kp", "ki", "kd"} <= given.keys() or not given.keys() <= set(names):
            raise TypeError(
                f"PidControlledSystem(): incompatible constructor arguments; expected plant, [feedback_selector], kp, "
                f"ki, kd, state_output_port_index, plant_input_port_index; got {sorted(given)}."
            )
        self._state_port = int(given.get("state_output_port_index", 0))
        target = plant.get_input_port(int(given.get("plant_input_port_index", 0)))
        gains = [g * np.ones(target.size()) if np.ndim(g) == 0 else g for g in (given[n] for n in names[:3])]
        controller = PidController(*gains) if first is None else PidController(first, *gains)
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

    def get_control_input_port(self) -> InputPort:
        """Returns the input added to the controller's output."""
        return self.get_input_port(0)

    def get_state_input_port(self) -> InputPort:
        """Returns the input for the desired positions and velocities."""
        return self.get_input_port(1)

    def get_state_output_port(self) -> OutputPort:
        """Returns the output with the plant's state."""
        return self.get_output_port(0)
