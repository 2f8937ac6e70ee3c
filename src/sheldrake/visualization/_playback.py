"""Models that fall, swing and are pulled, in the page of a ModelVisualizer: play, pause, reset."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.geometry import (
    AddContactMaterial,
    CollisionFilterDeclaration,
    CollisionFilterManager,
    FilterId,
    GeometrySet,
    HalfSpace,
    Meshcat,
    ProximityProperties,
    SceneGraph,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.meshcat import MeshcatMouseSpring
from sheldrake.multibody.plant import CoulombFriction, MultibodyPlant
from sheldrake.systems.analysis import InitializeParams, Simulator
from sheldrake.systems.framework import Diagram

if TYPE_CHECKING:
    from sheldrake.geometry._query.query_object import QueryObject
    from sheldrake.systems.framework import Context

PLAY_BUTTON, RESET_BUTTON = "Play / Pause", "Reset"
PLAY_KEY = "KeyP"
GROUND = "ground of the viewer"
_MOST = 0.1  # simulated in one go, at most [s]: what takes longer runs slower than real time


def add_ground(plant: MultibodyPlant) -> None:
    """Adds ground at z = 0 to a plant in the making, which nothing shows but the page's grid."""
    properties = ProximityProperties()
    AddContactMaterial(friction=CoulombFriction(0.8, 0.8), properties=properties)
    properties.AddProperty("meshcat", "accepting", GROUND)  # the name of no visualizer
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), GROUND, properties)


class Playback:
    """Simulates what the page shows, in real time, between looks at its controls.

    What overlaps when it starts, but for the ground, does not collide: links of many robots do, and would be thrown
    apart.

    Args:
        meshcat: The page, which gets the buttons.
        diagram: What is shown.
        context: Its context.
        plant: The plant in it.
        scene_graph: The scene graph in it.
        spring: What pulls bodies to the mouse while it plays.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        diagram: Diagram,
        context: Context,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        spring: MeshcatMouseSpring,
    ):
        self._meshcat, self._diagram, self._context = meshcat, diagram, context
        self._plant, self._scene_graph, self._spring = plant, scene_graph, spring
        self._own = plant.GetMyMutableContextFromRoot(context)
        self._simulator: Simulator | None = None
        self._start: np.ndarray | None = None
        self._filter: tuple[CollisionFilterManager, FilterId] | None = None
        self._seen = 0.0
        self.is_playing = False
        spring.Enable(False)

    def add_buttons(self) -> None:
        """Shows the buttons."""
        self._meshcat.AddButton(PLAY_BUTTON, PLAY_KEY)
        self._meshcat.AddButton(RESET_BUTTON)

    def play(self, q: np.ndarray | None) -> None:
        """Starts, or goes on.

        Args:
            q: Positions to start from at rest [m or rad], shape (nq,); None goes on with the motion that was paused.
        """
        if q is not None or self._simulator is None:
            self._rest_at(self._plant.GetPositions(self._own) if q is None else q)
            self._start = self._plant.GetPositions(self._own)
            self._let_overlaps_be()
            self._simulator = Simulator(self._diagram, self._context)
            # Initialization would clear the page.
            self._simulator.Initialize(InitializeParams(suppress_initialization_events=True))
            self._simulator.AdvanceTo(self._context.get_time() + self._plant.time_step())  # compiles, out of the clock
        self._spring.Enable()
        self.is_playing, self._seen = True, time.monotonic()

    def pause(self) -> np.ndarray:
        """Stops, and returns the positions then [m or rad], shape (nq,)."""
        self._spring.Enable(False)
        self.is_playing = False
        return self._plant.GetPositions(self._own)

    def reset(self) -> np.ndarray | None:
        """Stops, and goes back to where it started; returns these positions, None if it never did."""
        self.pause()
        self._simulator = None
        if self._filter is not None:
            manager, number = self._filter
            manager.RemoveDeclaration(number)
            self._filter = None
        if self._start is not None:
            self._context.SetTime(0.0)
            self._rest_at(self._start)
        return self._start

    def advance(self) -> None:
        """Simulates as much as time has passed since the last look.

        Raises:
            RuntimeError: when the model cannot be simulated any further.
        """
        now = time.monotonic()
        passed, self._seen = min(now - self._seen, _MOST), now
        if self._simulator is not None:
            self._simulator.AdvanceTo(self._context.get_time() + passed)

    def _rest_at(self, q: np.ndarray) -> None:
        self._plant.SetPositions(self._own, q)
        self._plant.SetVelocities(self._own, np.zeros(self._plant.num_velocities()))

    def _let_overlaps_be(self) -> None:
        if self._filter is not None:
            return
        context = self._scene_graph.GetMyMutableContextFromRoot(self._context)
        query: QueryObject = self._scene_graph.get_query_output_port().Eval(context)
        inspector = query.inspector()
        declaration, found = CollisionFilterDeclaration(), False
        for pair in query.ComputePointPairPenetration():
            if not any(inspector.GetName(g).endswith(GROUND) for g in (pair.id_A, pair.id_B)):
                declaration.ExcludeBetween(GeometrySet([pair.id_A]), GeometrySet([pair.id_B]))
                found = True
        if found:
            manager = self._scene_graph.collision_filter_manager(context)
            self._filter = manager, manager.ApplyTransient(declaration)
