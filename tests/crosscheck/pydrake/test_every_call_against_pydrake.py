"""All public calls whose arguments can be made from Drake's signatures give what they give in Drake."""

import warnings

import numpy as np
import pytest
from benchmarks.every_call import Sweep, same, signatures

import sheldrake.all as sheldrake

pydrake = pytest.importorskip("pydrake.all")
pytestmark = pytest.mark.peer

LIBRARIES = (sheldrake, pydrake)


@pytest.mark.parametrize(
    ("robot", "scalar"),
    [("arm", "numbers"), ("quadruped", "numbers"), ("humanoid", "numbers"), ("arm", "gradients"), ("arm", "symbols")],
)
def test_answers(robot, scalar):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sweep = Sweep(robot, scalar)
        asked = [title for title, _ in sweep.calls([], "")]
    assert sweep.differences == []
    assert len(asked) > (600 if scalar == "numbers" else 200)
    for call in (
        "plant.CalcMassMatrix(context)",
        "frame.CalcPoseInWorld(context)",
        "joint.AddInDamping(context, forces)",
    ):
        assert any(call in title for title in asked)


def test_a_wrong_answer_is_found(monkeypatch):
    """The comparison sees a number in the wrong place, and a call that fails."""
    joint = sheldrake.RevoluteJoint
    right = joint.get_angle
    monkeypatch.setattr(joint, "get_angle", lambda self, context: right(self, context) + 1e-4)
    monkeypatch.setattr(joint, "get_angular_rate", lambda self, context: 1 / 0)
    sweep = Sweep("arm", "numbers")
    assert [title for title, _ in sweep.calls(["joint"], "get_ang")] == ["arm, joint.get_angle(context)"]
    first, second = sweep.differences
    assert "get_angle(context)" in first and "instead of" in first and "ZeroDivisionError" in second


def test_answers_that_differ_are_told_apart():
    assert same(np.ones(2), [1.0, 1.0]) and not same(np.ones(2), np.ones(3)) and not same([1.0], [1.1])
    assert same("a", "a") and not same("a", "b") and not same(True, False) and not same(None, object())
    assert not same((1.0, "a"), (1.0, "b")) and not same(sheldrake.RigidTransform([1, 0, 0]), pydrake.RigidTransform())
    assert same(sheldrake.RigidTransform(), pydrake.RigidTransform())


def test_signatures_are_read_from_docstrings():
    found = {form.method: form.parameters for form in signatures(pydrake.MultibodyPlant)}
    assert [name for name, _ in found["CalcPointsPositions"]] == ["context", "frame_B", "p_BQi", "frame_A"]
    assert found["num_positions"] in ((), (("model_instance", "pydrake.multibody.tree.ModelInstanceIndex"),))
    assert "AddRigidBody" not in found and "Finalize" not in found


@pytest.mark.parametrize("kind", ["RungeKutta3Integrator", "RungeKutta2Integrator"])
def test_what_is_left_of_an_integrator_after_reset(kind):
    """Accuracy, first step and what happens at the smallest step stay; largest and smallest step and mode do not."""
    left = []
    for lib in LIBRARIES:
        system = lib.Integrator(2)
        context = system.CreateDefaultContext()
        made = getattr(lib, kind)
        integrator = made(system, context) if kind == "RungeKutta3Integrator" else made(system, 0.3, context)
        if kind == "RungeKutta3Integrator":
            integrator.set_target_accuracy(1e-3)
            integrator.request_initial_step_size_target(0.02)
            integrator.set_fixed_step_mode(True)
        integrator.set_maximum_step_size(0.5)
        integrator.set_requested_minimum_step_size(1e-8)
        integrator.set_throw_on_minimum_step_size_violation(False)
        integrator.Reset()
        left.append(
            [
                integrator.get_target_accuracy(),
                integrator.get_initial_step_size_target(),
                integrator.get_maximum_step_size(),
                integrator.get_requested_minimum_step_size(),
                integrator.get_fixed_step_mode(),
                integrator.get_throw_on_minimum_step_size_violation(),
            ]
        )
    np.testing.assert_array_equal(*left)


