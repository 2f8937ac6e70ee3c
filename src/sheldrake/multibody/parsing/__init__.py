"""Robot descriptions (URDF, SDFormat, MJCF, model directives) to a MultibodyPlant."""

from sheldrake.common._names import show_as_own

from ._collision_filter_groups import CollisionFilterGroups
from ._directives.directives import (
    AddCollisionFilterGroup,
    AddDirectives,
    AddFrame,
    AddModel,
    AddModelInstance,
    AddWeld,
    LoadModelDirectives,
    LoadModelDirectivesFromString,
    ModelDirective,
    ModelDirectives,
)
from ._directives.process import FlattenModelDirectives, ModelInstanceInfo
from ._files.diagnostics import DiagnosticPolicy, ParseError
from ._files.package_map import PackageMap
from ._parser import Parser
from ._process_model_directives import ProcessModelDirectives
from ._scoped_names import GetScopedFrameByName, GetScopedFrameByNameMaybe

__all__ = [
    "AddCollisionFilterGroup",
    "AddDirectives",
    "AddFrame",
    "AddModel",
    "AddModelInstance",
    "AddWeld",
    "CollisionFilterGroups",
    "DiagnosticPolicy",
    "FlattenModelDirectives",
    "GetScopedFrameByName",
    "GetScopedFrameByNameMaybe",
    "LoadModelDirectives",
    "LoadModelDirectivesFromString",
    "ModelDirective",
    "ModelDirectives",
    "ModelInstanceInfo",
    "PackageMap",
    "ParseError",
    "Parser",
    "ProcessModelDirectives",
]

show_as_own(globals())
