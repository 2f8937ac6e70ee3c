"""Every public name of the modules of `sheldrake.systems`.

Made by tools/make_stubs.py.
"""

from typing import Any

from sheldrake._pydrake.retired.poses import *
from sheldrake.common.value import *
from sheldrake.systems.analysis import *
from sheldrake.systems.controllers import *
from sheldrake.systems.drawing import *
from sheldrake.systems.estimators import *
from sheldrake.systems.framework import *
from sheldrake.systems.lcm import *
from sheldrake.systems.perception import *
from sheldrake.systems.planar_scenegraph_visualizer import *
from sheldrake.systems.primitives import *
from sheldrake.systems.pyplot_visualizer import *
from sheldrake.systems.rendering import *
from sheldrake.systems.scalar_conversion import *
from sheldrake.systems.sensors import *

GenerateHtml: Any
LogOutput: Any
SignalLogger: Any
