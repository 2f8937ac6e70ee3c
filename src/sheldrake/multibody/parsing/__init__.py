"""Robot descriptions (URDF, SDFormat, MJCF, model directives) to a MultibodyPlant."""

from ._diagnostics import DiagnosticDetail, DiagnosticPolicy, Location, ParseError
from ._package_map import PackageMap

__all__ = ["DiagnosticDetail", "DiagnosticPolicy", "Location", "PackageMap", "ParseError"]
