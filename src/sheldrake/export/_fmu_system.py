"""FmuSystem: somebody else's FMU as a system, run by FMPy."""

from __future__ import annotations

import contextlib
import math
import weakref
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import Value
from sheldrake.export._fmu_file import FmuFile, FmuVariable
from sheldrake.systems.framework import EventStatus, LeafSystem

if TYPE_CHECKING:
    from os import PathLike

    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._state import State
    from sheldrake.systems.framework._vector import BasicVector

_TERMINATED = 3
"""What FMI 2.0 calls the question whether a slave has ended."""


class FmuSystem(LeafSystem):
    """Runs an FMU for co-simulation, of FMI 2.0 or 3.0, between communication points.

    Each input variable is an input port of its name, each output variable an output port: vectors of one element, or of
    as many as the variable has; integers, booleans and enumerations come as numbers. A port that nothing is connected
    to leaves the FMU's start value. Text, binary values and clocks have no ports: `left_out()` names them. Outputs are
    those after the last step, so that no output depends directly on an input.

    With a step, the FMU goes from t to t + step with the inputs of t when t is a multiple of it, as a discrete plant
    does. With step 0 it catches up with the simulator's time whenever a step of the simulator begins, with the inputs
    of then: during the step its outputs are those of the step's beginning.

    A copy of a context goes on by itself if the FMU can serialize its state. An FMU is machine code: run none that you
    would not run as a program.

    Args:
        path: The file.
        step: Communication step [s]; 0 for the simulator's own steps; by default what the FMU proposes, else 0.
        parameters: Values by the name of variables that may be set before the initialization.
        outputs: Names of variables that get output ports beside the FMU's outputs; such as local ones.

    Raises:
        ModuleNotFoundError: FMPy is not installed.
        OSError: the file can not be read.
        ValueError: it is damaged, holds what it must not (paths out of it, entities), is of another version or kind,
            has no machine code for this platform, or a name, value or step does not suit it.
        RuntimeError: the FMU itself refuses to begin; its words are in the message.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        *,
        step: float | None = None,
        parameters: Mapping[str, Any] | None = None,
        outputs: Iterable[str] = (),
    ):
        super().__init__()
        self._file = file = FmuFile(path, "FmuSystem")
        self.set_name(file.name)
        self._step = self._checked_step(step)
        self._inputs_of = file.variables("input")
        self._outputs_of = list(
            dict.fromkeys([*file.variables("output"), *(file.find(name, "outputs") for name in outputs)])
        )
        self._given = [file.settable(name, value) for name, value in dict(parameters or {}).items()]
        for variable in self._inputs_of:
            self.DeclareVectorInputPort(variable.name, variable.size)
        slave = _Slave(self)
        slave.start(0.0, [])
        state = self.DeclareAbstractState(Value[object](slave.at_rest()))
        for k, variable in enumerate(self._outputs_of):
            self.DeclareVectorOutputPort(
                variable.name, variable.size, self._output(k), {self.abstract_state_ticket(state)}
            )
        self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
        if self._step > 0:
            self.DeclarePeriodicUnrestrictedUpdateEvent(self._step, 0.0, self._advance)
        else:
            self.DeclarePerStepUnrestrictedUpdateEvent(self._advance)

    def get_step(self) -> float:
        """Communication step [s]; 0 if the FMU follows the simulator's steps."""
        return self._step

    def left_out(self) -> list[str]:
        """Inputs and outputs without a port, for they are no numbers."""
        return self._file.left_out()

    def _checked_step(self, step: float | None) -> float:
        proposed = self._file.proposed_step()
        found = float((proposed or 0.0) if step is None else step)
        if not (found >= 0 and math.isfinite(found)):
            raise ValueError(f"FmuSystem({self._file.path!r}): step {step} must be a number of seconds, or 0.")
        if found == 0 and not self._file.takes_any_step():
            raise ValueError(
                f"FmuSystem({self._file.path!r}): this FMU takes steps of one size alone; give it as step [s]."
            )
        return found

    def _output(self, k: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_abstract_state(0).get_value().outputs[k])

        return calc

    def _values(self, context: Context) -> list[tuple[FmuVariable, np.ndarray]]:
        """Values of the input ports that have one."""
        ports = (self.get_input_port(k) for k in range(len(self._inputs_of)))
        return [(v, port.Eval(context)) for v, port in zip(self._inputs_of, ports) if port.HasValue(context)]

    def _begin(self, context: Context, state: State) -> None:
        slave = state.get_mutable_abstract_state(0).get_mutable_value()
        slave.start(context.get_time(), self._values(context))

    def _advance(self, context: Context, state: State) -> EventStatus:
        slave = state.get_mutable_abstract_state(0).get_mutable_value()
        time, values = context.get_time(), self._values(context)
        if slave.time is None:
            slave.start(time, values)
        # The next multiple, to the last bit: an FMU with steps of its own counts those that fit.
        goal = (round(time / self._step) + 1) * self._step if self._step > 0 else time
        before = context.get_abstract_state(0).get_value()
        if goal > slave.time and slave.go(slave.time, goal, values, before):
            return EventStatus.ReachedTermination(self, f"the FMU ended the simulation at t = {goal} s")
        return EventStatus.Succeeded()


