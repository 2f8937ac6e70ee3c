"""A script of 2021, with the names of then, runs; each hint is given once."""

import importlib
import os
import pathlib
import subprocess
import sys

import pytest

import sheldrake
from sheldrake._pydrake import retired
from sheldrake._pydrake.retired.methods import Now

ROOT = pathlib.Path(__file__).parents[2]

SCRIPT = """
import sys
import numpy as np
from pydrake.all import *

builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
model = Parser(plant).AddModelFromFile(sys.argv[1], "block")
plant.RegisterCollisionGeometry(
    plant.world_body(), RigidTransform(), HalfSpace(), "ground_collision",
    CoulombFriction(static_friction=0.7, dynamic_friction=0.5),
)
plant.Finalize()
logger = LogOutput(plant.get_state_output_port(model), builder)
logger.set_name("logger")
visualizer = ConnectMeshcatVisualizer(
    builder=builder, zmq_url="tcp://127.0.0.1:59999", scene_graph=scene_graph,
    output_port=scene_graph.get_query_output_port(),
)
visualizer.load()
diagram = builder.Build()
context = diagram.CreateDefaultContext()
plant_context = plant.GetMyContextFromRoot(context)
body = plant.get_body(plant.GetBodyIndices(model)[0])
plant.SetFreeBodyPose(plant_context, body, RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0, 0, 0.1]))
diagram.Publish(context)
simulator = Simulator(diagram, context)
simulator.set_publish_every_time_step(False)
simulator.Initialize()
simulator.StepTo(0.05)
simulator.AdvanceTo(0.1)
assert logger.data().shape == (13, logger.sample_times().size) and logger.sample_times()[-1] == 0.1
assert abs(logger.data()[12, 50] + 9.81 * 0.05) < 0.03  # vz after falling for 0.05 s
html = GenerateHtml(diagram)
assert html.startswith("<details open") and "plant" in html
print("done")
"""


def run(code, *arguments):
    env = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "SHELDRAKE_QUIET": "1"}
    command = [sys.executable, "-m", "sheldrake", "run", "-", *arguments]
    return subprocess.run(command, input=code, env=env, capture_output=True, text=True)


