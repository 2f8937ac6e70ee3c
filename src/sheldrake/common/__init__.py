"""What everything else stands on: values, files in memory, random numbers, logging, and naming of templates."""

import importlib
from types import ModuleType

from sheldrake.common import (
    containers,
    cpp_param,
    cpp_template,
    deprecation,
    eigen_geometry,
    value,
)
from sheldrake.common._assert import ToleranceType, kDrakeAssertIsArmed, trigger_an_assertion_failure
from sheldrake.common._files import FindResourceOrThrow, GetDrakePath, MemoryFile, Sha256, temp_directory
from sheldrake.common._logging import configure_logging, set_log_level, use_native_cpp_logging
from sheldrake.common._names import _MangledName, pretty_class_name, show_as_own
from sheldrake.common._parallelism import Parallelism
from sheldrake.common._random import CalcProbabilityDensity, RandomDistribution, RandomGenerator

__all__ = [
    "CalcProbabilityDensity",
    "FindResourceOrThrow",
    "GetDrakePath",
    "MemoryFile",
    "Parallelism",
    "RandomDistribution",
    "RandomGenerator",
    "Sha256",
    "ToleranceType",
    "configure_logging",
    "kDrakeAssertIsArmed",
    "pretty_class_name",
    "set_log_level",
    "temp_directory",
    "trigger_an_assertion_failure",
    "use_native_cpp_logging",
]

show_as_own(globals())


def __getattr__(name: str) -> ModuleType:
    if name in ("compatibility", "schema", "yaml"):  # imported when first used: start-up stays quick
        return importlib.import_module(f"sheldrake.common.{name}")
    raise AttributeError(f"module 'sheldrake.common' has no attribute {name!r}")
