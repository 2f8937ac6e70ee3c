"""A cloth-like net: point masses on prismatic/free bodies with LinearSpringDamper, and forces from Python."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.multibody.tree import LinearSpringDamper, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem


class Wind(LeafSystem):
    def __init__(self, plant, bodies):
        LeafSystem.__init__(self)
        self.plant, self.bodies = plant, bodies
        self.DeclareAbstractInputPort("velocities", plant.get_body_spatial_velocities_output_port().Allocate())
        self.DeclareAbstractOutputPort(
            "forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self.out
        )

    def out(self, context, output):
        V = self.get_input_port().Eval(context)
        forces = []
        for b in self.bodies:
            f = ExternallyAppliedSpatialForce()
            f.body_index = b.index()
            f.p_BoBq_B = np.zeros(3)
            rel = np.array([0, np.sin(3 * context.get_time()), 0]) - V[int(b.index())].translational()
            f.F_Bq_W = SpatialForce(np.zeros(3), 0.05 * rel)
            forces.append(f)
        output.set_value(forces)


def program():
    n = 4
    b = DiagramBuilder()
    plant = b.AddSystem(MultibodyPlant(0.001))
    M = SpatialInertia(0.02, np.zeros(3), UnitInertia.SolidSphere(0.02))
    bodies = {}
    for i in range(n):
        for j in range(n):
            bodies[i, j] = plant.AddRigidBody(f"p{i}_{j}", M)
    for j in range(n):
        plant.AddForceElement(
            LinearSpringDamper(plant.world_body(), [0.1 * j, 0, 0.1], bodies[0, j], np.zeros(3), 0.1, 30.0, 0.05)
        )
    for i in range(n):
        for j in range(n):
            for di, dj in ((1, 0), (0, 1), (1, 1)):
                if (i + di, j + dj) in bodies:
                    plant.AddForceElement(
                        LinearSpringDamper(
                            bodies[i, j],
                            np.zeros(3),
                            bodies[i + di, j + dj],
                            np.zeros(3),
                            0.1 * np.hypot(di, dj),
                            30.0,
                            0.05,
                        )
                    )
    plant.Finalize()
    for (i, j), body in bodies.items():
        plant.SetDefaultFreeBodyPose(body, RigidTransform([0.1 * j, 0.01 * i, -0.1 * i]))
    wind = b.AddSystem(Wind(plant, list(bodies.values())))
    b.Connect(plant.get_body_spatial_velocities_output_port(), wind.get_input_port())
    b.Connect(wind.get_output_port(), plant.get_applied_spatial_force_input_port())
    s = Simulator(b.Build())
    out = []
    for k in range(5):
        s.AdvanceTo(0.06 * (k + 1))
        c = plant.GetMyContextFromRoot(s.get_context())
        out.append([plant.EvalBodyPoseInWorld(c, x).translation() for x in bodies.values()])
    return out


for _ in range(3):
    program()
