"""All public names of `sheldrake.common` and its modules in one.

Made by tools/make_stubs.py.
"""

from typing import Any

from sheldrake.common import *
from sheldrake.common.compatibility import *
from sheldrake.common.containers import *
from sheldrake.common.eigen_geometry import *
from sheldrake.common.schema import *
from sheldrake.common.value import *
from sheldrake.common.yaml import *

