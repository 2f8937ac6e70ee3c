"""Small systems to build with."""

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

__all__ = [
    "Adder",
    "AffineSystem",
    "ConstantValueSource",
    "ConstantVectorSource",
    "Demultiplexer",
    "DiscreteTimeDelay",
    "DiscreteTimeIntegrator",
    "FirstOrderLowPassFilter",
    "Gain",
    "Integrator",
    "LinearSystem",
    "LogVectorOutput",
    "MatrixGain",
    "Multiplexer",
    "PassThrough",
    "PortSwitch",
    "Saturation",
    "Sine",
    "VectorLog",
    "VectorLogSink",
    "WrapToSystem",
    "ZeroOrderHold",
]