def test_a_script_of_2021():
    result = run(SCRIPT, sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
    assert result.returncode == 0, result.stderr
    assert "done" in result.stdout
    hints = [line for line in result.stderr.splitlines() if "hint:" in line]
    for name in ("LogOutput", "ConnectMeshcatVisualizer", "System.Publish", "Simulator.StepTo", "GenerateHtml"):
        assert sum(name in hint for hint in hints) == 1, (name, hints)


def test_old_ways_of_making_systems():
    result = run("""
from pydrake.systems.framework import LeafSystem, DiagramBuilder
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import ConstantVectorSource, SignalLogger, LogOutput
import numpy as np

class Counter(LeafSystem):
    def __init__(self):
        LeafSystem.__init__(self)
        self.published = []
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdate(0.1)
        self.DeclarePeriodicPublish(0.25, 0.0)
        self.DeclareVectorOutputPort("n", 1, self.count)
    def count(self, context, output):
        output.SetFromVector(context.get_discrete_state_vector().value())
    def DoCalcDiscreteVariableUpdates(self, context, events, discrete_state):
        discrete_state.get_mutable_vector().SetFromVector(context.get_discrete_state_vector().value() + 1)
    def DoPublish(self, context, events):
        self.published.append(context.get_time())

builder = DiagramBuilder()
counter = builder.AddSystem(Counter())
every = LogOutput(counter.get_output_port(0), builder)
some = builder.AddSystem(SignalLogger(1))
some.set_publish_period(0.5)
builder.Connect(counter.get_output_port(0), some.get_input_port(0))
simulator = Simulator(builder.Build())
simulator.AdvanceTo(1.0)
assert counter.published == [0.0, 0.25, 0.5, 0.75, 1.0], counter.published
np.testing.assert_allclose(some.sample_times(), [0.0, 0.5, 1.0])
assert every.data()[0, -1] == 10.0, every.data()
every.reset()
assert every.data().shape == (1, 0)
""")
    assert result.returncode == 0, result.stderr


def test_retired_functions_elsewhere():
    result = run("""
from pydrake.trajectories import PiecewisePolynomial
from pydrake.geometry import MeshcatVisualizerCpp, MeshcatVisualizer
from pydrake.multibody.plant import ContactResultsToMeshcat, ContactResultsToMeshcatParams
from pydrake.multibody.tree import BodyFrame_, RigidBodyFrame_
from pydrake.solvers import MinimumValueConstraint, MinimumValueLowerBoundConstraint, MobyLCPSolver
from pydrake.visualization.plotting import plot_sublevelset_expression
assert BodyFrame_ is RigidBodyFrame_ and issubclass(MinimumValueConstraint, MinimumValueLowerBoundConstraint)
from pydrake.systems.meshcat_visualizer import ConnectMeshcatVisualizer
assert issubclass(MeshcatVisualizerCpp, MeshcatVisualizer)
p = PiecewisePolynomial.Pchip([0.0, 1.0, 2.0], [[0.0, 1.0, 4.0]])
assert p.isApprox(PiecewisePolynomial.CubicShapePreserving([0.0, 1.0, 2.0], [[0.0, 1.0, 4.0]]), 1e-12)
assert PiecewisePolynomial.Cubic([0.0, 1.0], [[0.0, 1.0]], [0.0], [0.0]).value(0.5)[0, 0] == 0.5
""")
    assert result.returncode == 0, result.stderr
    assert "PiecewisePolynomial.Pchip() is retired: use CubicShapePreserving()." in result.stderr


def test_retired_distances_inputs_and_filters():
    result = run("""
import numpy as np
from pydrake.all import *
from pydrake.geometry.optimization import IrisInConfigurationSpace
from pydrake.multibody.inverse_kinematics import MinimumDistanceConstraint
from pydrake.multibody.parsing import GetScopedFrameName
builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
balls = []
for i in range(2):
    body = plant.AddRigidBody(f"ball{i}", SpatialInertia.SolidSphereWithDensity(1000, 0.1))
    plant.AddJoint(PrismaticJoint(f"x{i}", plant.world_frame(), body.body_frame(), [1, 0, 0]))
    balls.append(plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), f"s{i}", CoulombFriction(1, 1)))
plant.Finalize()
diagram = builder.Build()
context = diagram.CreateDefaultContext()
mine = plant.GetMyMutableContextFromRoot(context)
ik = InverseKinematics(plant, mine)
found = ik.AddMinimumDistanceConstraint(0.05).evaluator()
assert (found.distance_bound(), found.influence_distance()) == (0.05, 1.05)
other = MinimumDistanceConstraint(plant, 0.05, mine)
assert other.influence_distance() == 1.05 and not other.CheckSatisfied([0.0, 0.2])
assert GetScopedFrameName(plant, plant.GetFrameByName("ball0")).endswith("ball0")
query = scene_graph.get_query_output_port()
assert len(query.Eval(scene_graph.GetMyContextFromRoot(context)).ComputePointPairPenetration()) == 1
scene_graph.ExcludeCollisionsBetween(scene_graph.GetMyMutableContextFromRoot(context), *map(GeometrySet, balls))
assert not query.Eval(scene_graph.GetMyContextFromRoot(context)).ComputePointPairPenetration()
gain = Gain(2.0, 3)
context = gain.CreateDefaultContext()
context.FixInputPort(0, [1.0, 2.0, 3.0])
np.testing.assert_array_equal(gain.get_output_port(0).Eval(context), [2.0, 4.0, 6.0])
""")
    assert result.returncode == 0, result.stderr
    for text in ("AddMinimumDistanceConstraint()", "MinimumDistanceConstraint is retired", "Context.FixInputPort()"):
        assert text in result.stderr


@pytest.mark.parametrize("module", retired.METHODS)
def test_the_classes_and_todays_methods_exist(module):
    loaded = importlib.import_module(module)
    for name, methods in retired.METHODS[module].items():
        cls = getattr(loaded, name)
        for old, new in methods.items():
            own = vars(cls).get(old, new)
            if isinstance(new, str):
                assert callable(getattr(cls, new)) or isinstance(vars(cls).get(old, property()), property)
                docs = f"Retired: use `{new}`.", f"Retired: use `{new}()`."
                assert own is new or own.__doc__ in docs, f"{name}.{old} is not retired"
            elif isinstance(new, Now):
                assert own is new or own.__doc__ == f"Retired: use `{new.way}`.", f"{name}.{old} is not retired"
            else:
                assert own is new, f"{name}.{old} is not retired"


@pytest.mark.parametrize("module", [m for m in retired.FUNCTIONS])
def test_retired_functions_are_not_todays(module):
    loaded = importlib.import_module(module)
    assert not set(retired.FUNCTIONS[module]()) & set(loaded.__all__)


MULTIBODY = """
import numpy as np
from pydrake.all import *
from pydrake.multibody.tree import WeldJoint

plant = MultibodyPlant(1e-3)
plant.set_discrete_contact_solver(DiscreteContactSolver.kTamsi)
assert plant.get_discrete_contact_approximation() == DiscreteContactApproximation.kTamsi
inertia = SpatialInertia.SolidBoxWithMass(2.0, 0.1, 0.2, 0.3)
base, arm, hand = (plant.AddRigidBody(name, inertia) for name in ("base", "arm", "hand"))
plant.WeldFrames(A=plant.world_frame(), B=base.body_frame(), X_AB=RigidTransform([0.0, 0.0, 1.0]))
joint = plant.AddJoint(RevoluteJoint("joint", base.body_frame(), arm.body_frame(), [0, 0, 1], damping=0.3))
plant.AddJoint(WeldJoint(name="grip", parent_frame_P=arm.body_frame(), child_frame_C=hand.body_frame(),
                         X_PC=RigidTransform([1.0, 0.0, 0.0])))
assert joint.damping() == 0.3 and base.get_default_mass() == 2.0
plant.Finalize()
context = plant.CreateDefaultContext()
np.testing.assert_allclose(plant.CalcCenterOfMassPosition(context), [1 / 3, 0.0, 1.0])
print("done")
"""


def test_multibody_names_of_2021_work_with_hints():
    result = run(MULTIBODY)
    assert result.returncode == 0 and result.stdout == "done\n", result.stderr
    for hint in ("A is now frame_on_parent_F", "X_PC is now X_FM", "default_damping", "default_mass"):
        assert hint in result.stderr


CAMERA = """
import numpy as np
from pydrake.all import AddMultibodyPlantSceneGraph, DiagramBuilder, RigidTransform
from pydrake.geometry.render import (
    ClippingRange, DepthRange, DepthRenderCamera, MakeRenderEngineVtk, RenderCameraCore, RenderEngineVtkParams,
)
from pydrake.systems.sensors import CameraInfo, RgbdSensor

builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
plant.Finalize()
scene_graph.AddRenderer("renderer", MakeRenderEngineVtk(RenderEngineVtkParams()))
core = RenderCameraCore(
    "renderer", CameraInfo(width=64, height=48, fov_y=np.pi / 4), ClippingRange(near=0.1, far=10.0), RigidTransform()
)
depth_camera = DepthRenderCamera(core, DepthRange(0.1, 10))
X_PB = RigidTransform([1, 2, 3])
camera = RgbdSensor(scene_graph.world_frame_id(), X_PB=X_PB, depth_camera=depth_camera, show_window=False)
assert camera.depth_camera_info().width() == camera.color_camera_info().width() == 64
assert camera.X_PB().translation()[2] == 3 and camera.parent_frame_id() == scene_graph.world_frame_id()
assert camera.color_render_camera().core() is camera.depth_render_camera().core() is core
print("done")
"""


def test_cameras_of_2021_work_with_hints():
    result = run(CAMERA)
    assert result.returncode == 0 and result.stdout == "done\n", result.stderr
    for hint in ("pydrake.geometry.render", "default_depth_render_camera().core().intrinsics()", "default_X_PB"):
        assert hint in result.stderr