class _Slave:
    """An FMU in a state. Copies share an instance until one of them goes on; the others then keep what they need.

    Attributes:
        time: Where it stands [s]; None before it has begun.
        outputs: Values of the variables with output ports.
    """

    def __init__(self, system: FmuSystem):
        self.file, self._wanted, self._given = system._file, system._outputs_of, system._given
        self.time: float | None = None
        self.outputs: list[np.ndarray] = []
        self._instance: _Instance | None = None
        self._kept: bytes | str | None = None  # its state, or why there is none, once the instance went on without it

    def at_rest(self) -> _Slave:
        """The same before the beginning, with the outputs that it had then."""
        self._leave()
        self.time = None
        return self

    def __deepcopy__(self, memo: dict) -> _Slave:
        new = object.__new__(_Slave)
        new.__dict__.update(self.__dict__)
        if self._instance is not None:
            self._instance.users.add(new)
        return new

    def __reduce__(self) -> tuple[Any, ...]:
        raise TypeError(f"FmuSystem({self.file.path!r}): the state of an FMU can not be pickled.")

    def _leave(self) -> None:
        if self._instance is not None:
            self._instance.users.discard(self)
        self._instance = None

    def start(self, time: float, inputs: list[tuple[FmuVariable, np.ndarray]]) -> None:
        """Begins anew: instance, parameters, initialization, first outputs."""
        self._leave()
        self._kept, self.time = None, time
        self._instance = _Instance(self.file)
        self._instance.users.add(self)
        self._instance.begin(time, self._given, inputs)
        self.outputs = self._instance.get(self._wanted)

    def go(self, begin: float, end: float, inputs: list[tuple[FmuVariable, np.ndarray]], before: _Slave) -> bool:
        """Sets inputs and goes on; whether the FMU ended the simulation.

        Args:
            begin: From when [s].
            end: Until when [s].
            inputs: Values of the inputs.
            before: The state that this one replaces.
        """
        if self._instance is None:
            self._come_back(begin)
        run = self._instance
        assert run is not None
        others = [u for u in run.users if u is not self and u is not before]
        kept = run.keep() if others else ""
        for other in (*others, before):
            if other is not self and other._instance is run:
                other._instance = None
                other._kept = kept if other is not before else "an update that was to replace it did not end well"
                run.users.discard(other)
        run.set(inputs)
        ended = run.step(begin, end - begin)
        self.time = end
        self.outputs = run.get(self._wanted)
        return ended

    def _come_back(self, time: float) -> None:
        """An instance of its own, in the state that was kept.

        Raises:
            RuntimeError: none could be kept.
        """
        if not isinstance(self._kept, bytes):
            raise RuntimeError(f"FmuSystem({self.file.path!r}): this state is lost: {self._kept}.")
        self._instance = _Instance(self.file)
        self._instance.users.add(self)
        self._instance.begin(time, self._given, [])
        self._instance.restore(self._kept)
        self._kept = None


