"""hatchling's build backend, plus what compiling the kernels needs when a wheel is built.

An editable install builds no library, so it does not have to wait for a compiler to be downloaded.
"""

import os

from hatchling.build import *  # noqa: F403
from hatchling.build import get_requires_for_build_wheel as _hatchling_requires

COMPILER = [
    "numpy>=1.26",  # kernels are read by importing them
    # llvmlite has no wheels for Intel Macs any more: a wheel built there is plain.
    "llvmlite>=0.46; sys_platform != 'darwin' or platform_machine == 'arm64'",
    "ziglang>=0.13",
]


def get_requires_for_build_wheel(config_settings=None):
    """What must be there to build a wheel."""
    plain = os.environ.get("SHELDRAKE_NO_PREBUILT")
    return [*_hatchling_requires(config_settings), *([] if plain else COMPILER)]
