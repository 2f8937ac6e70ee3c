"""Calls with None, on objects of many classes; as a script: which of them are a TypeError in pydrake.

    python none_calls.py OUT.json

Some end the process in pydrake, so every object is asked in a process of its own, again from where it ended.
"""

from __future__ import annotations

import json
import os
import pathlib
import sys

import numpy as np
from all_systems import Library

ROOT = pathlib.Path(__file__).resolve().parents[3]
LINK = """<link name="{}"><inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
ARM = f"""<robot name="arm"><link name="base"/>{LINK.format("l1")}{LINK.format("l2")}
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="5"/></joint>
<joint name="j2" type="prismatic"><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/></joint>
<transmission name="t"><type>SimpleTransmission</type><joint name="j1"/><actuator name="a1"/></transmission></robot>"""


def objects(package):
    """Objects of many classes by name."""
    L = Library(package)
    ex = L.examples
    sym = L
    o = {}
    b = L.DiagramBuilder()
    plant, graph = L.AddMultibodyPlantSceneGraph(b, 1e-3)
    o["parser"] = p = L.Parser(plant)
    p.AddModelsFromString(ARM, "urdf")
    plant.AddForceElement(L.RevoluteSpring(plant.GetJointByName("j1"), 0.1, 1.0))
    plant.RegisterCollisionGeometry(
        plant.GetBodyByName("l1"), L.RigidTransform(), L.Sphere(0.1), "s", L.CoulombFriction(0.5, 0.5)
    )
    plant.RegisterCollisionGeometry(
        plant.world_body(), L.RigidTransform([0, 0, -1]), L.HalfSpace(), "g", L.CoulombFriction(0.5, 0.5)
    )
    plant.Finalize()
    d = b.Build()
    c = d.CreateDefaultContext()
    pc = plant.GetMyContextFromRoot(c)
    gc = graph.GetMyContextFromRoot(c)
    o.update(plant=plant, scene_graph=graph, diagram=d, context=c, plant_context=pc, builder=L.DiagramBuilder())
    o["unfinalized"] = L.MultibodyPlant(0.0)
    o["body"] = plant.GetBodyByName("l1")
    o["world"] = plant.world_body()
    o["frame"] = o["body"].body_frame()
    o["joint"] = plant.GetJointByName("j1")
    o["prismatic"] = plant.GetJointByName("j2")
    o["weld"] = plant.GetJointByName("base_weld") if plant.HasJointNamed("base_weld") else plant.GetJointByName("j1")
    o["actuator"] = plant.GetJointActuatorByName("a1")
    o["gravity"] = plant.gravity_field()
    o["inspector"] = graph.model_inspector()
    o["query"] = graph.get_query_output_port().Eval(gc)
    o["forces"] = L.MultibodyForces(plant)
    o["input_port"] = plant.get_actuation_input_port()
    o["output_port"] = plant.get_state_output_port()
    o["state"] = c.get_state()
    o["xc"] = ex.PendulumPlant().CreateDefaultContext()
    o["values"] = pc.get_discrete_state()
    o["params"] = pc.get_parameters()
    o["vector"] = L.BasicVector([1.0, 2.0])
    o["value"] = L.Value(3)
    o["simulator"] = L.Simulator(d)
    o["integrator"] = o["simulator"].get_integrator()
    o["topics"] = p.package_map()
    prog = L.MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    o["prog"] = prog
    o["lin_con"] = prog.AddLinearConstraint(x[0] + x[1] <= 1).evaluator()
    o["lin_cost"] = prog.AddLinearCost(x[0]).evaluator()
    o["quad_cost"] = prog.AddQuadraticCost(x[0] ** 2).evaluator()
    o["binding"] = prog.AddBoundingBoxConstraint(0, 1, x)
    o["bbox"] = o["binding"].evaluator()
    o["expr_con"] = prog.AddConstraint(L.sin(x[0]) <= 1).evaluator()
    o["options"] = L.SolverOptions()
    o["result"] = L.Solve(L.MathematicalProgram())
    o["pp"] = L.PiecewisePolynomial.FirstOrderHold([0.0, 1.0, 2.0], np.array([[0.0, 1.0, 0.5]]))
    o["bez"] = L.BezierCurve(0.0, 1.0, np.eye(2))
    o["bsp"] = L.BsplineTrajectory(L.BsplineBasis(3, 5), [np.ones((1, 1))] * 5)
    o["slerp"] = L.PiecewiseQuaternionSlerp([0.0, 1.0], [L.RotationMatrix.MakeXRotation(0.1), L.RotationMatrix()])
    o["pose_traj"] = L.PiecewisePose.MakeLinear([0.0, 1.0], [L.RigidTransform(), L.RigidTransform([1, 0, 0])])
    o["X"] = L.RigidTransform()
    o["R"] = L.RotationMatrix()
    o["rpy"] = L.RollPitchYaw(0.0, 0.0, 0.0)
    o["V"] = L.SpatialVelocity.Zero()
    o["F"] = L.SpatialForce.Zero()
    o["M"] = L.SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    o["I"] = L.RotationalInertia(1.0, 1.0, 1.0)
    o["U"] = L.UnitInertia(1.0, 1.0, 1.0)
    o["var"] = L.Variable("a")
    o["expr"] = L.Expression(o["var"]) + 1
    o["formula"] = o["var"] > 0
    o["vars"] = L.Variables([o["var"]])
    o["poly"] = sym.Polynomial(o["var"] ** 2)
    o["mono"] = sym.Monomial(o["var"], 2)
    o["ratio"] = sym.RationalFunction(o["poly"])
    o["box"] = L.HPolyhedron.MakeUnitBox(2)
    o["ell"] = L.Hyperellipsoid.MakeUnitBall(2)
    o["point"] = L.Point([0.0, 1.0])
    o["gcs"] = g = L.GraphOfConvexSets()
    o["vertex"] = g.AddVertex(o["point"], "v")
    o["edge"] = g.AddEdge(o["vertex"], g.AddVertex(o["box"], "w"), "e")
    o["vpoly"] = L.VPolytope(np.eye(2))
    o["ik"] = L.InverseKinematics(plant)
    o["props"] = L.ProximityProperties()
    o["sphere"] = L.Sphere(1.0)
    o["inst"] = L.GeometryInstance(L.RigidTransform(), L.Sphere(1.0), "n")
    o["frame_geo"] = L.GeometryFrame("f")
    o["set"] = L.GeometrySet()
    o["cfm"] = graph.collision_filter_manager()
    o["adder"] = L.Adder(1, 2)
    o["linear"] = L.LinearSystem(np.eye(1), np.eye(1), np.eye(1), np.eye(1))
    o["ad"] = L.AutoDiffXd(1.0, [1.0])
    o["rng"] = L.RandomGenerator()
    o["log"] = L.VectorLogSink(1)
    o["trajsrc"] = L.TrajectorySource(o["pp"])
    o["pid"] = L.PidController([1.0], [1.0], [1.0])
    o["pend"] = ex.PendulumPlant()
    pp = o["pp2"] = ex.PendulumPlant()
    o["dircol"] = L.DirectCollocation(pp, pp.CreateDefaultContext(), 5, 0.1, 0.2)
    o["gcsto"] = L.GcsTrajectoryOptimization(2)
    o["cloud"] = L.PointCloud(3)
    o["leaf"] = L.LeafSystem()
    o["contact_results"] = plant.get_contact_results_output_port().Eval(pc)
    o["rgba"] = L.Rgba(1, 1, 1, 1)
    return o


def required_counts(function):
    """How many arguments the ways to call a function of pydrake require, where they require any."""
    import compare_with_pydrake

    ways = compare_with_pydrake.overloads(function)
    return sorted({sum(p.default is None and not p.keyword_only for p in way.parameters) for way in ways} - {0})


def outcomes(thing, calls):
    """What calls with None do, by name: of an exception its class, "ended" where the process does not outlive it."""
    done = []
    while len(done) < len(calls):
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            for method, n in calls[len(done) :]:
                os.write(writer, f"{outcome(thing, method, n)}\n".encode())
            os._exit(0)
        os.close(writer)
        with os.fdopen(reader) as lines:
            done += lines.read().split()
        os.waitpid(child, 0)
        if len(done) < len(calls):
            done.append("ended")
    return done


def outcome(thing, method, n):
    """What one call with n times None does."""
    try:
        getattr(thing, method)(*[None] * n)
    except Exception as error:
        return "TypeError" if isinstance(error, TypeError) else type(error).__name__
    return "nothing"


def main():
    """Writes which calls are a TypeError: name of the object, method, number of arguments."""
    sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "src")]
    refused = []
    for name, thing in objects("pydrake").items():
        calls = []
        for method in dir(thing):
            function = None if method.startswith("_") else getattr(type(thing), method, None)
            if callable(function):
                calls += [(method, n) for n in required_counts(function)]
        refused += [(name, *call) for call, found in zip(calls, outcomes(thing, calls)) if found == "TypeError"]
    pathlib.Path(sys.argv[1]).write_text(json.dumps(refused))


if __name__ == "__main__":
    main()
