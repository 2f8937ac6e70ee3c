"""An arm throws a ball: a spline is followed by a controller of the library, the hold is a spring in Python."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AbstractValue,
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    ExternallyAppliedSpatialForce,
    InverseDynamicsController,
    LeafSystem,
    MultibodyPlant,
    Parser,
    PiecewisePolynomial,
    RigidTransform,
    Simulator,
    SpatialForce,
    SpatialVelocity,
    TrajectorySource,
)


class Hold(LeafSystem):
    """A spring between hand and ball until the moment of release."""

    def __init__(self, hand, ball, release):
        super().__init__()
        self._hand, self._ball, self._release = hand, ball, release
        self.DeclareAbstractInputPort("poses", AbstractValue.Make([RigidTransform()]))
        self.DeclareAbstractInputPort("velocities", AbstractValue.Make([SpatialVelocity()]))
        self.DeclareAbstractOutputPort(
            "forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc
        )

    def _calc(self, context, output):
        if context.get_time() > self._release:
            output.set_value([])
            return
        poses, velocities = self.get_input_port(0).Eval(context), self.get_input_port(1).Eval(context)
        p_WH = poses[int(self._hand)].multiply(np.array([0.0, 0.0, 0.15]))
        v = velocities[int(self._hand)].translational() - velocities[int(self._ball)].translational()
        f = 400.0 * (p_WH - poses[int(self._ball)].translation()) + 8.0 * v
        pull, push = ExternallyAppliedSpatialForce(), ExternallyAppliedSpatialForce()
        pull.body_index, pull.F_Bq_W = self._ball, SpatialForce(np.zeros(3), f)
        push.body_index, push.F_Bq_W = self._hand, SpatialForce(np.zeros(3), -f)
        push.p_BoBq_B = np.array([0.0, 0.0, 0.15])
        output.set_value([pull, push])


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
    parser = Parser(plant)
    (arm,) = parser.AddModelsFromString(robots.arm(False), "urdf")
    parser.AddModelsFromString(robots.table(), "urdf")
    parser.AddModelsFromString(robots.box("ball", 0.05, 0.1), "urdf")
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("ball"), RigidTransform([0, 0, 1.4]))
    plant.Finalize()
    controlled = MultibodyPlant(0.0)
    Parser(controlled).AddModelsFromString(robots.arm(False), "urdf")
    controlled.Finalize()
    gains = np.full(7, 200.0)
    controller = builder.AddSystem(InverseDynamicsController(controlled, gains, np.ones(7), 2 * gains**0.5, False))
    knots = np.array([np.zeros(7), 0.6 * np.ones(7), -0.3 * np.ones(7)]).T
    path = PiecewisePolynomial.CubicWithContinuousSecondDerivatives([0.0, 0.5, 1.0], knots, np.zeros(7), np.zeros(7))
    source = builder.AddSystem(TrajectorySource(path, 1))
    hand, ball = plant.GetBodyByName("link7").index(), plant.GetBodyByName("ball").index()
    hold = builder.AddSystem(Hold(hand, ball, 0.45))
    builder.Connect(plant.get_body_poses_output_port(), hold.get_input_port(0))
    builder.Connect(plant.get_body_spatial_velocities_output_port(), hold.get_input_port(1))
    builder.Connect(hold.get_output_port(), plant.get_applied_spatial_force_input_port())
    builder.Connect(plant.get_state_output_port(arm), controller.get_input_port_estimated_state())
    builder.Connect(source.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(controller.get_output_port_control(), plant.get_actuation_input_port(arm))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.9)


for _ in range(3):
    program()
