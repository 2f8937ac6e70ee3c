"""Four driven wheels on soft ground, steered by their difference in a controller of 200 Hz in Python."""

import numpy as np
from pydrake.all import (
    AddContactMaterial,
    AddMultibodyPlantSceneGraph,
    BasicVector,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    LeafSystem,
    LogVectorOutput,
    ProximityProperties,
    RevoluteJoint,
    RigidTransform,
    Simulator,
    SpatialInertia,
    Sphere,
    UnitInertia,
)


class Driver(LeafSystem):
    def __init__(self, n):
        super().__init__()
        self.DeclareVectorInputPort("x", BasicVector(n))
        self.DeclareDiscreteState(4)
        self.DeclarePeriodicDiscreteUpdateEvent(0.005, 0, self.up)
        self.DeclareVectorOutputPort("u", 4, lambda c, o: o.SetFromVector(c.get_discrete_state(0).get_value()))

    def up(self, c, d):
        x = self.get_input_port().Eval(c)
        turn = 0.3 * np.sin(c.get_time())
        d.set_value(0, np.clip(1.5 + turn * np.array([1, -1, 1, -1]) - 0.02 * x[-4:], -4, 4))


def program():
    b = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(b, 0.002)
    props = ProximityProperties()
    AddContactMaterial(5.0, 3e4, CoulombFriction(0.9, 0.8), props)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "g", props)
    body = plant.AddRigidBody("body", SpatialInertia(10, np.zeros(3), UnitInertia.SolidBox(0.6, 0.4, 0.15)))
    for i, (x, y) in enumerate([(0.25, 0.25), (0.25, -0.25), (-0.25, 0.25), (-0.25, -0.25)]):
        w = plant.AddRigidBody(f"w{i}", SpatialInertia(0.8, np.zeros(3), UnitInertia.SolidSphere(0.1)))
        plant.RegisterCollisionGeometry(w, RigidTransform(), Sphere(0.1), f"w{i}", props)
        j = plant.AddJoint(
            RevoluteJoint(
                f"j{i}",
                plant.AddFrame(
                    __import__("pydrake.multibody.tree", fromlist=["x"]).FixedOffsetFrame(
                        f"f{i}", body, RigidTransform([x, y, -0.05])
                    )
                ),
                w.body_frame(),
                [0, 1, 0],
                0.02,
            )
        )
        plant.AddJointActuator(f"a{i}", j)
    plant.Finalize()
    plant.SetDefaultFreeBodyPose(body, RigidTransform([0, 0, 0.16]))
    d = b.AddSystem(Driver(plant.num_multibody_states()))
    b.Connect(plant.get_state_output_port(), d.get_input_port())
    b.Connect(d.get_output_port(), plant.get_actuation_input_port())
    log = LogVectorOutput(plant.get_state_output_port(), b, 0.1)
    s = Simulator(b.Build())
    s.AdvanceTo(1.5)
    return log.FindLog(s.get_context()).data()


for _ in range(3):
    program()
