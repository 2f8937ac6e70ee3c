"""Small systems to build with.

Sums, gains, filters, delays, linear systems, sources and logs. Most are kernels: a diagram of them advances natively.
"""

from sheldrake.common._names import show_as_own
from sheldrake.systems.framework import Diagram_, LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate
from sheldrake.systems.primitives._affine_system import AffineSystem, LinearSystem, MatrixGain
from sheldrake.systems.primitives._barycentric_mesh_system import BarycentricMeshSystem
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
from sheldrake.systems.primitives._discrete_derivative import (
    DiscreteDerivative,
    StateInterpolatorWithDiscreteDerivative,
)
from sheldrake.systems.primitives._dynamics import (
    DiscreteTimeDelay,
    DiscreteTimeIntegrator,
    FirstOrderLowPassFilter,
    Integrator,
    WrapToSystem,
    ZeroOrderHold,
)
from sheldrake.systems.primitives._linear_transform_density import LinearTransformDensity
from sheldrake.systems.primitives._linearization import (
    ControllabilityMatrix,
    FirstOrderTaylorApproximation,
    IsControllable,
    IsDetectable,
    IsObservable,
    IsStabilizable,
    Linearize,
    ObservabilityMatrix,
)
from sheldrake.systems.primitives._log_files import LogStream, ReadLogs, StreamLogs
from sheldrake.systems.primitives._log_set import LogSet
from sheldrake.systems.primitives._multilayer_perceptron import MultilayerPerceptron, PerceptronActivationType
from sheldrake.systems.primitives._random_source import AddRandomInputs, RandomSource
from sheldrake.systems.primitives._routing import BusCreator, BusSelector, Selector, SelectorParams, SharedPointerSystem
from sheldrake.systems.primitives._sparse_matrix_gain import SparseMatrixGain
from sheldrake.systems.primitives._symbolic_vector_system import SymbolicVectorSystem
from sheldrake.systems.primitives._trajectory_systems import (
    TrajectoryAffineSystem,
    TrajectoryLinearSystem,
    TrajectorySource,
)
from sheldrake.systems.primitives._vector_log import VectorLog
from sheldrake.systems.primitives._vector_log_sink import AllLogs, LogAll, LogVectorOutput, VectorLogSink


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
BusCreator_ = _family(BusCreator)
BusSelector_ = _family(BusSelector)
DiscreteDerivative_ = _family(DiscreteDerivative)
Selector_ = _family(Selector)
SharedPointerSystem_ = _family(SharedPointerSystem)
SparseMatrixGain_ = _family(SparseMatrixGain)
SymbolicVectorSystem_ = _family(SymbolicVectorSystem)
TrajectoryAffineSystem_ = _family(TrajectoryAffineSystem)
TrajectoryLinearSystem_ = _family(TrajectoryLinearSystem, TrajectoryAffineSystem_)
TrajectorySource_ = _family(TrajectorySource)
StateInterpolatorWithDiscreteDerivative_ = _family(StateInterpolatorWithDiscreteDerivative, Diagram_)
LinearTransformDensity_ = _family(LinearTransformDensity)
MultilayerPerceptron_ = _family(MultilayerPerceptron)
VectorLog_ = SystemTemplate("VectorLog_", VectorLog, scope=__name__)

__all__ = [
    "AddRandomInputs",
    "Adder",
    "Adder_",
    "AffineSystem",
    "AffineSystem_",
    "AllLogs",
    "BarycentricMeshSystem",
    "BusCreator",
    "BusCreator_",
    "BusSelector",
    "BusSelector_",
    "ConstantValueSource",
    "ConstantValueSource_",
    "ConstantVectorSource",
    "ConstantVectorSource_",
    "ControllabilityMatrix",
    "Demultiplexer",
    "Demultiplexer_",
    "DiscreteDerivative",
    "DiscreteDerivative_",
    "DiscreteTimeDelay",
    "DiscreteTimeDelay_",
    "DiscreteTimeIntegrator",
    "DiscreteTimeIntegrator_",
    "FirstOrderLowPassFilter",
    "FirstOrderLowPassFilter_",
    "FirstOrderTaylorApproximation",
    "Gain",
    "Gain_",
    "Integrator",
    "Integrator_",
    "IsControllable",
    "IsDetectable",
    "IsObservable",
    "IsStabilizable",
    "LinearSystem",
    "LinearSystem_",
    "LinearTransformDensity",
    "LinearTransformDensity_",
    "Linearize",
    "LogAll",
    "LogSet",
    "LogStream",
    "LogVectorOutput",
    "MatrixGain",
    "MatrixGain_",
    "MultilayerPerceptron",
    "MultilayerPerceptron_",
    "Multiplexer",
    "Multiplexer_",
    "ObservabilityMatrix",
    "PassThrough",
    "PassThrough_",
    "PerceptronActivationType",
    "PortSwitch",
    "PortSwitch_",
    "RandomSource",
    "ReadLogs",
    "Saturation",
    "Saturation_",
    "Selector",
    "SelectorParams",
    "Selector_",
    "SharedPointerSystem",
    "SharedPointerSystem_",
    "Sine",
    "Sine_",
    "SparseMatrixGain",
    "SparseMatrixGain_",
    "StateInterpolatorWithDiscreteDerivative",
    "StateInterpolatorWithDiscreteDerivative_",
    "StreamLogs",
    "SymbolicVectorSystem",
    "SymbolicVectorSystem_",
    "TrajectoryAffineSystem",
    "TrajectoryAffineSystem_",
    "TrajectoryLinearSystem",
    "TrajectoryLinearSystem_",
    "TrajectorySource",
    "TrajectorySource_",
    "VectorLog",
    "VectorLogSink",
    "VectorLogSink_",
    "VectorLog_",
    "WrapToSystem",
    "WrapToSystem_",
    "ZeroOrderHold",
    "ZeroOrderHold_",
]

show_as_own(globals())
