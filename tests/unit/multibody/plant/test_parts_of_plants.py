"""Each part of a plant works with the parts it takes, and without those that come after it."""

import ast
import pathlib
import re
import types

import numpy as np
import pytest
from tests.unit.common.counting import calls_of

import sheldrake.multibody.plant
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import ContactModel, MultibodyPlant
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.finalize import freeze
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._building.surface_axes import SurfaceAxes
from sheldrake.multibody.plant._building.topology import Topology
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.coordinates import Coordinates
from sheldrake.multibody.plant._context.kinematics import Kinematics
from sheldrake.multibody.plant._parts import PlantParts, parts_of
from sheldrake.multibody.tree import QuaternionFloatingJoint, RevoluteJoint, default_model_instance
from sheldrake.systems.framework import LeafSystem

FOLDER = pathlib.Path(sheldrake.multibody.plant.__file__).parent


class Owner(types.SimpleNamespace):
    """Stands for the parts of a plant that elements know."""

    def __init__(self):
        super().__init__(plant=LeafSystem(), family=object())


@pytest.fixture
def elements():
    """A pendulum: an arm of 1 m hangs on the world."""
    owner = Owner()
    owner.elements = elements = Elements(owner)
    arm = elements.add_body("arm", (SpatialInertia.SolidSphereWithMass(1.0, 0.1),), {})
    elements.AddJoint(RevoluteJoint("swing", elements.world_frame(), arm.body_frame(), [0.0, 1.0, 0.0]))
    return elements


def test_the_plant_has_one_base():
    assert MultibodyPlant.__bases__ == (LeafSystem,)


def test_elements_alone(elements):
    assert [body.name() for body in elements.bodies] == ["world", "arm"]
    assert elements.GetJointByName("swing").parent_body() is elements.world_body()
    assert not elements.is_finalized()
    with pytest.raises(RuntimeError, match=r"GetPositions.*pre-finalize"):
        elements.model("GetPositions")


def test_a_model_without_a_system(elements):
    model = freeze(elements, QuaternionFloatingJoint)
    assert (model.nq, model.nv, model.nu, model.num_bodies) == (1, 1, 0, 2)
    assert model.row_of(elements.GetBodyByName("arm")) == 1
    assert model.default_positions().tolist() == [0.0]
    elements.finalize(model)
    with pytest.raises(RuntimeError, match=r"AddModelInstance.*post-finalize"):
        elements.AddModelInstance("late")


def test_a_body_without_a_joint_floats_where_it_is_said(elements):
    elements.add_body("free", (SpatialInertia.SolidSphereWithMass(1.0, 0.1),), {})

    def base_joint(name, body):
        joint = QuaternionFloatingJoint(name, elements.world_frame(), body.body_frame())
        joint.SetDefaultPose(RigidTransform([1.0, 2.0, 3.0]))
        return joint

    model = freeze(elements, base_joint)
    assert model.default_positions().tolist() == [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]


def test_settings_alone(elements):
    settings = Settings(elements, 0.0)
    settings.set_contact_model(ContactModel.kPoint)
    assert settings.get_contact_model() is ContactModel.kPoint
    with pytest.raises(RuntimeError, match="continuous"):
        settings.SetUseSampledOutputPorts(True)


def test_topology_alone(elements):
    assert [[b.name() for b in group] for group in Topology(elements).welded_groups()] == [["world"], ["arm"]]


def test_kinematics_on_a_system_that_is_no_plant(elements):
    system = elements._owner.plant
    elements.finalize(freeze(elements, {}))
    contexts = Contexts(system, elements, elements._owner.family, False, SurfaceAxes(elements))
    contexts.declare()
    context = system.CreateDefaultContext()
    Coordinates(elements, contexts).SetPositions(context, [0.5])
    arm = elements.GetBodyByName("arm")
    R_WB = Kinematics(elements, contexts).EvalBodyPoseInWorld(context, arm).rotation().matrix()
    assert R_WB[0, 2] == pytest.approx(np.sin(0.5), abs=1e-15)


def test_copies_have_parts_of_their_own_and_the_same_arrays():
    plant = MultibodyPlant(0.0)
    plant.AddRigidBody("box", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.Finalize()
    mine, its = parts_of(plant), parts_of(plant.ToAutoDiffXd())
    assert its.family is mine.family
    assert its.elements is not mine.elements
    assert its.elements.GetBodyByName("box")._owner is its
    model, copied = mine.elements.model("test"), its.elements.model("test")
    assert copied.tree is model.tree
    assert copied.row_bodies[1] is its.elements.GetBodyByName("box")
    assert its.plant.num_positions(default_model_instance()) == 7


def sources(*folders):
    for folder in folders:
        for path in (FOLDER / folder).rglob("*.py"):
            if "_kernels" not in path.parts:
                yield path.name, path.read_text(encoding="utf-8")


def test_parts_know_each_other_by_public_names():
    names = "|".join(set(vars(PlantParts(LeafSystem(), 0.0))) - {"plant", "family"})
    reach = re.compile(rf"\b(?:self\._?|parts\.)(?:{names})\._[a-z]")
    assert reach.search("self._elements._bodies")
    for name, text in sources("."):
        found = [line for line in text.splitlines() if reach.search(line)]
        assert not found, f"{name} uses private names of another part: {found}"


def test_no_part_knows_the_plant():
    for name, text in sources("_building", "_context", "_contact", "_step"):
        imports = [node.module or "" for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
        assert not any(module.endswith(("._multibody_plant", "plant._parts")) for module in imports), name


def test_a_model_instance_costs_the_same_however_many_there_are():
    def finalized(count):
        plant = MultibodyPlant(0.0)
        for i in range(count):
            plant.AddRigidBody(
                "body", plant.AddModelInstance(f"model {i}"), SpatialInertia.SolidSphereWithMass(1.0, 0.1)
            )
        plant.Finalize()
        context = plant.CreateDefaultContext()
        for i in plant.GetFloatingBaseBodies():
            plant.get_body(i).SetMass(context, 2.0)

    assert calls_of(lambda: finalized(40)) < 2.4 * calls_of(lambda: finalized(20))


def test_a_name_of_a_model_instance_is_free_when_it_was_renamed():
    plant = MultibodyPlant(0.0)
    first = plant.AddModelInstance("first")
    plant.RenameModelInstance(first, "other")
    assert not plant.HasModelInstanceNamed("first") and plant.GetModelInstanceByName("other") == first
    assert plant.AddModelInstance("first") == plant.GetModelInstanceByName("first") != first


def test_one_angle_is_few_calls():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", plant.AddModelInstance("model"), SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    joint = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0.0, 0.0, 1.0]))
    plant.Finalize()
    context, values = plant.CreateDefaultContext(), np.array([0.5])
    instance = plant.GetModelInstanceByName("model")
    for _ in range(2):  # a view of the context, and its builtin functions
        plant.SetPositions(context, values)
    assert calls_of(lambda: plant.SetPositions(context, instance, values)) <= 12
    assert calls_of(lambda: joint.get_angle(context)) <= 11
