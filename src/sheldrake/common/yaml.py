"""Loading and saving YAML, plain or against a schema of dataclasses."""

from sheldrake.common._yaml_dump import yaml_dump, yaml_dump_typed
from sheldrake.common._yaml_load import yaml_load, yaml_load_data, yaml_load_file, yaml_load_typed

__all__ = [
    "yaml_dump",
    "yaml_dump_typed",
    "yaml_load",
    "yaml_load_data",
    "yaml_load_file",
    "yaml_load_typed",
]
