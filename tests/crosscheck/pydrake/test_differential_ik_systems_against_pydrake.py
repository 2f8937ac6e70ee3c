"""Recipes of differential inverse kinematics: the same velocities, the same motion of the controller."""

import numpy as np
import pytest
from tests.libraries import names_of

pytestmark = [pytest.mark.peer, pytest.mark.usefixtures("quiet")]
pytest.importorskip("pydrake")
pytest.importorskip("clarabel")

MODULES = (
    "math",
    "planning",
    "common.value",
    "multibody.inverse_kinematics",
    "multibody.math",
    "systems.framework",
    "systems.analysis",
)
AXES = ["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"]
INERTIA = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
WALL = f"""<robot name="wall"><link name="wall">{INERTIA}
  <collision><geometry><box size="0.1 1 1"/></geometry></collision></link></robot>"""
SOLVER = 3e-5  # OSQP, which Drake takes, stops at 1e-5.


def library(name):
    out = names_of(name, *MODULES)
    out.D = out.DifferentialInverseKinematicsSystem
    return out


OURS, THEIRS = library("sheldrake"), library("pydrake")


def arm(n):
    parts, parent = ['<robot name="arm"><link name="base"/>'], "base"
    for i in range(n):
        parts.append(f"""<link name="l{i}">{INERTIA}<collision><origin xyz="0 0 0.15"/>
            <geometry><sphere radius="0.05"/></geometry></collision></link>
          <joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="l{i}"/>
            <origin xyz="0 0 {0.3 if i else 0.1}"/><axis xyz="{AXES[i]}"/>
            <limit lower="-2" upper="2.5" velocity="{1.5 + 0.1 * i}" effort="10"/></joint>""")
        parent = f"l{i}"
    return "\n".join([*parts, "</robot>"])


def make(L, ingredients, n=4, wall=False, active=None, K_VX=1.0, limit=100.0):
    builder = L.RobotDiagramBuilder(time_step=0.0)
    builder.parser().AddModelsFromString(arm(n), "urdf")
    plant = builder.plant()
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    if wall:
        builder.parser().AddModelsFromString(WALL, "urdf")
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("wall"), L.RigidTransform([0.25, 0, 0.5]))
    robot = plant.GetModelInstanceByName("arm")
    checker = L.SceneGraphCollisionChecker(model=builder.Build(), robot_model_instances=[robot], edge_step_size=0.1)
    recipe = L.D.Recipe()
    for ingredient in ingredients:
        recipe.AddIngredient(ingredient)
    mask = L.DofMask(n, True) if active is None else L.DofMask(active)
    return L.D(recipe, "arm::base", checker, mask, 0.1, K_VX, L.SpatialVelocity(np.full(6, limit)))


def part(L, kind, *args, **config):
    cls = getattr(L.D, kind)
    return cls(cls.Config(**config), *args)


def velocity(L, system, q, nominal, desired):
    context = system.CreateDefaultContext()
    system.get_input_port_position().FixValue(context, q)
    system.get_input_port_nominal_posture().FixValue(context, nominal)
    bus, kinds = L.BusValue(), set()
    for frame, value in desired.items():
        bus.Set(frame, L.Value(value))
        kinds.add(type(value))
    poses, velocities = (
        system.get_input_port_desired_cartesian_poses,
        system.get_input_port_desired_cartesian_velocities,
    )
    (poses if kinds == {L.RigidTransform} else velocities)().FixValue(context, L.Value(bus))
    return system.get_output_port_commanded_velocity().Eval(context)


Q4, HOME4, NEAR = [0.1, 0.7, 0.3, -0.4], [0.3, -0.2, 0.5, 0.1], [0.1, 0.95, -0.96, -0.999]
Q6, HOME6 = [*Q4, 0.6, 0.2], [*HOME4, -0.4, 0.9]
V = np.array([0.1, 0.2, 0.3, 0.1, 0.15, 0.12])
PLACE = {"arm::l3": [0, 0, 0, 1, 1, 1]}
PLACE6 = {"arm::l5": [0, 0, 0, 1, 1, 1]}


