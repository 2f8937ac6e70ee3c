"""A plant in the viewer: contact forces as arrows, joints as sliders, bodies pulled by the mouse."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.framework import LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate

from ._contact_visualizer import ContactVisualizer
from ._contact_visualizer_params import ContactVisualizerParams
from ._hydroelastic_arrows import _HydroelasticContactVisualizer, _HydroelasticContactVisualizerItem
from ._joint_sliders import JointSliders
from ._mouse_spring import MeshcatMouseSpring
from ._point_contact_arrows import _PointContactVisualizer, _PointContactVisualizerItem

ContactVisualizer_ = SystemTemplate("ContactVisualizer_", ContactVisualizer, scope=__name__, own=True, base=LeafSystem_)
JointSliders_ = SystemTemplate("JointSliders_", JointSliders, scope=__name__, own=True, base=LeafSystem_)

__all__ = [
    "ContactVisualizer",
    "ContactVisualizerParams",
    "ContactVisualizer_",
    "JointSliders",
    "JointSliders_",
    "MeshcatMouseSpring",
]

show_as_own(globals())
