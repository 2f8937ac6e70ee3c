"""A composed differential inverse kinematics: what it is asked, and what it refuses."""

import math

import numpy as np
import pytest

from sheldrake.common.value import Value
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics import (
    DifferentialInverseKinematicsController,
    DifferentialInverseKinematicsSystem,
)
from sheldrake.multibody.math import SpatialVelocity
from sheldrake.planning import DofMask, JointLimits, RobotDiagramBuilder, SceneGraphCollisionChecker
from sheldrake.systems.framework import BusValue

pytest.importorskip("clarabel")

System = DifferentialInverseKinematicsSystem
LINK = """<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>"""
SLIDER = f"""<robot name="slider"><link name="base"/>
  <link name="x">{LINK}</link>
  <link name="y">{LINK}<collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="jx" type="prismatic"><parent link="base"/><child link="x"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="jy" type="prismatic"><parent link="x"/><child link="y"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
WALL = f"""<robot name="wall"><link name="wall">{LINK}<collision><geometry><box size="0.2 2 2"/></geometry></collision>
  </link></robot>"""


def checker():
    builder = RobotDiagramBuilder(time_step=0.0)
    plant = builder.plant()
    builder.parser().AddModelsFromString(SLIDER, "urdf")
    builder.parser().AddModelsFromString(WALL, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("wall"), RigidTransform([1.0, 0, 0]))
    robot = plant.GetModelInstanceByName("slider")
    return SceneGraphCollisionChecker(model=builder.Build(), robot_model_instances=[robot], edge_step_size=0.1)


def make(*ingredients, **changed):
    recipe = System.Recipe()
    for ingredient in (System.LeastSquaresCost(System.LeastSquaresCost.Config()), *ingredients):
        recipe.AddIngredient(ingredient)
    given = {
        "recipe": recipe,
        "task_frame": "world",
        "collision_checker": checker(),
        "active_dof": DofMask(2, True),
        "time_step": 0.1,
        "K_VX": 1.0,
        "Vd_TG_limit": SpatialVelocity(np.full(6, 10.0)),
    }
    return System(**{**given, **changed})


def command(system, q, velocity, name="slider::y"):
    context = system.CreateDefaultContext()
    system.get_input_port_position().FixValue(context, q)
    system.get_input_port_nominal_posture().FixValue(context, [0.0, 0.0])
    bus = BusValue()
    bus.Set(name, Value(SpatialVelocity([0, 0, 0, *velocity])))
    system.get_input_port_desired_cartesian_velocities().FixValue(context, Value(bus))
    return system.get_output_port_commanded_velocity().Eval(context)


def velocity_limits(config, speed):
    one = np.ones(2)
    return System.JointVelocityLimitConstraint(config, JointLimits(-one, one, -speed * one, speed * one, -one, one))


def test_goal_frames_move_as_desired():
    assert command(make(), [0.1, 0.2], [0.3, -0.4, 5.0]) == pytest.approx([0.3, -0.4], abs=1e-6)


def test_speed_towards_a_limit_falls_to_zero():
    config = System.JointVelocityLimitConstraint.Config(min_margin=0.1, influence_margin=0.3)
    system = make(velocity_limits(config, 2.0))
    assert command(system, [0.0, -0.8], [9.0, -9.0, 0.0]) == pytest.approx([2.0, -1.0], abs=1e-6)
    assert command(system, [0.95, -0.8], [9.0, 9.0, 0.0]) == pytest.approx([0.0, 2.0], abs=1e-6)


def test_an_infinite_speed_is_zero_at_a_limit():
    system = make(velocity_limits(System.JointVelocityLimitConstraint.Config(), math.inf))
    assert command(system, [1.0, 0.5], [9.0, 9.0, 0.0]) == pytest.approx([0.0, 9.0], abs=1e-5)


def test_a_wall_is_not_run_into():
    near = System.CollisionConstraint(System.CollisionConstraint.Config(safety_distance=0.05, influence_distance=1.0))
    assert command(make(near), [0.5, 0.0], [9.0, 1.0, 0.0]) == pytest.approx([2.5, 1.0], abs=1e-5)


def test_distances_that_count_can_be_chosen():
    near = System.CollisionConstraint(System.CollisionConstraint.Config(safety_distance=0.05, influence_distance=1.0))
    seen = []

    def nearer(active_dof, clearance, distances, jacobians):
        seen.append((active_dof.count(), distances.shape))
        return clearance.distances() - 0.1, clearance.jacobians()

    near.SetSelectDataForCollisionConstraintFunction(nearer)
    system = make(near)
    assert command(system, [0.5, 0.0], [9.0, 1.0, 0.0]) == pytest.approx([1.5, 1.0], abs=1e-5)
    assert seen == [(2, (0,))]
    near.SetSelectDataForCollisionConstraintFunction(lambda *args: None)
    assert command(system, [0.5, 0.0], [9.0, 1.0, 0.0]) == pytest.approx([9.0, 1.0], abs=1e-5)


def test_no_solution_gives_zero_and_a_warning(caplog):
    Box = System.CartesianPositionLimitConstraint
    Slow = System.CartesianVelocityLimitConstraint
    box = Box(Box.Config(p_TG_next_lower=[5, 5, 0], p_TG_next_upper=[6, 6, 0]))
    with caplog.at_level("WARNING", logger="drake"):
        out = command(make(box, Slow(Slow.Config())), [0.0, 0.0], [1.0, 1.0, 0.0])
    assert np.array_equal(out, [0.0, 0.0])
    assert "Cartesian position limit[0]" in caplog.text


@pytest.mark.parametrize(
    "wrong",
    [
        {"time_step": 0.0},
        {"time_step": math.inf},
        {"K_VX": 0.0},
        {"Vd_TG_limit": SpatialVelocity(np.full(6, -1.0))},
        {"active_dof": DofMask(3, True)},
        {"recipe": None},
        {"collision_checker": None},
        {"task_frame": "nowhere"},
    ],
)
def test_arguments_out_of_range(wrong):
    with pytest.raises(RuntimeError):
        make(**wrong)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        ("LeastSquaresCost", {"cartesian_qp_weight": -1.0}),
        ("LeastSquaresCost", {"cartesian_axis_masks": {"a": [0] * 6}}),
        ("JointCenteringCost", {"posture_gain": math.inf}),
        ("JointCenteringCost", {"cartesian_axis_masks": {"a": [0.5] * 6}}),
        ("CartesianPositionLimitConstraint", {"p_TG_next_lower": [1, 0, 0]}),
        ("CartesianVelocityLimitConstraint", {"V_next_TG_limit": [-1, 0, 0, 0, 0, 0]}),
        ("CollisionConstraint", {"safety_distance": math.inf}),
        ("CollisionConstraint", {"influence_distance": -1.0}),
    ],
)
def test_settings_out_of_range_leave_the_old_ones(kind, wrong):
    cls = getattr(System, kind)
    ingredient = cls(cls.Config())
    before = repr(ingredient.GetConfig())
    with pytest.raises(RuntimeError, match=next(iter(wrong))):
        ingredient.SetConfig(cls.Config(**wrong))
    assert repr(ingredient.GetConfig()) == before


def test_settings_of_another_size_or_name():
    with pytest.raises(TypeError, match="6 numbers"):
        System.LeastSquaresCost.Config(cartesian_axis_masks={"a": [1] * 5})
    with pytest.raises(AttributeError, match="posture_gain"):
        System.JointCenteringCost.Config(gain=1.0)


def test_the_recipe_lists_its_ingredients():
    recipe = make().recipe()
    assert isinstance(recipe.ingredient(0), System.LeastSquaresCost) and recipe.num_ingredients() == 1
    with pytest.raises(RuntimeError, match="no ingredient 1"):
        recipe.ingredient(1)
    with pytest.raises(TypeError, match="Ingredient"):
        recipe.AddIngredient(3)
    with pytest.raises(TypeError, match="No constructor"):
        System.Ingredient()


def test_exactly_one_kind_of_goal():
    system = make()
    context = system.CreateDefaultContext()
    system.get_input_port_position().FixValue(context, [0.0, 0.0])
    system.get_input_port_nominal_posture().FixValue(context, [0.0, 0.0])
    with pytest.raises(RuntimeError, match="exactly one of the input ports"):
        system.get_output_port(0).Eval(context)
    with pytest.raises(RuntimeError, match="There is no Frame named 'foo'"):
        command(system, [0.0, 0.0], [0, 0, 0], "foo")


def test_the_controller_starts_from_the_position_it_is_given():
    controller = DifferentialInverseKinematicsController(make(), [])
    context = controller.CreateDefaultContext()
    assert np.isnan(controller.GetOutputPort("commanded_position").Eval(context)).all()
    controller.set_initial_position(context, [0.3, 0.4])
    assert controller.GetOutputPort("commanded_position").Eval(context) == pytest.approx([0.3, 0.4])
    with pytest.raises(RuntimeError, match="expected 2 positions"):
        controller.set_initial_position(context, [0.3])
