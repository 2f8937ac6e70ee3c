"""A gripper with suction cups: their force law is Python, on signed distances, applied as spatial forces."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AbstractValue,
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    ExternallyAppliedSpatialForce,
    LeafSystem,
    Parser,
    QueryObject,
    RigidTransform,
    Simulator,
    SpatialForce,
)


class Suction(LeafSystem):
    """Pulls the box towards each cup that is near it, and the gripper towards the box."""

    def __init__(self, gripper, box, geometry, cups):
        super().__init__()
        self._gripper, self._box, self._geometry, self._cups = gripper, box, geometry, cups
        self.DeclareAbstractInputPort("geometry", AbstractValue.Make(QueryObject()))
        self.DeclareAbstractInputPort("poses", AbstractValue.Make([RigidTransform()]))
        self.DeclareAbstractOutputPort(
            "forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc
        )

    def _calc(self, context, output):
        query = self.get_input_port(0).Eval(context)
        poses = self.get_input_port(1).Eval(context)
        X_WG, X_WB = poses[int(self._gripper.index())], poses[int(self._box.index())]
        forces = []
        for p_GC in self._cups:
            p_WC = X_WG.multiply(p_GC)
            near = [d for d in query.ComputeSignedDistanceToPoint(p_WC, threshold=0.05) if d.id_G == self._geometry]
            if not near:
                continue
            distance, toward = near[0].distance, -np.asarray(near[0].grad_W)
            strength = 3.0 * np.exp(-40.0 * max(distance, 0.0))
            for body, X, f in ((self._box, X_WB, -strength * toward), (self._gripper, X_WG, strength * toward)):
                force = ExternallyAppliedSpatialForce()
                force.body_index = body.index()
                force.p_BoBq_B = X.inverse().multiply(p_WC)
                force.F_Bq_W = SpatialForce(np.zeros(3), f)
                forces.append(force)
        output.set_value(forces)


def program():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.001)
    parser = Parser(plant)
    (gripper,) = parser.AddModelsFromString(robots.gripper(), "urdf")
    parser.AddModelsFromString(robots.table(), "urdf")
    parser.AddModelsFromString(robots.box(), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("body", gripper), RigidTransform([0, 0, 0.16]))
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("box"), RigidTransform([0, 0.05, 0.031]))
    plant.Finalize()
    box = plant.GetBodyByName("box")
    (geometry,) = plant.GetCollisionGeometriesForBody(box)
    cups = [np.array([x, y, -0.03]) for x in (-0.02, 0.02) for y in (0.03, 0.05)]
    suction = builder.AddSystem(Suction(plant.GetBodyByName("body", gripper), box, geometry, cups))
    builder.Connect(scene_graph.get_query_output_port(), suction.get_input_port(0))
    builder.Connect(plant.get_body_poses_output_port(), suction.get_input_port(1))
    builder.Connect(suction.get_output_port(), plant.get_applied_spatial_force_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    plant.get_actuation_input_port().FixValue(context, [1.0, 1.0])
    simulator.AdvanceTo(0.1)
    simulator.AdvanceTo(0.3)


for _ in range(3):
    program()
