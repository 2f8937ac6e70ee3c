"""A needle that all but touches the edge of a large hull: GJK's clearance has to suit the smaller shape."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.geometry import (
    Convex,
    Cylinder,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)
from sheldrake.math import RigidTransform, RotationMatrix

VERTICES = [
    [-0.7195102487966402, -0.15882542296307306, 0.10315573688327226],
    [-0.4343272966322464, 0.35070785968896456, 0.12766003231433268],
    [0.7146218467251495, 0.5840140629270667, -0.4645748083303863],
    [0.2142002253310225, -0.42595992852947145, -0.03100825245268223],
    [-0.31655478907419365, -0.0746822988291454, -0.13341979144360458],
    [0.13383946924335904, -0.21221630771283453, 0.24489486414418435],
    [-0.02719098184710871, -0.2616520865891969, 0.49731205868103406],
]
R_WH = [
    [0.6089848622596368, 0.7929788891406101, 0.01794209898353874],
    [0.6335992369561406, -0.49994507175369174, 0.5904294472312438],
    [0.4771681511450734, -0.3481944953707907, -0.8068897997411246],
]
R_WN = [
    [0.26560564776877715, 0.6207486089084809, -0.7376481576005691],
    [-0.649479607476875, 0.6806613622558679, 0.33893413726514837],
    [0.7124814940368716, 0.3890646147751962, 0.5839510648888446],
]
P_WH = np.array([-0.20045929647512206, -0.661463512015929, -0.792953639255403])
P_WN = np.array([-0.11620295512776635, -0.8673950156383476, -0.6570747238433021])


def near(R: list) -> RotationMatrix:
    return RotationMatrix.ProjectToRotationMatrix(np.array(R))


@pytest.mark.parametrize("wobble", [0.0, 1e-10, 1e-8])
def test_a_needle_that_hardly_misses_an_edge(wobble):
    """Apart, the nearest points are as far from each other as is said; there the needle is 0.28 um away."""
    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("needle")
    ids = []
    for shape in (Cylinder(3.1029212502963e-4, 2 * 3.97855633653269e-3), Convex(np.array(VERTICES).T, "hull")):
        frame = scene_graph.RegisterFrame(source, GeometryFrame(type(shape).__name__))
        made = GeometryInstance(RigidTransform(), shape, type(shape).__name__)
        made.set_proximity_properties(ProximityProperties())
        ids.append((frame, scene_graph.RegisterGeometry(source, frame, made)))
    (needle, needle_geometry), (hull, hull_geometry) = ids
    context = scene_graph.CreateDefaultContext()
    rng = np.random.default_rng(5)
    apart = 0
    for _ in range(60):
        poses = scene_graph.get_source_pose_port(source).Allocate().get_value()
        poses.set_value(needle, RigidTransform(near(R_WN), P_WN + wobble * rng.normal(size=3)))
        poses.set_value(hull, RigidTransform(near(R_WH), P_WH))
        scene_graph.get_source_pose_port(source).FixValue(context, poses)
        query = scene_graph.get_query_output_port().Eval(context)
        found = query.ComputeSignedDistancePairClosestPoints(needle_geometry, hull_geometry)
        X_WA, X_WB = (query.GetPoseInWorld(i) for i in (found.id_A, found.id_B))
        between = X_WA @ found.p_ACa - X_WB @ found.p_BCb
        np.testing.assert_allclose(between, found.distance * found.nhat_BA_W, atol=3e-8)
        apart += found.distance > 0.0
    assert apart == 60
