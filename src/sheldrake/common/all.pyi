"""All public names of `sheldrake.common` and its modules in one.

Made by tools/make_stubs.py.
"""

from typing import Any

from sheldrake.common import (
    CalcProbabilityDensity as CalcProbabilityDensity,
    FindResourceOrThrow as FindResourceOrThrow,
    GetDrakePath as GetDrakePath,
    MemoryFile as MemoryFile,
    Parallelism as Parallelism,
    RandomDistribution as RandomDistribution,
    RandomGenerator as RandomGenerator,
    Sha256 as Sha256,
    ToleranceType as ToleranceType,
    configure_logging as configure_logging,
    kDrakeAssertIsArmed as kDrakeAssertIsArmed,
    pretty_class_name as pretty_class_name,
    set_log_level as set_log_level,
    temp_directory as temp_directory,
    trigger_an_assertion_failure as trigger_an_assertion_failure,
    use_native_cpp_logging as use_native_cpp_logging,
)
from sheldrake.common.compatibility import (
    maybe_patch_numpy_formatters as maybe_patch_numpy_formatters,
)
from sheldrake.common.containers import (
    EqualToDict as EqualToDict,
    NamedViewBase as NamedViewBase,
    namedview as namedview,
)
from sheldrake.common.eigen_geometry import (
    AngleAxis as AngleAxis,
    AngleAxis_ as AngleAxis_,
    Isometry3 as Isometry3,
    Isometry3_ as Isometry3_,
    Quaternion as Quaternion,
    Quaternion_ as Quaternion_,
)
from sheldrake.common.schema import (
    Deterministic as Deterministic,
    DeterministicVector as DeterministicVector,
    DeterministicVectorX as DeterministicVectorX,
    Distribution as Distribution,
    DistributionVector as DistributionVector,
    Gaussian as Gaussian,
    GaussianVector as GaussianVector,
    GaussianVectorX as GaussianVectorX,
    GetDeterministicValue as GetDeterministicValue,
    IsDeterministic as IsDeterministic,
    Mean as Mean,
    Rotation as Rotation,
    Sample as Sample,
    ToDistribution as ToDistribution,
    ToDistributionVector as ToDistributionVector,
    ToSymbolic as ToSymbolic,
    Transform as Transform,
    Uniform as Uniform,
    UniformDiscrete as UniformDiscrete,
    UniformVector as UniformVector,
    UniformVectorX as UniformVectorX,
)
from sheldrake.common.value import (
    AbstractValue as AbstractValue,
    Value as Value,
)
from sheldrake.common.yaml import (
    yaml_dump as yaml_dump,
    yaml_dump_typed as yaml_dump_typed,
    yaml_load as yaml_load,
    yaml_load_data as yaml_load_data,
    yaml_load_file as yaml_load_file,
    yaml_load_typed as yaml_load_typed,
)

