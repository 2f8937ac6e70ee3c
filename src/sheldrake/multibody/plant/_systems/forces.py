"""Systems that make forces for a plant's applied_spatial_force port: propellers, wings, and a multiplexer of lists."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.multibody.math import SpatialForce, SpatialForce_, SpatialVelocity_
from sheldrake.multibody.plant._kernels.applied_forces import (
    Propellers,
    Wings,
    add_propeller_forces,
    add_wing_force,
)
from sheldrake.multibody.plant._step.applied_forces import stages_that_feed
from sheldrake.multibody.plant._step.external_force import ExternallyAppliedSpatialForce
from sheldrake.multibody.tree import BodyIndex
from sheldrake.systems.framework import BasicVector, Context, LeafSystem, OutputPort
from sheldrake.systems.framework._declarations import FedStage
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.framework._templates import on_scalar_of

if TYPE_CHECKING:
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder
    from sheldrake.systems.framework._engine.memory import RootView


def _forces() -> AbstractValue:
    return AbstractValue.Make([ExternallyAppliedSpatialForce()])


def _applied(body: BodyIndex, point: np.ndarray, F_Bq_W: SpatialForce) -> ExternallyAppliedSpatialForce:
    force = object.__new__(ExternallyAppliedSpatialForce)
    force._body_index, force._p_BoBq_B, force.F_Bq_W = body, point, F_Bq_W
    return force


def _shows(root: RootView, i: int, plant: MultibodyPlant, port: OutputPort) -> bool:
    """Whether input port `i` shows this port of this plant."""
    return root.source(i) == (plant, int(port.get_index()))


class ExternallyAppliedSpatialForceMultiplexer(LeafSystem):
    """Joins lists of forces.

    Args:
        num_inputs: How many lists.
    """

    _generic = True

    def __init__(self, num_inputs: int):
        super().__init__()
        for i in range(num_inputs):
            self.DeclareAbstractInputPort(f"u{i}", _forces())
        self.DeclareAbstractOutputPort("y0", _forces, self._join)

    def _native_forces(self, plant: MultibodyPlant, rows_of: list[int], root: RootView) -> list[FedStage] | None:
        """The stages of all that feed it; None if one of them has none for this plant."""
        found: list[FedStage] = []
        for i in range(self.num_input_ports()):
            stages = stages_that_feed(plant, rows_of, root, i)
            if stages is None:
                return None
            found += stages
        return found

    def _join(self, context: Context, value: AbstractValue) -> None:
        system = context._system
        lists = (system.get_input_port(i).Eval(context) for i in range(self.num_input_ports()))
        value.set_value([force for one in lists for force in one])


class PropellerInfo:
    """One propeller: its body B, where its frame P is on it, and its forces per command."""

    @checked
    def __init__(
        self,
        body_index: BodyIndex,
        X_BP: RigidTransform | None = None,
        thrust_ratio: float = 1.0,
        moment_ratio: float = 0.0,
    ):
        """
        Args:
            body_index: B.
            X_BP: P, whose z axis is the propeller's; B itself when left out.
            thrust_ratio: Force along z per command [N].
            moment_ratio: Moment about z per command [N m].
        """
        self.body_index, self.X_BP = body_index, RigidTransform() if X_BP is None else X_BP
        self.thrust_ratio, self.moment_ratio = float(thrust_ratio), float(moment_ratio)

    def __copy__(self) -> PropellerInfo:
        return PropellerInfo(self.body_index, self.X_BP, self.thrust_ratio, self.moment_ratio)

    def __deepcopy__(self, memo: dict) -> PropellerInfo:
        return self.__copy__()


class Propeller(LeafSystem):
    """Forces of propellers on a plant's bodies.

    `Propeller(body_index, X_BP, thrust_ratio, moment_ratio)` has one, `Propeller(propeller_info)` a list of them.
    """

    _generic = True

    @checked
    def __init__(
        self,
        body_index: Any = None,
        X_BP: RigidTransform | None = None,
        thrust_ratio: float = 1.0,
        moment_ratio: float = 0.0,
        *,
        propeller_info: list[PropellerInfo] | None = None,
    ):
        super().__init__()
        if propeller_info is None and isinstance(body_index, (list, tuple)):
            propeller_info = list(body_index)
        if propeller_info is None:
            propeller_info = [PropellerInfo(body_index, X_BP, thrust_ratio, moment_ratio)]
        self._info = list(propeller_info)
        self._indices = [info.body_index for info in self._info]
        self._bodies = list(map(int, self._indices))
        self._z_B = np.array([info.X_BP.rotation().matrix()[:, 2:] for info in self._info]).reshape(-1, 3, 1)
        ratios = [np.repeat([info.moment_ratio, info.thrust_ratio], 3) for info in self._info]
        self._ratios = np.array(ratios).reshape(-1, 6).T  # of each component, by propeller
        self._points = [np.array(info.X_BP.translation()) for info in self._info]
        for point in self._points:
            point.flags.writeable = False  # shared by the forces of all evaluations
        self.DeclareVectorInputPort("command", len(self._info))
        self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform_[float]()]))
        self.DeclareAbstractOutputPort("spatial_forces", _forces, self._calc)

    def num_propellers(self) -> int:
        """Number of propellers."""
        return len(self._info)

    get_command_input_port = input_port(0, "Input: one command a propeller.")
    get_body_poses_input_port = input_port(1, "Input: poses of the plant's bodies.")
    get_spatial_forces_output_port = output_port(0, "Output: a list of ExternallyAppliedSpatialForce.")

    def _native_forces(self, plant: MultibodyPlant, rows_of: list[int], root: RootView) -> list[FedStage] | None:
        """The same as a stage of the plant that it feeds; None if it is not fed by that plant.

        Args:
            plant: The plant.
            rows_of: The row of each body.
            root: As in `_kernel_models`.
        """
        if not _shows(root, 1, plant, plant.get_body_poses_output_port()):
            return None
        rows = [rows_of[body] for body in self._bodies]
        z_B, ratios = self._z_B[:, :, 0], self._ratios.T[:, [3, 0]]
        numbers = np.concatenate([np.array(self._points).reshape(-1, 3), z_B, ratios], axis=1)
        model = Propellers(np.ascontiguousarray(numbers), np.array(rows, np.int64))
        return [FedStage(add_propeller_forces, {"command": root.slot(0)}, {"propeller_model": model})]

    def _calc(self, context: Context, value: AbstractValue) -> None:
        system = context._system
        command, poses = system.get_input_port(0).Eval(context), system.get_input_port(1).Eval(context)
        R_WB = np.array([poses[body]._R._M for body in self._bodies])
        z_W = (R_WB @ self._z_B)[:, :, 0]
        F_Bq_W = map(SpatialForce_[system._scalar]._make, np.concatenate((z_W, z_W), 1) * (command * self._ratios).T)
        value._held = list(map(_applied, self._indices, self._points, F_Bq_W))


@checked
class Wing(LeafSystem):
    """Lift and drag of a flat plate, c_L = 2 sin a cos a and c_D = 2 sin² a, on a body of a plant.

    The wing's frame has its origin at the aerodynamic centre, x forward along the chord, y along the span, z up.
    """

    _generic = True

    def __init__(
        self,
        body_index: BodyIndex,
        surface_area: float,
        X_BodyWing: RigidTransform | None = None,
        fluid_density: float = 1.204,
    ):
        """
        Args:
            body_index: The body.
            surface_area: [m²].
            X_BodyWing: The wing's frame on the body; the body's when left out.
            fluid_density: [kg/m³], when its port is not connected.
        """
        super().__init__()
        self._body, self._area, self._density = body_index, float(surface_area), float(fluid_density)
        self._X_BWing = RigidTransform() if X_BodyWing is None else X_BodyWing
        self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform_[float]()]))
        self.DeclareAbstractInputPort(
            "body_spatial_velocities", AbstractValue.Make([SpatialVelocity_[float](np.zeros(6))])
        )
        self.DeclareVectorInputPort("wind_velocity_at_aerodynamic_center", 3)
        self.DeclareVectorInputPort("fluid_density", BasicVector([self._density]))
        for optional in self._inputs[2:]:
            optional.optional = True
        self.DeclareAbstractOutputPort("spatial_force", _forces, self._calc_force)
        poses = {self.input_port_ticket(0)}
        self.DeclareVectorOutputPort("aerodynamic_center", 3, self._calc_center, poses)

    get_body_poses_input_port = input_port(0, "Input: poses of the plant's bodies.")
    get_body_spatial_velocities_input_port = input_port(1, "Input: spatial velocities of the plant's bodies.")
    get_wind_velocity_input_port = input_port(
        2, "Input: velocity of the air at the aerodynamic centre, in W [m/s]; still air when not connected."
    )
    get_fluid_density_input_port = input_port(
        3, "Input: density of the air [kg/m³]; the constructor's when not connected."
    )
    get_spatial_force_output_port = output_port(0, "Output: a list with one ExternallyAppliedSpatialForce.")
    get_aerodynamic_center_output_port = output_port(1, "Output: the aerodynamic centre, in W [m].")

    def _native_forces(self, plant: MultibodyPlant, rows_of: list[int], root: RootView) -> list[FedStage] | None:
        """The same as a stage of the plant that it feeds; None if it is not fed by that plant.

        Args:
            plant: The plant.
            rows_of: The row of each body.
            root: As in `_kernel_models`.
        """
        ports = plant.get_body_poses_output_port(), plant.get_body_spatial_velocities_output_port()
        if not all(_shows(root, i, plant, port) for i, port in enumerate(ports)):
            return None
        if root.is_exported(3):  # wings with other densities of their own may have the same port of a diagram
            return None
        R_BWing, p_BWing = self._X_BWing.rotation().matrix(), self._X_BWing.translation()
        numbers = np.concatenate([p_BWing, R_BWing[:, 0], R_BWing[:, 2], [self._area]])
        model = Wings(numbers[None], np.array([rows_of[int(self._body)]], np.int64))
        return [FedStage(add_wing_force, {"wind": root.slot(2), "density": root.slot(3)}, {"wing_model": model})]

    def _calc_force(self, context: Context, value: AbstractValue) -> None:
        system = context._system
        wind_port, density_port = system.get_input_port(2), system.get_input_port(3)
        X_WB = system.get_input_port(0).Eval(context)[int(self._body)]
        V_WB = system.get_input_port(1).Eval(context)[int(self._body)]
        wind = wind_port.Eval(context) if wind_port.HasValue(context) else np.zeros(3)
        density = density_port.Eval(context)[0] if density_port.HasValue(context) else self._density
        R_WB = X_WB.rotation().matrix()
        R_WWing = R_WB @ self._X_BWing.rotation().matrix()
        # As Drake has it, the wing moves like the body's origin: how the body turns makes no wind.
        air = R_WWing.T @ (wind - V_WB.translational())
        # With these coefficients lift and drag add up to a force along z: 2 sin a, times the dynamic pressure.
        squared = air[0] * air[0] + air[2] * air[2]
        force = density * self._area * squared**0.5 * air[2] if squared > 0 else 0.0 * squared
        F = SpatialForce_[system._scalar](np.zeros(3), R_WWing[:, 2] * force)
        value._held = [_applied(self._body, self._X_BWing.translation(), F)]

    def _calc_center(self, context: Context, vector: BasicVector) -> None:
        X_WB = context._system.get_input_port(0).Eval(context)[int(self._body)]
        vector.SetFromVector(X_WB @ self._X_BWing.translation())

    @staticmethod
    def AddToBuilder(
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        body_index: BodyIndex,
        surface_area: float,
        X_BodyWing: RigidTransform | None = None,
        fluid_density: float = 1.204,
    ) -> Wing:
        """Adds a wing to a diagram and connects it with a plant."""
        wing = builder.AddSystem(on_scalar_of(builder, Wing)(body_index, surface_area, X_BodyWing, fluid_density))
        builder.Connect(plant.get_body_poses_output_port(), wing.get_body_poses_input_port())
        builder.Connect(plant.get_body_spatial_velocities_output_port(), wing.get_body_spatial_velocities_input_port())
        builder.Connect(wing.get_spatial_force_output_port(), plant.get_applied_spatial_force_input_port())
        return wing
