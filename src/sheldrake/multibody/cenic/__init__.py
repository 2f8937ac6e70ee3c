"""Error-controlled simulation of contact: a convex problem a step, of steps as long as the accuracy allows."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.framework._templates import SystemTemplate

from ._cenic_integrator import CenicIntegrator

CenicIntegrator_ = SystemTemplate("CenicIntegrator_", CenicIntegrator, scope=__name__)

__all__ = ["CenicIntegrator", "CenicIntegrator_"]

show_as_own(globals())