@pytest.mark.parametrize("scalar", [float, sheldrake.AutoDiffXd, sheldrake.Expression])
def test_contexts_and_values_of_one_system_are_apart(scalar):
    """New contexts, and values to compute into, begin as the first did, whatever became of that."""
    plant = sheldrake.MultibodyPlant(0.001)
    body = plant.AddRigidBody("body", sheldrake.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.AddJoint(sheldrake.PrismaticJoint("slider", plant.world_frame(), body.body_frame(), [1, 0, 0]))
    plant.Finalize()
    plant = {float: plant, sheldrake.AutoDiffXd: plant.ToAutoDiffXd(), sheldrake.Expression: plant.ToSymbolic()}[scalar]
    first = plant.CreateDefaultContext()
    before = str(plant.GetPositionsAndVelocities(first))
    values = plant.AllocateDiscreteVariables()
    untouched = str(values.get_vector().CopyToVector())
    plant.SetPositionsAndVelocities(first, np.array([scalar(1.0), scalar(2.0)]))
    values.get_mutable_vector().SetAtIndex(0, scalar(3.0))
    assert str(plant.GetPositionsAndVelocities(plant.CreateDefaultContext())) == before
    assert str(plant.AllocateDiscreteVariables().get_vector().CopyToVector()) == untouched


def test_state_of_a_model_instance_again_and_again():
    """The second call of a size has a quick way; both write and read the same numbers, and refuse the same ones."""
    for lib in LIBRARIES:
        plant = lib.MultibodyPlant(0.001)
        instances = [plant.AddModelInstance(name) for name in ("a", "b")]
        for k, instance in enumerate((*instances, instances[0])):
            inertia = lib.SpatialInertia.SolidSphereWithMass(1.0, 0.1)
            body = plant.AddRigidBody(f"body{k}", instance, inertia)
            plant.AddJoint(lib.PrismaticJoint(f"slider{k}", plant.world_frame(), body.body_frame(), [1, 0, 0]))
        plant.Finalize()
        context = plant.CreateDefaultContext()
        for x in ([1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]):
            plant.SetPositionsAndVelocities(context, instances[0], np.array(x))
            assert plant.GetPositionsAndVelocities(context, instances[0]).tolist() == x
            assert plant.GetPositionsAndVelocities(context).tolist() == [x[0], 0.0, x[1], x[2], 0.0, x[3]]
            for wrong in (np.array([1.0, 2.0, 3.0, np.nan]), np.ones(3)) if lib is sheldrake else ():  # Drake exits
                with pytest.raises(RuntimeError):
                    plant.SetPositionsAndVelocities(context, instances[0], wrong)
        assert plant.GetPositionsAndVelocities(context, instances[1]).tolist() == [0.0, 0.0]
        q = np.zeros(3)
        plant.SetPositionsInArray(instances[0], [1.0, 2.0], q)
        assert q.tolist() == [1.0, 0.0, 2.0] and plant.GetPositionsFromArray(instances[0], q).tolist() == [1.0, 2.0]


def test_inertia_of_other_bodies_after_each_other():
    """What is remembered of the bodies that were asked for last is of no others."""
    found = []
    for lib in LIBRARIES:
        plant = lib.MultibodyPlant(0.0)
        bodies = [plant.AddRigidBody(f"{k}", lib.SpatialInertia.SolidSphereWithMass(k + 1.0, 0.1)) for k in range(3)]
        plant.Finalize()
        context, frame = plant.CreateDefaultContext(), plant.world_frame()
        groups = [bodies[:2], bodies[:2], bodies[1:], bodies[:1], bodies]
        asked = [[body.index() for body in group] for group in groups]
        found.append([plant.CalcSpatialInertia(context, frame, indexes).get_mass() for indexes in asked])
        found[-1].append(plant.CalcTotalMass(context))
        with pytest.raises(RuntimeError, match="repeated"):
            plant.CalcSpatialInertia(context, frame, [bodies[0].index()] * 2)
        found[-1].append(plant.CalcSpatialInertia(context, frame, asked[-1]).get_mass())
    assert found[0] == pytest.approx(found[1]) and found[0] == pytest.approx([3, 3, 5, 1, 6, 6, 6])
