"""A rapidly exploring tree with collision checks by queries."""

import _robots as robots
import numpy as np
from pydrake.all import AddMultibodyPlantSceneGraph, CoulombFriction, DiagramBuilder, Parser, RigidTransform, Sphere

builder = DiagramBuilder()
plant, sg = AddMultibodyPlantSceneGraph(builder, 0.001)
Parser(plant).AddModelsFromString(robots.arm(), "urdf")
for name in ["link3", "link5", "link7"]:
    plant.RegisterCollisionGeometry(
        plant.GetBodyByName(name), RigidTransform(), Sphere(0.02), name + "c", CoulombFriction(1, 1)
    )
for k in range(5):
    plant.RegisterCollisionGeometry(
        plant.world_body(),
        RigidTransform([0.5 * np.cos(k), 0.5 * np.sin(k), 0.5]),
        Sphere(0.1),
        f"obs{k}",
        CoulombFriction(1, 1),
    )
plant.Finalize()
diagram = builder.Build()


def program():
    context = diagram.CreateDefaultContext()
    pc = plant.GetMyMutableContextFromRoot(context)
    sc = sg.GetMyContextFromRoot(context)
    rng = np.random.default_rng(0)
    lo, hi = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    lo = np.maximum(lo, -3)
    hi = np.minimum(hi, 3)

    def collides(q):
        plant.SetPositions(pc, q)
        query = plant.get_geometry_query_input_port().Eval(pc)
        return query.HasCollisions()

    def pairs(q):
        plant.SetPositions(pc, q)
        query = sg.get_query_output_port().Eval(sc)
        return query.ComputePointPairPenetration()

    def nearest(q):
        plant.SetPositions(pc, q)
        query = sg.get_query_output_port().Eval(sc)
        return min((p.distance for p in query.ComputeSignedDistancePairwiseClosestPoints(0.3)), default=1)

    tree = [np.zeros(7)]
    n = 0
    for _ in range(150):
        s = rng.uniform(lo, hi)
        near = min(tree, key=lambda a: np.linalg.norm(a - s))
        d = s - near
        d *= 0.3 / np.maximum(np.linalg.norm(d), 0.3)
        ok = True
        for i in range(1, 6):
            if collides(near + d * i / 5):
                ok = False
                break
        if ok:
            tree.append(near + d)
            n += len(pairs(near + d))
            nearest(near + d)
    return n, len(tree)


for _ in range(3):
    program()
