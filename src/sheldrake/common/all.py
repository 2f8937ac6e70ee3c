"""All public names of `sheldrake.common` and its modules in one."""

from sheldrake import common
from sheldrake.common import compatibility, containers, eigen_geometry, schema, value, yaml

__all__: list[str] = []
for _module in (common, compatibility, containers, eigen_geometry, schema, yaml, value):
    for _name in _module.__all__:
        globals()[_name] = getattr(_module, _name)
        __all__ += [] if _name in __all__ else [_name]
