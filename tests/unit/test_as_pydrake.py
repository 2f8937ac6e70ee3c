"""The alias changes the process, so each test runs its own."""

import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]


def run(code, *options):
    env = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    return subprocess.run([sys.executable, *options, "-c", code], env=env, capture_output=True, text=True)


def check(code, *options):
    result = run(code, *options)
    assert result.returncode == 0, result.stderr
    return result


def test_modules_are_the_same_objects():
    check("""
import sheldrake.as_pydrake
import pydrake, pydrake.common.value, pydrake.forwarddiff
from pydrake.autodiffutils import AutoDiffXd
import pydrake.systems.framework as framework
import sheldrake, sheldrake.autodiffutils, sheldrake.systems.framework, sheldrake.forwarddiff
assert framework is sheldrake.systems.framework
assert pydrake.forwarddiff is sheldrake.forwarddiff
assert AutoDiffXd is sheldrake.autodiffutils.AutoDiffXd
assert pydrake.systems.framework.__spec__.name == "sheldrake.systems.framework"
assert sheldrake.autodiffutils.__name__ == "sheldrake.autodiffutils"
import pickle
assert pickle.loads(pickle.dumps(AutoDiffXd(1.0))) == 1.0
""")


def test_all_modules_roll_up():
    check("""
import sheldrake.as_pydrake
from pydrake.all import *
AutoDiffXd, jacobian, Value
import pydrake.all, sheldrake.all, pydrake.common.all
assert pydrake.all.Simulator is sheldrake.all.Simulator and "Value" in pydrake.common.all.__all__
""")


def test_everything_of_sheldrake_can_be_imported_under_its_pydrake_name():
    check("""
import importlib, pkgutil, sheldrake.as_pydrake, sheldrake
from sheldrake._pydrake.defaults import with_drakes_defaults
for info in pkgutil.walk_packages(sheldrake.__path__, "sheldrake."):
    if "__main__" in info.name or "cli" in info.name or "as_pydrake" in info.name:
        continue
    native = importlib.import_module(info.name)
    module = importlib.import_module(info.name.replace("sheldrake", "pydrake", 1))
    adapted = with_drakes_defaults(native)
    assert (module is native) == (not adapted), info.name
    for name in set(native.__all__ if adapted else ()) - set(adapted):
        assert getattr(module, name) is getattr(native, name), f"{info.name}.{name}"
""")


PAIRS = """
def contacts(lib, make):
    \"\"\"How many points a box that lies on the ground touches it in.\"\"\"
    builder = lib.DiagramBuilder()
    plant, scene_graph = make(lib, builder)
    body = plant.AddRigidBody("box", lib.SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.2))
    for owner, shape in ((plant.world_body(), lib.HalfSpace()), (body, lib.Box(0.2, 0.2, 0.2))):
        plant.RegisterCollisionGeometry(owner, lib.RigidTransform(), shape, "collision", lib.CoulombFriction(1.0, 1.0))
    plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    mine = plant.GetMyContextFromRoot(context)
    plant.SetFreeBodyPose(mine, body, lib.RigidTransform([0.0, 0.0, 0.0999]))
    return plant.get_contact_results_output_port().Eval(mine).num_point_pair_contacts()

def with_own(lib, builder):
    return lib.AddMultibodyPlantSceneGraph(builder, lib.MultibodyPlant(1e-3), lib.SceneGraph())

def of_family(lib, builder):
    return lib.AddMultibodyPlantSceneGraph(builder, lib.MultibodyPlant(1e-3), scene_graph=lib.SceneGraph_[float]())

def by_step(lib, builder):
    return lib.AddMultibodyPlantSceneGraph(builder, time_step=1e-3)

def by_config(lib, builder):
    return lib.AddMultibodyPlant(lib.MultibodyPlantConfig(), builder)
"""


def test_drakes_defaults_hold_for_what_is_built_by_names_of_pydrake():
    """And not for what the same program builds by names of sheldrake, before or after."""
    check(
        PAIRS
        + """
import sheldrake.as_pydrake, sheldrake.all, pydrake.all
for make in (with_own, of_family, by_step, by_config):
    for lib, expected in ((sheldrake.all, 4), (pydrake.all, 1), (sheldrake.all, 4)):
        assert contacts(lib, make) == expected, (make.__name__, lib.__name__, expected)
"""
    )


def test_a_scene_graph_that_is_given_is_as_it_was_made():
    check(
        PAIRS
        + """
import sheldrake.as_pydrake, sheldrake.geometry, pydrake.all

def mixed(lib, builder):
    return lib.AddMultibodyPlantSceneGraph(builder, lib.MultibodyPlant(1e-3), sheldrake.geometry.SceneGraph())

assert contacts(pydrake.all, mixed) == 4
"""
    )


