"""Error-controlled simulation of contact: a convex problem a step, of steps as long as the accuracy allows."""

from sheldrake.systems.framework._templates import SystemTemplate

from ._cenic_integrator import CenicIntegrator

CenicIntegrator_ = SystemTemplate("CenicIntegrator_", CenicIntegrator, scope=__name__)

__all__ = ["CenicIntegrator", "CenicIntegrator_"]
