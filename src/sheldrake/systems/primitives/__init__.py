"""Small systems to build with."""

from sheldrake.systems.framework import LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate
from sheldrake.systems.primitives._blocks import (
    Adder,
    ConstantValueSource,
    ConstantVectorSource,
    Demultiplexer,
    Gain,
    Multiplexer,
    PassThrough,
    PortSwitch,
    Saturation,
    Sine,
)
from sheldrake.systems.primitives._dynamics import (
    AffineSystem,
    DiscreteTimeDelay,
    DiscreteTimeIntegrator,
    FirstOrderLowPassFilter,
    Integrator,
    LinearSystem,
    MatrixGain,
    WrapToSystem,
    ZeroOrderHold,
)
from sheldrake.systems.primitives._vector_log import VectorLog
from sheldrake.systems.primitives._vector_log_sink import LogVectorOutput, VectorLogSink


def _family(cls: type, base: SystemTemplate = LeafSystem_) -> SystemTemplate:
    return SystemTemplate(f"{cls.__name__}_", cls, scope=__name__, own=True, base=base)


AffineSystem_ = _family(AffineSystem)
LinearSystem_ = _family(LinearSystem, AffineSystem_)
Adder_ = _family(Adder)
ConstantValueSource_ = _family(ConstantValueSource)
ConstantVectorSource_ = _family(ConstantVectorSource)
Demultiplexer_ = _family(Demultiplexer)
DiscreteTimeDelay_ = _family(DiscreteTimeDelay)
DiscreteTimeIntegrator_ = _family(DiscreteTimeIntegrator)
FirstOrderLowPassFilter_ = _family(FirstOrderLowPassFilter)
Gain_ = _family(Gain)
Integrator_ = _family(Integrator)
MatrixGain_ = _family(MatrixGain, LinearSystem_)
Multiplexer_ = _family(Multiplexer)
PassThrough_ = _family(PassThrough)
PortSwitch_ = _family(PortSwitch)
Saturation_ = _family(Saturation)
Sine_ = _family(Sine)
VectorLogSink_ = _family(VectorLogSink)
WrapToSystem_ = _family(WrapToSystem)
ZeroOrderHold_ = _family(ZeroOrderHold)
VectorLog_ = SystemTemplate("VectorLog_", VectorLog, scope=__name__)

__all__ = [
    "Adder",
    "Adder_",
    "AffineSystem",
    "AffineSystem_",
    "ConstantValueSource",
    "ConstantValueSource_",
    "ConstantVectorSource",
    "ConstantVectorSource_",
    "Demultiplexer",
    "Demultiplexer_",
    "DiscreteTimeDelay",
    "DiscreteTimeDelay_",
    "DiscreteTimeIntegrator",
    "DiscreteTimeIntegrator_",
    "FirstOrderLowPassFilter",
    "FirstOrderLowPassFilter_",
    "Gain",
    "Gain_",
    "Integrator",
    "Integrator_",
    "LinearSystem",
    "LinearSystem_",
    "LogVectorOutput",
    "MatrixGain",
    "MatrixGain_",
    "Multiplexer",
    "Multiplexer_",
    "PassThrough",
    "PassThrough_",
    "PortSwitch",
    "PortSwitch_",
    "Saturation",
    "Saturation_",
    "Sine",
    "Sine_",
    "VectorLog",
    "VectorLogSink",
    "VectorLogSink_",
    "VectorLog_",
    "WrapToSystem",
    "WrapToSystem_",
    "ZeroOrderHold",
    "ZeroOrderHold_",
]
