"""Systems without state: sums, gains, routing, sources.

Declarations only; what they compute is in `_kernels/blocks.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import called, count, flag, instance_of, integers
from sheldrake.common._overloads import Mismatch, overload, overloaded
from sheldrake.common._scalars import float_vector, scalar
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework import BasicVector, LeafSystem, PortDataType
from sheldrake.systems.framework._declarations import vector_model
from sheldrake.systems.framework._index import Ticket
from sheldrake.systems.framework._port_getters import input_port
from sheldrake.systems.framework._vector import as_size, as_vector, lifted, plain
from sheldrake.systems.primitives._kernels import blocks

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Scalars
    from sheldrake.systems.framework import Context, InputPort
    from sheldrake.systems.framework._engine.memory import RootView
    from sheldrake.systems.framework._index import UseDefaultName


@checked
class Adder(LeafSystem):
    """Sum of inputs.

    Args:
        num_inputs: How many inputs.
        size: Size of each, and of the output.
    """

    _generic = True
    _complex_rows = True

    def __init__(self, num_inputs: int, size: int):
        super().__init__()
        for i in range(as_size(num_inputs, "Adder()")):
            self.DeclareVectorInputPort(f"u{i}", size)
        self.DeclareVectorOutputPort("sum", size, blocks.add)


class Gain(LeafSystem):
    """Element-wise product of a constant and the input.

    Args:
        k: The constant: a number (then `size` counts), or one for each element.
        size: Size of input and output.
    """

    _generic = True
    _complex_rows = True

    @overloaded(overload(k=scalar(float), size=count), overload(k=float_vector))
    def __init__(self, k: Any, size: int | None = None):
        super().__init__()
        self._k = k if size is None else np.full(size, k)
        n = len(self._k)
        self.DeclareVectorInputPort("u0", n)
        self.DeclareVectorOutputPort("y0", n, blocks.scale)

    def _kernel_models(self, root: RootView) -> dict:
        return {"model": self._k}


class Saturation(LeafSystem):
    """The input, limited element-wise.

    Args:
        min_value: Lower bounds.
        max_value: Upper bounds; none below its lower bound.
    """

    _generic = True
    _complex_rows = True

    def __init__(self, min_value: ArrayLike, max_value: ArrayLike):
        super().__init__()
        low, high = (as_vector(limit).ravel() for limit in (min_value, max_value))
        if low.shape != high.shape or not all(plain(x) <= plain(y) for x, y in zip(low.tolist(), high.tolist())):
            raise RuntimeError(
                f"Saturation: min_value {low.tolist()} must have the size of max_value {high.tolist()} and "
                "not exceed it."
            )
        if object in (low.dtype, high.dtype):  # they may have derivatives
            low, high = lifted(low, self._scalar), lifted(high, self._scalar)
            self._complex_rows = False
        self._limits = blocks.Limits(low, high)
        self.DeclareVectorInputPort("u0", len(low))
        self.DeclareVectorOutputPort("y0", len(low), blocks.saturate)

    def _kernel_models(self, root: RootView) -> dict:
        return {"model": self._limits}


class Multiplexer(LeafSystem):
    """Inputs, one after the other, as one vector.

    Args:
        num_scalar_inputs: How many scalar inputs; or the sizes of the inputs (by name: `input_sizes`); or a
            BasicVector like the output (by name: `model_vector`).
    """

    _generic = True
    _complex_rows = True

    @overloaded(
        overload(num_scalar_inputs=count),
        overload(input_sizes=integers),
        overload(model_vector=instance_of(BasicVector)),
    )
    def __init__(self, given: Any):
        super().__init__()
        if isinstance(given, BasicVector):
            sizes, model = [1] * given.size(), given
        else:
            sizes = [1] * given if isinstance(given, int) else given
            model = BasicVector(np.zeros(sum(sizes)))
        for i, n in enumerate(sizes):
            self.DeclareVectorInputPort(f"u{i}", n)
        self.DeclareVectorOutputPort("y0", model, blocks.concatenate)


class Demultiplexer(LeafSystem):
    """Pieces of a vector as separate outputs.

    Args:
        size: Size of the input.
        output_ports_size: Size of each output; it must divide `size`.
        output_ports_sizes: Sizes of the outputs, instead of the above.
    """

    _generic = True
    _complex_rows = True

    @overloaded(overload(size=count, output_ports_size=(count, 1)), overload(output_ports_sizes=integers))
    def __init__(self, given: Any, each: int = 1):
        super().__init__()
        if isinstance(given, int):
            if each < 1 or given < 1 or given % each:
                raise RuntimeError(
                    f"Demultiplexer: output_ports_size {each} must divide the size {given} of the input."
                )
            given = [each] * (given // each)
        self._sizes = given
        if not self._sizes or min(self._sizes) < 1:
            raise RuntimeError(f"Demultiplexer: sizes of outputs must be positive, got {self._sizes}.")
        self.DeclareVectorInputPort("u0", sum(self._sizes))
        begin = 0
        for j, n in enumerate(self._sizes):
            self.DeclareVectorOutputPort(f"y{j}", n, blocks.piece)
            self._output_models[j] = {"model": blocks.Piece.of(start=begin)}
            begin += n

    def get_output_ports_sizes(self) -> list[int]:
        """Sizes of the outputs."""
        return list(self._sizes)


class ConstantVectorSource(LeafSystem):
    """A constant vector; it is a parameter.

    Args:
        source_value: The vector.
    """

    _generic = True
    _complex_rows = True

    def __init__(self, source_value: BasicVector | Scalars):
        super().__init__()
        self.DeclareNumericParameter(BasicVector(as_vector(source_value)))
        self.DeclareVectorOutputPort("y0", self._pn_models[0].size(), blocks.copy_parameter)

    def get_source_value(self, context: Context) -> BasicVector:
        """The vector in a context."""
        self.ValidateContext(context)
        return context.get_numeric_parameter(0)

    def get_mutable_source_value(self, context: Context) -> BasicVector:
        """The vector in a context, to be changed."""
        self.ValidateContext(context)
        return context.get_mutable_numeric_parameter(0)


class ConstantValueSource(LeafSystem):
    """A constant abstract value.

    Args:
        value: The value; copied.
    """

    _generic = True

    def __init__(self, value: AbstractValue):
        super().__init__()
        if not isinstance(value, AbstractValue):
            raise Mismatch(f"ConstantValueSource(): incompatible constructor arguments: {value!r} is no AbstractValue")
        self._value = value.Clone()
        self.DeclareAbstractOutputPort("y0", self._value.Clone, self._calc, {Ticket.NOTHING})

    def _calc(self, context: Context, output: AbstractValue) -> None:
        output.SetFrom(self._value)


class PassThrough(LeafSystem):
    """The input, unchanged; without one, what it was made with.

    Args:
        vector_size: Size (without input: zeros); or
        value: a vector of that size; or
        abstract_model_value: an AbstractValue of the type.
        input_required: Whether it is an error to ask for the output where there is no input.
    """

    _generic = True
    _complex_rows = True

    @overloaded(
        overload(vector_size=count, input_required=(flag, False)),
        overload(abstract_model_value=instance_of(AbstractValue), input_required=(flag, False)),
        overload(value=called("float array of shape (n,)"), input_required=(flag, False)),
    )
    def __init__(self, model: Any, input_required: bool = False):
        super().__init__()
        self._required = input_required
        if isinstance(model, AbstractValue):
            self._value = model.Clone()
            self.DeclareAbstractInputPort("u", model)
            self.DeclareAbstractOutputPort("y", self._value.Clone, self._copy_value)
        else:
            default = vector_model(model, "PassThrough()").CopyToVector()
            self.DeclareVectorInputPort("u", BasicVector(default))
            self._inputs[0].optional = not input_required
            self.DeclareVectorOutputPort("y", BasicVector(default), blocks.copy_input)

    def input_required(self) -> bool:
        """Tells whether it is an error to ask for the output where there is no input."""
        return self._required

    def _copy_value(self, context: Context, output: AbstractValue) -> None:
        port = self.get_input_port(0)
        given = self._required or port.HasValue(context)
        output.SetFrom(port.EvalAbstract(context) if given else self._value)


class PortSwitch(LeafSystem):
    """One of several inputs, which one an input tells: a port's index.

    Args:
        vector_size: Size of the inputs and of the output.
    """

    _generic = True

    def __init__(self, vector_size: int):
        from sheldrake.common.value import Value
        from sheldrake.systems.framework import InputPortIndex

        super().__init__()
        self._n = as_size(vector_size, "PortSwitch()")
        self.DeclareAbstractInputPort("port_selector", Value[InputPortIndex](InputPortIndex(0)))
        self.DeclareVectorOutputPort("value", self._n, self._calc)

    def DeclareInputPort(self, name: str | UseDefaultName, *args: Any) -> InputPort:
        """Declares one more input to choose from."""
        if args:
            return super().DeclareInputPort(name, *args)
        return super().DeclareInputPort(name, PortDataType.kVectorValued, self._n)

    get_port_selector_input_port = input_port(0, "The input that tells which one.")

    def _calc(self, context: Context, output: BasicVector) -> None:
        which = self.get_input_port(int(self.get_input_port(0).Eval(context)))
        if which.get_data_type() is PortDataType.kAbstractValued:
            raise RuntimeError(f"PortSwitch: {which.GetFullDescription()} was chosen, which is no vector.")
        output.SetFromVector(which.Eval(context))


class Sine(LeafSystem):
    """Sines, with first and second derivatives, of time or of the input.

    Args:
        amplitude: One, or one for each element.
        frequency: The same [rad/s].
        phase: The same [rad].
        size: Number of elements, when the others are single numbers.
        is_time_based: Of time; else of the input.
    """

    _generic = True

    @typing_overload
    def __init__(
        self, amplitude: float, frequency: float, phase: float, size: int, is_time_based: bool = True
    ) -> None: ...
    @typing_overload
    def __init__(
        self, amplitudes: ArrayLike, frequencies: ArrayLike, phases: ArrayLike, is_time_based: bool = True
    ) -> None: ...
    @overloaded(
        overload(
            amplitude=scalar(float),
            frequency=scalar(float),
            phase=scalar(float),
            size=count,
            is_time_based=(flag, True),
        ),
        overload(amplitudes=float_vector, frequencies=float_vector, phases=float_vector, is_time_based=(flag, True)),
    )
    def __init__(self, *given: Any):
        super().__init__()
        *waves, of_time = given
        if len(waves) == 4:
            *numbers, size = waves
            waves = [np.full(size, number) for number in numbers]
        if len({len(w) for w in waves}) != 1:
            raise RuntimeError("Sine: amplitudes, frequencies and phases must have the same size.")
        n = len(waves[0])
        if not of_time:
            self.DeclareVectorInputPort("u0", n)
        for order in range(3):
            self.DeclareVectorOutputPort(f"y{order}", n, blocks.sine_of_time if of_time else blocks.sine_of_input)
            self._output_models[order] = {
                "wave_model": blocks.Waves(waves[0], waves[1], waves[2], np.array([float(order)]))
            }
