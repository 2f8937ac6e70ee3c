"""Draws a plant at given positions, without simulating it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import FramePoseVector
from sheldrake.systems.framework import LeafSystem

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.systems.framework import Context


class MultibodyPositionToGeometryPose(LeafSystem):
    """Computes the poses of a plant's bodies for a SceneGraph from the plant's positions.

    Ports: input "position", output "geometry_pose".

    Args:
        plant: A MultibodyPlant that is finalized and registered with a SceneGraph.
        input_multibody_state: Whether the input is positions and velocities, of which only the first count.

    Raises:
        RuntimeError: The plant is not finalized or knows no SceneGraph.
    """

    @checked
    def __init__(self, plant: MultibodyPlant, input_multibody_state: bool = False):
        super().__init__()
        if not plant.is_finalized():
            raise RuntimeError("MultibodyPositionToGeometryPose(): the plant must be finalized first.")
        if not plant.geometry_source_is_registered():
            raise RuntimeError(
                "MultibodyPositionToGeometryPose(): the plant must be registered with a SceneGraph first, for instance "
                "by AddMultibodyPlantSceneGraph()."
            )
        self._plant, self._context = plant, plant.CreateDefaultContext()
        size = plant.num_multibody_states() if input_multibody_state else plant.num_positions()
        self.DeclareVectorInputPort("position", size)
        self.DeclareAbstractOutputPort("geometry_pose", lambda: AbstractValue.Make(FramePoseVector()), self._calc)

    def multibody_plant(self) -> MultibodyPlant:
        """The plant."""
        return self._plant

    def _calc(self, context: Context, output: Any) -> None:
        u = self.get_input_port(0).Eval(context)
        self._plant.SetPositions(self._context, u[: self._plant.num_positions()])
        output.set_value(self._plant.get_geometry_pose_output_port().Eval(self._context))
