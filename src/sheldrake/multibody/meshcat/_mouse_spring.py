"""MeshcatMouseSpring: bodies of a plant are pulled by the mouse."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Meshcat
from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.multibody.math import SpatialForce_, SpatialVelocity_
from sheldrake.multibody.meshcat._kernels.mouse_spring import Hold, add_spring_force
from sheldrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from sheldrake.multibody.tree import BodyIndex
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.framework._declarations import FedStage
from sheldrake.systems.framework._port_getters import input_port, output_port

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.memory import RootView

DEFAULT_STIFFNESS = 100.0  # of a spring, by the mass that it pulls [1/s²]; Drake's


class MeshcatMouseSpring(LeafSystem):
    """Pulls the body that a person holds in the page: Ctrl and the left mouse button on it, and drag.

    A spring and a damper lead from the point Q that is held to the point T under the mouse:

        f_Q = m (k (p_WT - p_WQ) - √k v_WQ)

    with the stiffness k, whatever the mass m: the body and all that hangs on it follow with the same frequency √k and
    half of critical damping. Q stays where the body was taken hold of. Without a page it is the force of nothing, and
    costs nothing: the step remains machine code.

    Ports: inputs "body_poses" and "body_spatial_velocities" of the plant, output "spatial_forces" for its port
    "applied_spatial_force". As long as something is held, what is simulated depends on the hand, and no two runs are
    equal.

    Args:
        meshcat: Where the bodies are shown, by a MeshcatVisualizer.
        plant: The finalized plant, registered as a source of geometry.
        stiffness: k [1/s²].

    Raises:
        RuntimeError: when the plant is not finalized or has no SceneGraph, or the stiffness is negative.
    """

    def __init__(self, meshcat: Meshcat, plant: MultibodyPlant, stiffness: float = DEFAULT_STIFFNESS):
        super().__init__()
        if not plant.is_finalized():
            raise RuntimeError("MeshcatMouseSpring(): call plant.Finalize() first.")
        if not plant.geometry_source_is_registered():
            raise RuntimeError("MeshcatMouseSpring(): the plant shows nothing: it has no SceneGraph.")
        if not (stiffness >= 0.0 and math.isfinite(stiffness)):
            raise RuntimeError(f"MeshcatMouseSpring(): stiffness must be at least 0, got {stiffness} 1/s².")
        self._grabs, self._plant, self._stiffness = meshcat._grabs, plant, float(stiffness)
        self._bodies = _bodies_by_path(plant)
        self._masses = _masses_carried(plant)
        self._hold = Hold(np.zeros((1, 8)), np.zeros(1, np.int64))
        self._row_of: list[int] = plant._parts.elements.model("MeshcatMouseSpring").row_list
        self._index = BodyIndex(0)
        self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform_[float]()]))
        velocity = SpatialVelocity_[float](np.zeros(6))
        self.DeclareAbstractInputPort("body_spatial_velocities", AbstractValue.Make([velocity]))
        self.DeclareAbstractOutputPort(
            "spatial_forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc
        ).disable_caching_by_default()
        self._offer = self._grabs.offer(self._bodies, self._follow)

    def Enable(self, enabled: bool = True) -> None:
        """Lets pages pull bodies, or no longer; at first they may."""
        if not enabled:
            self._grabs.withdraw(self._offer)
            self._hold.body[0] = 0
        else:
            self._grabs.withdraw(self._offer)
            self._offer = self._grabs.offer(self._bodies, self._follow)

    get_body_poses_input_port = input_port(0, "Input: poses of the plant's bodies.")
    get_body_spatial_velocities_input_port = input_port(1, "Input: spatial velocities of the plant's bodies.")
    get_spatial_forces_output_port = output_port(
        0, "Output: a list with the ExternallyAppliedSpatialForce of the spring, empty while nothing is held."
    )

    @staticmethod
    def AddToBuilder(
        builder: DiagramBuilder, plant: MultibodyPlant, meshcat: Meshcat, stiffness: float = DEFAULT_STIFFNESS
    ) -> MeshcatMouseSpring:
        """Adds a spring to a diagram and connects it with a plant.

        Args:
            builder: The diagram in the making, with the plant, whose port "applied_spatial_force" is free.
            plant: The finalized plant.
            meshcat: Where its bodies are shown.
            stiffness: By the mass that is pulled [1/s²].

        Raises:
            RuntimeError: as the constructor, and when the port is taken.
        """
        spring = builder.AddNamedSystem("meshcat_mouse_spring", MeshcatMouseSpring(meshcat, plant, stiffness))
        builder.Connect(plant.get_body_poses_output_port(), spring.get_body_poses_input_port())
        velocities = plant.get_body_spatial_velocities_output_port()
        builder.Connect(velocities, spring.get_body_spatial_velocities_input_port())
        builder.Connect(spring.get_spatial_forces_output_port(), plant.get_applied_spatial_force_input_port())
        return spring

    def _follow(self) -> None:
        """Writes down what the mouse does, in the page's thread, for the simulation's.

        A step may run meanwhile: so nothing is held while the numbers of another body are written, and a step that
        reads half of a new place under the mouse pulls to a point between both.
        """
        held = self._grabs.held()
        if held is None:
            self._hold.body[0] = 0
            return
        name, p_BQ, p_WT = held
        index, spring = self._bodies[name], self._hold.spring[0]
        row = self._row_of[int(index)]
        if self._hold.body[0] != row:
            self._hold.body[0] = 0
        mass = self._masses[int(index)]
        spring[:3], spring[3:6] = p_BQ, p_WT
        spring[6:] = mass * self._stiffness, mass * math.sqrt(self._stiffness)
        self._index = index
        self._hold.body[0] = row

    def _native_forces(self, plant: MultibodyPlant, rows_of: list[int], root: RootView) -> list[FedStage] | None:
        """The same as a stage of the plant that it pulls; None if it pulls another.

        Args:
            plant: The plant.
            rows_of: The row of each body.
            root: As in `_kernel_models`.
        """
        if plant is not self._plant or rows_of != self._row_of:
            return None
        return [FedStage(add_spring_force, {}, {"hold_model": self._hold})]

    def _calc(self, context: Context, value: AbstractValue) -> None:
        if self._hold.body[0] == 0:
            value._held = []
            return
        system, index = context._system, int(self._index)
        X_WB: RigidTransform = system.get_input_port(0).Eval(context)[index]
        V_WB = system.get_input_port(1).Eval(context)[index]
        spring = self._hold.spring[0].copy()
        p_BQ_W = X_WB.rotation().matrix() @ spring[:3]
        v_WQ = V_WB.translational() + np.cross(V_WB.rotational(), p_BQ_W)
        force = ExternallyAppliedSpatialForce()
        force.body_index, force.p_BoBq_B = self._index, spring[:3]
        pull = spring[6] * (spring[3:6] - X_WB.translation() - p_BQ_W) - spring[7] * v_WQ
        force.F_Bq_W = SpatialForce_[float](np.zeros(3), pull)
        value._held = [force]


def _bodies_by_path(plant: MultibodyPlant) -> dict[str, BodyIndex]:
    """All bodies but the world, by the end of the path at which a MeshcatVisualizer shows them."""
    scene_graph: Any = plant._parts.geometry.scene_graph
    inspector = scene_graph.model_inspector()
    found = {}
    for index in map(BodyIndex, range(1, plant.num_bodies())):
        frame = plant.GetBodyFrameIdIfExists(index)
        if frame is not None:
            found[inspector.GetName(frame).replace("::", "/")] = index
    return found


def _masses_carried(plant: MultibodyPlant) -> list[float]:
    """The mass of each body with all bodies that joints and welds hang on it [kg]."""
    masses = [plant.get_body(BodyIndex(i)).default_mass() for i in range(plant.num_bodies())]
    parents = {}
    for joint in map(plant.get_joint, plant.GetJointIndices()):
        parents[int(joint.child_body().index())] = int(joint.parent_body().index())
    carried = list(masses)
    for body, mass in enumerate(masses):
        seen, above = {body}, parents.get(body)
        while above is not None and above not in seen:
            carried[above] += mass
            seen.add(above)
            above = parents.get(above)
    return carried
