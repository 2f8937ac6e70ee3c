"""A camera watches a falling box; a system in Python finds its place in each picture and moves a paddle."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AbstractValue,
    AddMultibodyPlantSceneGraph,
    CameraInfo,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    DiagramBuilder,
    ImageDepth32F,
    LeafSystem,
    MakeRenderEngineVtk,
    Parser,
    RenderCameraCore,
    RenderEngineVtkParams,
    RgbdSensor,
    RigidTransform,
    RollPitchYaw,
    Simulator,
)


class Tracker(LeafSystem):
    """The mean column of what is near, as a command."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractInputPort("depth", AbstractValue.Make(ImageDepth32F(1, 1)))
        state = self.DeclareDiscreteState(2)
        self.DeclareStateOutputPort("command", state)
        self.DeclarePeriodicDiscreteUpdateEvent(0.05, 0.0, self._update)

    def _update(self, context, values):
        depth = self.get_input_port().Eval(context).data[:, :, 0]
        near = np.isfinite(depth) & (depth < 1.4)
        column = near.any(axis=0).nonzero()[0].mean() / depth.shape[1] - 0.5 if near.any() else 0.0
        values.get_mutable_vector().SetFromVector([column, -column])


def program():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.002)
    parser = Parser(plant)
    parser.AddModelsFromString(robots.table(), "urdf")
    (gripper,) = parser.AddModelsFromString(robots.gripper(), "urdf")
    parser.AddModelsFromString(robots.box(), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("body", gripper), RigidTransform([0.3, 0, 0.2]))
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("box"), RigidTransform([0, 0.05, 0.3]))
    plant.Finalize()
    scene_graph.AddRenderer("renderer", MakeRenderEngineVtk(RenderEngineVtkParams()))
    core = RenderCameraCore("renderer", CameraInfo(160, 120, 0.8), ClippingRange(0.05, 5.0), RigidTransform())
    pose = RigidTransform(RollPitchYaw(-np.pi / 2, 0, 0), [0, -1.2, 0.2])
    camera = builder.AddSystem(
        RgbdSensor(
            scene_graph.world_frame_id(),
            pose,
            ColorRenderCamera(core, False),
            DepthRenderCamera(core, DepthRange(0.1, 4.0)),
        )
    )
    tracker = builder.AddSystem(Tracker())
    builder.Connect(scene_graph.get_query_output_port(), camera.query_object_input_port())
    builder.Connect(camera.depth_image_32F_output_port(), tracker.get_input_port())
    builder.Connect(tracker.get_output_port(), plant.get_actuation_input_port(gripper))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.5)


for _ in range(3):
    program()
