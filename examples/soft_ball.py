"""Three soft balls on a table: the softer, the larger the area that bears the weight, and the lower the pressure.

Run it: python examples/soft_ball.py [--headless]
"""

import sys

from sheldrake.all import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddMultibodyPlantSceneGraph,
    AddRigidHydroelasticProperties,
    Box,
    ContactModel,
    ContactVisualizer,
    CoulombFriction,
    DiagramBuilder,
    MeshcatVisualizer,
    ProximityProperties,
    RigidTransform,
    Simulator,
    SpatialInertia,
    Sphere,
    StartMeshcat,
)

RADIUS, MASS = 0.1, 2.0  # [m], [kg]
MODULI = 3e4, 1e5, 1e6  # [Pa]
FRICTION = CoulombFriction(0.6, 0.5)


def add_table(plant):
    rigid = ProximityProperties()
    AddRigidHydroelasticProperties(rigid)
    AddContactMaterial(properties=rigid, friction=FRICTION)
    world, X_WT, table = plant.world_body(), RigidTransform([0.0, 0.0, -0.05]), Box(1.0, 0.4, 0.1)
    plant.RegisterCollisionGeometry(world, X_WT, table, "table", rigid)
    plant.RegisterVisualGeometry(world, X_WT, table, "table", [0.6, 0.65, 0.7, 0.5])


def add_ball(plant, i, modulus):
    soft = ProximityProperties()
    AddCompliantHydroelasticProperties(resolution_hint=0.01, hydroelastic_modulus=modulus, properties=soft)
    AddContactMaterial(properties=soft, friction=FRICTION, dissipation=2.0)
    ball = plant.AddRigidBody(f"ball{i}", SpatialInertia.SolidSphereWithMass(MASS, RADIUS))
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(RADIUS), "ball", soft)
    plant.RegisterVisualGeometry(ball, RigidTransform(), Sphere(RADIUS), "ball", [0.9, 0.4 + 0.2 * i, 0.2, 0.6])
    plant.SetDefaultFloatingBaseBodyPose(ball, RigidTransform([0.3 * (i - 1), 0.0, RADIUS]))


def main(meshcat=None, seconds=2.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=2e-3)
    plant.set_contact_model(ContactModel.kHydroelastic)
    add_table(plant)
    for i, modulus in enumerate(MODULI):
        add_ball(plant, i, modulus)
    plant.Finalize()
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
        ContactVisualizer.AddToBuilder(builder, plant, meshcat)
    simulator = Simulator(builder.Build())
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    plant_context = plant.GetMyContextFromRoot(simulator.get_context())
    contacts = plant.get_contact_results_output_port().Eval(plant_context)
    infos = [contacts.hydroelastic_contact_info(i) for i in range(contacts.num_hydroelastic_contacts())]
    areas = [info.contact_surface().total_area() for info in infos]
    forces = [abs(info.F_Ac_W().translational()[2]) for info in infos]
    shown = ", ".join(f"{area * 1e4:.1f} cm² at {E:.0e} Pa" for area, E in zip(areas, MODULI))
    print(f"{forces[0]:.2f} N on {shown}")
    return areas, forces


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
