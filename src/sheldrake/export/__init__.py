"""Diagrams that leave Python: as a file, a page that simulates, a C library, an FMU; and FMUs of others."""

from sheldrake.common._names import show_as_own
from sheldrake.export._c import SaveC
from sheldrake.export._fmu import SaveFmu
from sheldrake.export._fmu_system import FmuSystem
from sheldrake.export._freeze import Freeze
from sheldrake.export._frozen import FrozenDiagram, LoadFrozen
from sheldrake.export._page import NotebookPage, PageSlider, SavePage, ShowPage
from sheldrake.export._simulation import FrozenSimulation

__all__ = [
    "FmuSystem",
    "Freeze",
    "FrozenDiagram",
    "FrozenSimulation",
    "LoadFrozen",
    "NotebookPage",
    "PageSlider",
    "SaveC",
    "SaveFmu",
    "SavePage",
    "ShowPage",
]

show_as_own(globals())
