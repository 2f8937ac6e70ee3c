"""A box on a tilted belt, surfaces of both running, as either library makes it; `python belts.py` prints the table.

Run with Drake 1.58 (or later) it is the oracle: numbers of `belt_numbers.txt` were printed by its wheel.
"""

from __future__ import annotations

import importlib

import numpy as np

APPROXIMATIONS = "kSap", "kSimilar", "kLagged"
CONTACTS = "kPoint", "kHydroelasticWithFallback"
DT, STEPS = 5e-3, 5


def material(lib, hydroelastic):
    """Of the belt ("rigid") or the box ("soft"), or of either without contact surfaces ("")."""
    properties = lib.ProximityProperties()
    friction = lib.CoulombFriction(0.6, 0.4)
    lib.AddContactMaterial(1.0, 1e5, friction, properties)
    properties.AddProperty("material", "relaxation_time", 0.02)
    if hydroelastic == "rigid":
        lib.AddRigidHydroelasticProperties(0.2, properties)
    if hydroelastic == "soft":
        lib.AddCompliantHydroelasticProperties(0.1, 1e6, properties)
    return properties


def scene(lib, contact, approximation=None, speeds=(0.7, -0.2)):
    """(diagram, context, plant, the plant's context); continuous without an approximation."""
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, DT if approximation else 0.0)
    if hasattr(scene_graph, "set_default_point_contact_algorithm"):
        scene_graph.set_default_point_contact_algorithm("single_point")
    if approximation:
        plant.set_discrete_contact_approximation(getattr(lib.DiscreteContactApproximation, approximation))
    plant.set_contact_model(getattr(lib.ContactModel, contact))
    plant.set_stiction_tolerance(1e-3)
    instance = plant.AddModelInstance("m")
    belt = plant.AddRigidBody("belt", instance, lib.SpatialInertia.SolidBoxWithMass(5.0, 2.0, 0.5, 0.2))
    tilt = lib.RigidTransform(lib.RollPitchYaw(0.1, -0.05, 0.3), [0.0, 0.0, 0.0])
    plant.WeldFrames(plant.world_frame(), belt.body_frame(), tilt)
    box = plant.AddRigidBody("box", instance, lib.SpatialInertia.SolidBoxWithMass(2.0, 0.3, 0.2, 0.1))
    surfaces = contact != "kPoint"
    ground = material(lib, "rigid" if surfaces else "")
    plant.RegisterCollisionGeometry(belt, lib.RigidTransform(), lib.Box(2.0, 0.5, 0.2), "top", ground)
    if surfaces:
        plant.RegisterCollisionGeometry(box, lib.RigidTransform(), lib.Box(0.3, 0.2, 0.1), "box", material(lib, "soft"))
    else:
        for i, (x, y) in enumerate([(-0.15, -0.1), (0.15, -0.1), (-0.15, 0.1), (0.15, 0.1)]):
            foot = lib.RigidTransform([x, y, -0.04])
            plant.RegisterCollisionGeometry(box, foot, lib.Sphere(0.01), f"foot {i}", material(lib, ""))
    plant.SetSurfaceVelocityAxis(belt, np.array([0.3, 1.0, 0.1]))
    plant.SetSurfaceVelocityAxis(box, np.array([0.5, -0.2, 1.0]))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    bus = lib.BusValue()
    for name, speed in zip(("m::belt", "m::box"), speeds):
        bus.Set(name, lib.AbstractValue.Make(speed))
    plant.get_surface_speeds_input_port().FixValue(own, bus)
    on_it = lib.RigidTransform(lib.RollPitchYaw(0.002, 0.001, 0.5), [0.1, 0.05, 0.1492])
    plant.SetFreeBodyPose(own, box, belt.EvalPoseInWorld(own) @ on_it)
    plant.SetVelocities(own, np.array([0.1, -0.2, 0.3, 0.05, 0.02, -0.01]))
    return diagram, context, plant, own


def numbers(lib, contact, approximation=None):
    """Rows by name: of a discrete plant the state after `STEPS` steps, then slip and force of the first step's points;

    of a continuous one its time derivatives, displacements behind them.
    """
    diagram, context, plant, own = scene(lib, contact, approximation)
    name = f"{contact} {approximation or 'continuous'}"
    if approximation is None:
        return {name: diagram.EvalTimeDerivatives(context).CopyToVector()}
    simulator = lib.Simulator(diagram, context)
    simulator.AdvanceTo(0.5 * DT)
    results = plant.get_contact_results_output_port().Eval(own)
    points = [results.point_pair_contact_info(i) for i in range(results.num_point_pair_contacts())]
    found = {f"{name} point {i}": np.array([p.slip_speed(), *p.contact_force()]) for i, p in enumerate(points)}
    simulator.AdvanceTo((STEPS - 0.5) * DT)
    displacements = plant.get_surface_displacements_output_port().Eval(own)
    run = [displacements.Find("m::belt"), displacements.Find("m::box")]
    return {name: np.concatenate([plant.GetPositionsAndVelocities(own), run]), **found}


def all_numbers(library):
    """`numbers` of all plants of a library ("pydrake" or "sheldrake")."""
    lib = importlib.import_module(f"{library}.all")
    return {
        name: row
        for contact in CONTACTS
        for approximation in (*APPROXIMATIONS, None)
        for name, row in numbers(lib, contact, approximation).items()
    }


if __name__ == "__main__":
    for name, row in all_numbers("pydrake").items():
        print(f"{name}:", *(repr(float(x)) for x in row))