def test_classes_with_drakes_defaults_make_sheldrakes_objects():
    check("""
import sheldrake.as_pydrake, sheldrake.geometry, sheldrake.planning
from pydrake.autodiffutils import AutoDiffXd
from pydrake.geometry import SceneGraph, SceneGraph_
from pydrake.planning import RobotDiagramBuilder
from pydrake.planning.robot_diagram import RobotDiagramBuilder as Retired
assert type(SceneGraph()) is sheldrake.geometry.SceneGraph and isinstance(SceneGraph(), SceneGraph)
assert isinstance(sheldrake.geometry.SceneGraph(), SceneGraph) and not isinstance(1, SceneGraph)
assert issubclass(sheldrake.geometry.SceneGraph, SceneGraph) and not issubclass(SceneGraph, RobotDiagramBuilder)
assert SceneGraph_[float] is SceneGraph and Retired is RobotDiagramBuilder
assert isinstance(SceneGraph_[AutoDiffXd](), SceneGraph_[AutoDiffXd])
assert SceneGraph.world_frame_id() == sheldrake.geometry.SceneGraph.world_frame_id()

class Mine(SceneGraph):
    def __init__(self, name):
        super().__init__()
        self.set_name(name)

mine = Mine("mine")
assert type(mine) is Mine and mine.get_name() == "mine" and not isinstance(SceneGraph(), Mine)
for made in (mine, SceneGraph(), RobotDiagramBuilder().scene_graph()):
    assert made._model.point_contact_algorithm == "single_point"
assert sheldrake.planning.RobotDiagramBuilder().scene_graph()._model.point_contact_algorithm == "multi_point"
""")


def test_names_are_also_where_drake_shows_them():
    check("""
import sheldrake.as_pydrake
from pydrake.systems.pyplot_visualizer import Trajectory
from pydrake.systems.scalar_conversion import Expression
import pydrake.symbolic, pydrake.trajectories
assert Trajectory is pydrake.trajectories.Trajectory and Expression is pydrake.symbolic.Expression
assert not hasattr(pydrake.systems.scalar_conversion, "Gain")
""")


def test_missing_names_are_named():
    check("""
import sheldrake.as_pydrake

def message(statement, kind):
    try:
        exec(statement, {})
    except kind as error:
        return f"{type(error).__name__}: {error}"
    raise AssertionError(statement)

text = message("import pydrake.multibody.fem", ImportError)
assert "pydrake.multibody.fem is a module of pydrake that sheldrake will not have: deformable" in text, text
text = message("import pydrake.nonsense", ImportError)
assert text == "ModuleNotFoundError: No module named 'pydrake.nonsense'", text
text = message("from pydrake.multibody.plant import DeformableModel", ImportError)
assert "pydrake.multibody.plant.DeformableModel is a name of pydrake that sheldrake" in text, text
text = message("from pydrake.forwarddiff import DeformableModel", ImportError)
assert "pydrake.forwarddiff has no DeformableModel; pydrake has it in pydrake.multibody.plant" in text, text
text = message("from pydrake.forwarddiff import nonsense", ImportError)
assert "cannot import name 'nonsense'" in text, text
text = message("import pydrake.multibody.plant as p; p.DeformableModel", AttributeError)
assert "pydrake.multibody.plant.DeformableModel" in text, text
text = message("import pydrake; pydrake.nonsense", AttributeError)
import pydrake.multibody.plant
assert not hasattr(pydrake.multibody.plant, "DeformableModel")
""")


def test_retired_names_work_with_one_hint():
    result = check("""
import sheldrake.as_pydrake
from pydrake.autodiffutils import initializeAutoDiff, autoDiffToGradientMatrix
x = initializeAutoDiff([1.0, 2.0])
x = initializeAutoDiff([1.0, 2.0])
assert autoDiffToGradientMatrix(x).tolist() == [[1, 0], [0, 1]]
""")
    assert result.stderr.count("initializeAutoDiff() is retired: use InitializeAutoDiff()") == 1
    assert "DrakeDeprecationWarning" in result.stderr


def test_retired_modules_lead_to_todays():
    result = check("""
import sheldrake.as_pydrake
import pydrake.geometry.render
from pydrake.geometry.render import RenderLabel
from pydrake.geometry import render
import pydrake.geometry
assert RenderLabel is pydrake.geometry.RenderLabel is render.RenderLabel
import pydrake.solvers.mathematicalprogram
""")
    assert "pydrake.geometry.render is retired: import from pydrake.geometry." in result.stderr


