"""Every public name of the modules of `sheldrake.multibody`.

Made by tools/make_stubs.py.
"""

from typing import Any

from sheldrake.multibody.benchmarks import *
from sheldrake.multibody.benchmarks.acrobot import *
from sheldrake.multibody.cenic import *
from sheldrake.multibody.contact_solvers import *
from sheldrake.multibody.inverse_kinematics import *
from sheldrake.multibody.math import *
from sheldrake.multibody.meshcat import *
from sheldrake.multibody.optimization import *
from sheldrake.multibody.parsing import *
from sheldrake.multibody.plant import *
from sheldrake.multibody.rational import *
from sheldrake.multibody.tree import *

BodyFrame_: Any
ContactResultsToMeshcat = ContactVisualizer
ContactResultsToMeshcatParams = ContactVisualizerParams
GetScopedFrameName: Any
MinimumDistanceConstraint: Any
