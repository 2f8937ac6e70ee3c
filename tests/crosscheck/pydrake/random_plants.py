"""The same random plant built twice through one API: by pydrake and by sheldrake."""

import importlib
import types

import numpy as np

MODULES = ("math", "multibody.math", "multibody.tree", "multibody.plant", "systems.framework", "common.eigen_geometry")
JOINTS = ("revolute", "prismatic", "weld", "screw", "planar", "universal", "ball", "quaternion", "rpy")


def library(name):
    """All public names of a library's multibody modules in one namespace."""
    names = types.SimpleNamespace(library=name)
    for module in MODULES:
        try:
            names.__dict__.update(vars(importlib.import_module(f"{name}.{module}")))
        except ModuleNotFoundError:
            if module != "common.eigen_geometry":
                raise
    return names


def pydrake():
    return library("pydrake")


def sheldrake():
    return library("sheldrake")


def random_pose(lib, rng):
    rpy, p = rng.uniform(-2, 2, 3), rng.normal(size=3)
    return lib.RigidTransform(lib.RollPitchYaw(rpy), p)


def random_inertia(lib, rng):
    size, mass, c = rng.uniform(0.3, 1.0, 3), rng.uniform(0.5, 2.0), rng.normal(size=3) * 0.2
    central = lib.UnitInertia.SolidBox(*size)
    return lib.SpatialInertia(mass, c, central.ShiftFromCenterOfMass(-c))


def make_joint(lib, rng, kind, name, F, M):
    d = rng.uniform(0, 1, 3)
    axis = rng.normal(size=3)
    if kind == "revolute":
        return lib.RevoluteJoint(name, F, M, axis, -2.0, 3.0, d[0])
    if kind == "prismatic":
        return lib.PrismaticJoint(name, F, M, axis, -1.0, 1.5, d[0])
    if kind == "weld":
        return lib.WeldJoint(name, F, M, random_pose(lib, rng))
    if kind == "screw":
        return lib.ScrewJoint(name, F, M, axis, 0.4, d[0])
    if kind == "planar":
        return lib.PlanarJoint(name, F, M, d)
    if kind == "universal":
        return lib.UniversalJoint(name, F, M, d[0])
    if kind == "ball":
        return lib.BallRpyJoint(name, F, M, d[0])
    if kind == "quaternion":
        return lib.QuaternionFloatingJoint(name, F, M, d[0], d[1])
    return lib.RpyFloatingJoint(name, F, M, d[0], d[1])


def build(lib, seed, num_bodies=9, time_step=0.0, joints=JOINTS, forces=True, reversals=True, bushings=False):
    """A finalized plant: random trees, frames, actuators, springs, two model instances."""
    rng = np.random.default_rng(seed)
    plant = lib.MultibodyPlant(time_step)
    instances = [lib.default_model_instance(), plant.AddModelInstance("robot")]
    bodies = [plant.world_body()]
    for i in range(num_bodies):
        bodies.append(plant.AddRigidBody(f"b{i}", instances[rng.integers(2)], random_inertia(lib, rng)))

    def frame(body, name):
        if rng.random() < 0.4:
            return body.body_frame()
        offset = plant.AddFrame(lib.FixedOffsetFrame(name, body.body_frame(), random_pose(lib, rng)))
        if rng.random() < 0.3:
            offset = plant.AddFrame(lib.FixedOffsetFrame(name + "_on", offset, random_pose(lib, rng)))
        return offset

    order = rng.permutation(num_bodies) + 1
    added = []
    for n, i in enumerate(order):
        if rng.random() < 0.2:
            continue  # floats
        before = [0, *order[:n]]
        parent, child = bodies[before[rng.integers(len(before))]], bodies[i]
        kind = str(rng.choice(joints))
        if reversals and kind in ("revolute", "prismatic", "weld") and rng.random() < 0.3:
            parent, child = child, parent
        F, M = frame(parent, f"F{i}"), frame(child, f"M{i}")
        added.append(plant.AddJoint(make_joint(lib, rng, kind, f"j{i}", F, M)))
    single = [j for j in added if j.type_name() in ("revolute", "prismatic", "screw")]
    for j in single:
        if rng.random() < 0.6:
            actuator = plant.AddJointActuator(f"{j.name()}_motor", j, rng.uniform(1, 50))
            actuator.set_default_rotor_inertia(rng.uniform(0, 0.1))
            actuator.set_default_gear_ratio(rng.uniform(1, 10))
        if forces and j.type_name() == "revolute" and rng.random() < 0.4:
            plant.AddForceElement(lib.RevoluteSpring(j, rng.normal(), rng.uniform(1, 10)))
        if forces and j.type_name() == "prismatic" and rng.random() < 0.4:
            plant.AddForceElement(lib.PrismaticSpring(j, rng.normal(), rng.uniform(1, 10)))
    if forces:
        A, B = bodies[rng.integers(num_bodies + 1)], bodies[rng.integers(1, num_bodies + 1)]
        if A is not B:
            points = rng.normal(size=(2, 3))
            plant.AddForceElement(lib.LinearSpringDamper(A, points[0], B, points[1], 0.5, 20.0, 3.0))
    if forces and bushings:
        A, C = (frame(bodies[i], f"bushing{i}") for i in rng.permutation(num_bodies + 1)[:2])
        plant.AddForceElement(lib.LinearBushingRollPitchYaw(A, C, *rng.uniform(0, 5, (4, 3))))
        for j in [j for j in single if j.type_name() == "revolute"][:1]:
            config = lib.DoorHingeConfig(motion_threshold=0.1, catch_width=0.5)
            plant.AddForceElement(lib.DoorHinge(j, config))
    plant.mutable_gravity_field().set_gravity_vector(rng.normal(size=3) * 9.81)
    plant.Finalize()
    return plant


def random_state(plant, seed):
    rng = np.random.default_rng(seed + 1000)
    return rng.uniform(-1.3, 1.3, plant.num_positions()), rng.normal(size=plant.num_velocities()), rng


def set_state(plant, context, seed):
    q, v, rng = random_state(plant, seed)
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    return q, v, rng