def spatial(L, frame="arm::l3", V=V):
    return {frame: L.SpatialVelocity(V)}


def pose(L):
    return {"arm::l3": L.RigidTransform(L.RollPitchYaw(0.3, 0.2, -0.1), [0.1, 0.2, 0.8])}


def limits(L, n, speed=1.0, reach=1.0):
    one = np.ones(n)
    return L.JointLimits(-reach * one, reach * one, -speed * one, 1.1 * speed * one, -one, one)


def followed(L, **config):
    return part(L, "LeastSquaresCost", **config)


def centered(L, **config):
    return part(L, "JointCenteringCost", **config)


def slow(L, n, **kwargs):
    return part(L, "JointVelocityLimitConstraint", limits(L, n, **kwargs))


def in_box(L, lower, upper):
    return part(L, "CartesianPositionLimitConstraint", p_TG_next_lower=lower, p_TG_next_upper=upper)


def clear(L, **config):
    return part(L, "CollisionConstraint", **config)


def masked(L, weight, legacy=False, **config):
    cost = followed(L, cartesian_axis_masks=PLACE6, cartesian_qp_weight=weight, use_legacy_implementation=legacy)
    return [cost, centered(L, cartesian_axis_masks=PLACE6, **config)]


FAST = [0, 3, 0, 3, 0, 0]
CASES = {
    "followed": lambda L: velocity(L, make(L, [followed(L)]), Q4, HOME4, spatial(L)),
    "legacy": lambda L: velocity(L, make(L, [followed(L, use_legacy_implementation=True)]), Q4, HOME4, spatial(L)),
    "mask": lambda L: velocity(
        L,
        make(L, [followed(L, cartesian_axis_masks=PLACE), centered(L, cartesian_axis_masks=PLACE)]),
        Q4,
        HOME4,
        spatial(L, "l3"),
    ),
    "pose": lambda L: velocity(L, make(L, [followed(L)], K_VX=0.5), Q4, HOME4, pose(L)),
    "pose_clamped": lambda L: velocity(L, make(L, [followed(L)], limit=0.3), Q4, HOME4, pose(L)),
    "velocity_not_clamped": lambda L: velocity(L, make(L, [followed(L)], limit=0.01), Q4, HOME4, spatial(L)),
    "two_goals": lambda L: velocity(
        L, make(L, [followed(L)]), Q4, HOME4, spatial(L) | spatial(L, "arm::l1", [0, 0, 0.1, 0, 0, 0])
    ),
    "near_upper": lambda L: velocity(L, make(L, [followed(L), slow(L, 4)]), NEAR, HOME4, spatial(L, V=10 * V)),
    "near_lower": lambda L: velocity(L, make(L, [followed(L), slow(L, 4)]), NEAR, HOME4, spatial(L, V=-10 * V)),
    "narrow": lambda L: velocity(
        L, make(L, [followed(L), slow(L, 4, reach=0.05)]), [0.01, 0.04, -0.04, -0.03], HOME4, spatial(L, V=-10 * V)
    ),
    "passive": lambda L: velocity(
        L, make(L, [followed(L), centered(L)], active=[True, False, True, True]), Q4, HOME4, spatial(L)
    ),
    "box": lambda L: velocity(
        L, make(L, [followed(L), in_box(L, [-np.inf, -1, 0], [np.inf, 0.2, 0.62])]), Q4, HOME4, spatial(L)
    ),
    "slow_goal": lambda L: velocity(
        L,
        make(
            L,
            [
                followed(L),
                part(L, "CartesianVelocityLimitConstraint", V_next_TG_limit=[0.1, 0.1, 0.1, 0.05, 0.03, 0.02]),
            ],
        ),
        Q4,
        HOME4,
        spatial(L),
    ),
    "nullspace": lambda L: velocity(L, make(L, masked(L, 100.0), n=6), Q6, HOME6, spatial(L, "arm::l5")),
    "nullspace_limited": lambda L: velocity(
        L, make(L, [*masked(L, 2.0), slow(L, 6, speed=0.2)], n=6), Q6, HOME6, spatial(L, "arm::l5")
    ),
    "nullspace_gain": lambda L: velocity(
        L, make(L, [*masked(L, 2.0, posture_gain=0.3), slow(L, 6, speed=0.05)], n=6), Q6, HOME6, spatial(L, "arm::l5")
    ),
    "legacy_limited": lambda L: velocity(
        L, make(L, [*masked(L, 0.7, legacy=True), slow(L, 6, speed=0.7)], n=6), Q6, HOME6, spatial(L, "arm::l5")
    ),
    "wall": lambda L: velocity(
        L,
        make(L, [followed(L), clear(L, safety_distance=0.1, influence_distance=0.5)], wall=True),
        [0.1, -0.2, 0.3, -0.4],
        HOME4,
        spatial(L, V=FAST),
    ),
    "no_solution": lambda L: velocity(
        L,
        make(L, [followed(L), clear(L, safety_distance=0.16, influence_distance=0.5)], wall=True),
        [0.1, -0.2, 0.3, -0.4],
        HOME4,
        spatial(L, V=FAST),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_velocities_are_pydrakes(case):
    ours, theirs = CASES[case](OURS), CASES[case](THEIRS)
    assert np.abs(ours - theirs).max() < SOLVER * max(1.0, np.abs(theirs).max())


def test_a_planted_fault_is_caught():
    masks = {"cartesian_axis_masks": PLACE6}

    def other(L):
        ingredients = [followed(L, cartesian_qp_weight=2.05, **masks), centered(L, **masks), slow(L, 6, speed=0.2)]
        return velocity(L, make(L, ingredients, n=6), Q6, HOME6, spatial(L, "arm::l5"))

    assert np.abs(other(OURS) - CASES["nullspace_limited"](THEIRS)).max() > 10 * SOLVER


def follow(L):
    """Positions and velocities that the controller commands over ten steps, one position passive."""
    system = make(L, [followed(L), centered(L)], active=[True, False, True, True])
    controller = L.DifferentialInverseKinematicsController(system, planar_rotation_dof_indices=[0])
    context = controller.CreateDefaultContext()
    first = np.array(controller.GetOutputPort("commanded_position").Eval(context))
    controller.set_initial_position(context, [9.4, 9.0, 0.3, -0.4])
    controller.GetInputPort("estimated_state").FixValue(context, [0, 0.7, 0, 0, 0, 0, 0, 0])
    controller.GetInputPort("nominal_posture").FixValue(context, HOME4)
    bus = L.BusValue()
    bus.Set("arm::l3", L.Value(L.RigidTransform(L.RollPitchYaw(0.3, 0.2, -2.5), [-0.3, 0.1, 0.8])))
    controller.GetInputPort("desired_poses").FixValue(context, L.Value(bus))
    simulator, rows = L.Simulator(controller, context), [first]
    for k in range(1, 11):
        simulator.AdvanceTo(0.1 * k)
        rows += [
            np.array(controller.GetOutputPort(f"commanded_{word}").Eval(context)) for word in ("position", "velocity")
        ]
    ports = [controller.get_input_port(i).get_name() for i in range(3)]
    return ports, np.array(rows)


def test_the_controller_moves_as_pydrakes():
    ours, theirs = follow(OURS), follow(THEIRS)
    assert ours[0] == theirs[0]
    assert np.isnan(ours[1][0]).all() and np.isnan(theirs[1][0]).all()
    assert np.abs(theirs[1][1::2, 0]).max() < np.pi  # it was wrapped
    np.testing.assert_allclose(ours[1][1:], theirs[1][1:], atol=100 * SOLVER)
