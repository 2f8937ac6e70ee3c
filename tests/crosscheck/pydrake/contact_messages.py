"""A scene with a contact point and a contact surface, in sheldrake or pydrake, and what it publishes."""

import importlib


def publish(library):
    """The bytes of the last message on CONTACT_RESULTS."""
    lib = importlib.import_module(f"{library}.all")
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    inertia, friction = lib.SpatialInertia.SolidSphereWithMass(1.0, 0.1), lib.CoulombFriction(0.5, 0.5)
    soft, hard = (plant.AddRigidBody("ball", plant.AddModelInstance(name), inertia) for name in ("soft", "hard"))
    compliant, rigid = lib.ProximityProperties(), lib.ProximityProperties()
    for properties in (compliant, rigid):
        lib.AddContactMaterial(friction=friction, properties=properties)
    lib.AddCompliantHydroelasticProperties(0.05, 1e6, compliant)
    lib.AddRigidHydroelasticProperties(0.1, rigid)
    ground = lib.RigidTransform([0.0, 0.0, -0.1])
    plant.RegisterCollisionGeometry(soft, lib.RigidTransform(), lib.Sphere(0.1), "skin", compliant)
    plant.RegisterCollisionGeometry(plant.world_body(), ground, lib.Box(5.0, 5.0, 0.2), "ground", rigid)
    plant.RegisterCollisionGeometry(hard, lib.RigidTransform(), lib.Sphere(0.1), "shell", friction)
    plant.Finalize()
    lcm, messages = lib.DrakeLcm("memq://"), []
    publisher = lib.ConnectContactResultsToDrakeVisualizer(builder, plant, scene_graph, lcm, publish_period=0.1)
    assert publisher.get_name() == "contact_results_publisher"
    diagram = builder.Build()
    lcm.Subscribe("CONTACT_RESULTS", messages.append)
    simulator = lib.Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, soft, lib.RigidTransform([0.0, 0.0, 0.097]))
    plant.SetFreeBodyPose(context, hard, lib.RigidTransform([1.0, 0.0, 0.0999]))
    simulator.AdvanceTo(0.1)
    lcm.HandleSubscriptions(0)
    assert len(messages) == 2
    return messages[-1]
