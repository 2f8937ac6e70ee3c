"""Robot descriptions (URDF, SDFormat, MJCF, model directives) to a MultibodyPlant."""

from ._collision_filter_groups import CollisionFilterGroups
from ._diagnostics import DiagnosticDetail, DiagnosticPolicy, Location, ParseError
from ._package_map import PackageMap
from ._parser import Parser

__all__ = [
    "CollisionFilterGroups",
    "DiagnosticDetail",
    "DiagnosticPolicy",
    "Location",
    "PackageMap",
    "ParseError",
    "Parser",
]