def test_modules_of_earlier_years_import():
    check("""
import sheldrake.as_pydrake, warnings
warnings.simplefilter("ignore")
from pydrake.manipulation.kuka_iiwa import IiwaCommandReceiver
from pydrake.manipulation.schunk_wsg import SchunkWsgPositionController
from pydrake.manipulation.planner import DifferentialInverseKinematicsIntegrator
from pydrake.systems.trajectory_optimization import DirectCollocation
from pydrake.planning.trajectory_optimization import KinematicTrajectoryOptimization
from pydrake.solvers.augmented_lagrangian import AugmentedLagrangianSmooth
from pydrake.systems.framework import AbstractValue
import pydrake.planning, pydrake.common.value
assert DirectCollocation is pydrake.planning.DirectCollocation and AbstractValue is pydrake.common.value.AbstractValue
try:
    import pydrake.examples.manipulation_station
except ModuleNotFoundError as error:
    assert str(error).startswith("Drake removed pydrake.examples.manipulation_station, with ManipulationStation; use")
else:
    raise AssertionError
""")


def test_retired_methods_reach_their_classes():
    """A made-up module stands for the real ones, each of which has its own tests."""
    check("""
import types, warnings
from sheldrake._pydrake import retired
class Simulator:
    def AdvanceTo(self, t, *, interruptible=True): return t, interruptible
module = types.ModuleType("sheldrake.systems.analysis")
module.Simulator = Simulator
retired.install(module)
with warnings.catch_warnings(record=True) as seen:
    warnings.simplefilter("always")
    assert Simulator().StepTo(2.0, interruptible=False) == (2.0, False)
assert len(seen) == 1 and "use AdvanceTo()" in str(seen[0].message), seen
assert seen[0].filename == "<string>"  # The hint points at the caller.
""")


@pytest.mark.peer
def test_the_alias_wins_over_an_installed_drake():
    pytest.importorskip("pydrake")
    check("""
import sheldrake.as_pydrake, pydrake, pydrake.autodiffutils
assert not hasattr(pydrake, "__file__") and "sheldrake" in pydrake.autodiffutils.__file__
""")
    result = run("import pydrake, sheldrake.as_pydrake")
    assert result.returncode == 1 and "pydrake is already imported" in result.stderr


@pytest.mark.peer
def test_the_list_of_pydrakes_names_is_drakes():
    pytest.importorskip("pydrake")
    import json

    from tests.crosscheck.pydrake import pydrake_names

    listed = json.loads(pydrake_names.TABLE.read_text())
    assert listed == pydrake_names.table()
    assert "Simulator" in listed["pydrake.systems.analysis"]


def test_names_that_will_not_come_say_why():
    check("""
import sheldrake.as_pydrake
import sheldrake.multibody.plant as plant
import sheldrake.multibody.tree as tree
from sheldrake._pydrake import names as pydrake_names
from sheldrake.as_pydrake import missing_name

text = missing_name("pydrake.multibody.plant", "DeformableModel")
assert text.endswith("will not have: deformable bodies are out of sheldrake's scope."), text
for names in pydrake_names.NOT_PLANNED.values():
    for name in names:
        assert pydrake_names.modules_with(name) or pydrake_names.is_module(name), name
        assert not hasattr(plant, name) and not hasattr(tree, name), name
""")


@pytest.mark.parametrize("name", ["ManipulationStation", "RigidBodyTree", "SchunkWsgButtons"])
def test_what_drake_removed_says_what_to_use(name):
    check(f"""
from sheldrake.as_pydrake import missing_name

text = missing_name("pydrake.examples", "{name}")
assert text.startswith("Drake removed {name}: use "), text
""")


def test_numpy_comes_with_all():
    """As with Drake's own, whose modules import it; and only with pydrake.all."""
    check("""
import sheldrake.all
names = {}
exec("from sheldrake.all import *", names)
assert "np" not in names and "os" not in names
import sheldrake.as_pydrake
exec("from pydrake.all import *", names)
assert names["np"].eye(2).sum() == 2.0 and names["math"].pi > 3 and names["os"].sep
assert names["partial"](max, 3)(2) == 3 and names["List"][int] == list[int] and names["TemplateClass"]("T")
assert callable(names["getDrakePath"])
import sys
assert "display" not in names and "IPython" not in sys.modules
""")


def test_a_notebooks_display_comes_with_all():
    pytest.importorskip("IPython")
    check("""
import IPython.display
import sheldrake.as_pydrake
names = {}
exec("from pydrake.all import *", names)
assert names["SVG"] is IPython.display.SVG and names["display"] is IPython.display.display
assert names["get_ipython"] is IPython.get_ipython
""")


def test_messages_are_found_where_drake_has_them_without_drake():
    check("""
import importlib.machinery
find = importlib.machinery.PathFinder.find_spec
importlib.machinery.PathFinder.find_spec = lambda name, path=None, target=None: (
    None if name == "drake" else find(name, path, target)
)
import sheldrake.as_pydrake
import drake
from drake import lcmt_iiwa_command, lcmt_robot_plan
from sheldrake.lcm._messages import lcmt_iiwa_command as native
assert lcmt_iiwa_command is native and drake.lcmt_quaternion(w=1.0).w == 1.0
try:
    from drake import lcmt_teapot
except ImportError as error:
    assert "lcmt_teapot" in str(error)
else:
    raise AssertionError
""")