class _Instance:
    """A running FMU: calls of FMPy, and what went wrong in words.

    Attributes:
        users: States that it is in, all the same.
    """

    def __init__(self, file: FmuFile):
        self.file, self.users = file, weakref.WeakSet[_Slave]()
        self._said: list[str] = []
        with self._trying("it could not be instantiated"):
            self._fmu = file.instantiate(self._hear)

    def _hear(self, *message: Any) -> None:
        """Takes what the FMU tells its host: status and text are among the last."""
        with contextlib.suppress(Exception):
            self._said.append(message[-1].decode("utf-8", "replace"))

    @contextlib.contextmanager
    def _trying(self, what: str) -> Any:
        self._said.clear()
        try:
            yield
        except Exception as error:
            said = "; ".join(self._said)
            raise RuntimeError(
                f"FmuSystem({self.file.path!r}): {what}: {error}" + (f" It said: {said}" if said else "")
            ) from error

    def __del__(self) -> None:
        if hasattr(self, "_fmu"):
            with contextlib.suppress(Exception):
                self._fmu.freeInstance()

    def begin(self, time: float, given: list[tuple[FmuVariable, Any]], inputs: list[tuple[FmuVariable, Any]]) -> None:
        """Parameters, initialization, inputs."""
        two = self.file.version == "2.0"
        if two:
            with self._trying("setting up the experiment failed"):
                self._fmu.setupExperiment(startTime=time)
        self.set(given)
        with self._trying("entering the initialization failed"):
            self._fmu.enterInitializationMode(**({} if two else {"startTime": time}))
        self.set(inputs)
        with self._trying("the initialization failed"):
            self._fmu.exitInitializationMode()

    def set(self, values: list[tuple[FmuVariable, Any]]) -> None:
        """Sets variables, those of a type at once."""
        for kind in dict.fromkeys(v.getter for v, _ in values):
            group = [(v, value) for v, value in values if v.getter == kind]
            call = getattr(self._fmu, f"set{kind}")
            try:
                call([v.reference for v, _ in group], [x for v, value in group for x in v.encoded(value)])
            except Exception:
                for v, value in group:  # one by one: which of them is it?
                    with self._trying(f"the variable {v.name!r} can not be set to {np.ravel(value).tolist()}"):
                        call([v.reference], v.encoded(value))

    def get(self, variables: list[FmuVariable]) -> list[np.ndarray]:
        """Values of variables."""
        found = []
        for v in variables:
            with self._trying(f"the variable {v.name!r} can not be read"):
                more = {} if self.file.version == "2.0" else {"nValues": v.size}
                found.append(np.array(getattr(self._fmu, f"get{v.getter}")([v.reference], **more), float))
        return found

    def step(self, begin: float, step: float) -> bool:
        """One communication step; whether the FMU ended the simulation then."""
        with self._trying(f"the step from t = {begin} s by {step} s failed"):
            if self.file.version == "2.0":
                try:
                    self._fmu.doStep(begin, step)
                except Exception as error:
                    if getattr(error, "status", None) == 2 and self._fmu.getBooleanStatus(_TERMINATED):
                        return True
                    raise
                return False
            _, ended, early, reached = self._fmu.doStep(begin, step)
            if early and not ended:
                raise RuntimeError(f"it returned at t = {reached} s, though not allowed to return early.")
            return bool(ended)

    def keep(self) -> bytes | str:
        """Its state, or why there is none."""
        if not self.file.can_serialize():
            return "the FMU went on in another context, and it can not serialize its state"
        with self._trying("keeping its state failed"):
            state = self._fmu.getFMUState()
            try:
                return self._fmu.serializeFMUState(state)
            finally:
                self._fmu.freeFMUState(state)

    def restore(self, kept: bytes) -> None:
        """Back to a state."""
        with self._trying("going back to a state failed"):
            state = self._fmu.deserializeFMUState(kept)
            try:
                self._fmu.setFMUState(state)
            finally:
                self._fmu.freeFMUState(state)
