"""A simulation as a Gymnasium environment: the rules of Gymnasium, and the same episodes as pydrake's."""

import numpy as np
import pytest
from tests.libraries import names_of

pytest.importorskip("gymnasium")

MODULES = ("gym", "systems.analysis", "systems.framework", "systems.primitives", "examples")


def library(name):
    return names_of(name, *MODULES)


def swing(lib, **options):
    """A pendulum with a torque as the action; the episode ends when it is upright."""
    import gymnasium

    builder = lib.DiagramBuilder()
    pendulum = builder.AddSystem(lib.PendulumPlant())
    builder.ExportInput(pendulum.get_input_port(), "torque")
    builder.ExportOutput(pendulum.get_output_port(), "state")
    diagram = builder.Build()
    simulator = lib.Simulator(diagram)

    def monitor(root):
        if root.get_continuous_state_vector()[0] > 3.0:
            return lib.EventStatus.ReachedTermination(diagram, "upright")
        return lib.EventStatus.DidNothing()

    simulator.set_monitor(monitor)
    given = {
        "time_step": 0.05,
        "action_space": gymnasium.spaces.Box(-5.0, 5.0, (1,), np.float64),
        "observation_space": gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64),
        "reward": lambda system, context: -float(context.get_continuous_state_vector().CopyToVector() @ [1.0, 0.1]),
        "action_port_id": "torque",
        "reset_handler": lambda simulator, context, seed: context.SetContinuousState([0.1, 0.0]),
        "info_handler": lambda simulator: {"time": simulator.get_context().get_time()},
        **options,
    }
    return lib.DrakeGymEnv(simulator, **given)


def episode(env, actions):
    rows = [env.reset(seed=7)]
    for action in actions:
        rows.append(env.step(np.array([action])))
        if rows[-1][2] or rows[-1][3]:
            break
    return rows


def test_obeys_the_rules_of_gymnasium():
    from gymnasium.utils.env_checker import check_env

    lib = library("sheldrake")
    check_env(swing(lib), skip_render_check=True)
    assert swing(lib, observation_space=None).observation_space.shape == (2,)


def test_an_episode_goes_on_until_the_monitor_ends_it():
    rows = episode(swing(library("sheldrake")), [4.9] * 200)
    assert rows[-1][2:4] == (True, False) and rows[-1][0][0] > 3.0
    assert 10 < len(rows) < 200
    times = [info["time"] for *_, info in rows]
    np.testing.assert_allclose(np.diff(times)[:-1], 0.05, rtol=1e-12)


@pytest.mark.peer
def test_episodes_are_those_of_pydrake():
    pytest.importorskip("pydrake")
    actions = 3.0 * np.sin(np.arange(60))
    mine, drakes = (episode(swing(library(name)), actions) for name in ("sheldrake", "pydrake"))
    assert len(mine) == len(drakes) == 61
    for a, b in zip(mine[1:], drakes[1:]):
        np.testing.assert_allclose(a[0], b[0], atol=2e-4)  # both integrators' accuracy
        assert a[1] == pytest.approx(b[1], abs=2e-4) and a[2:4] == b[2:4]
    pushed = episode(swing(library("sheldrake")), actions + 0.05)
    assert np.abs(pushed[-1][0] - drakes[-1][0]).max() > 1e-2  # another torque is noticed


def test_random_states_follow_the_seed():
    import gymnasium

    from sheldrake.gym import DrakeGymEnv
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia
    from sheldrake.symbolic import Variable
    from sheldrake.systems.analysis import Simulator

    made = []

    def make(generator):
        plant = MultibodyPlant(1e-2)
        body = plant.AddRigidBody("rod", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 1.0))
        joint = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0.0, 0.0, 1.0]))
        joint.set_random_angle_distribution(Variable("angle", Variable.Type.RANDOM_UNIFORM))
        plant.AddJointActuator("motor", joint)
        plant.Finalize()
        made.append(Simulator(plant))
        return made[-1]

    action, space = (gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float64) for size in (1, 2))
    env = DrakeGymEnv(
        make, 0.1, action, space, reward=lambda *_: 1.0, action_port_id="actuation", observation_port_id="state"
    )
    first, again, other = (env.reset(seed=seed)[0][0] for seed in (3, 3, 4))
    assert first == again != other and len(made) == 3
    assert all(0.0 < angle < 1.0 for angle in (first, other))


def test_an_error_in_a_step_cuts_the_episode_short():
    env = swing(library("sheldrake"))
    env.reset(seed=1)
    with pytest.warns(UserWarning, match="cut short"):
        observation, reward, ended, cut, info = env.step(np.array([np.nan]))
    assert (reward, ended, cut, info) == (0, False, True, {})
    np.testing.assert_array_equal(observation, [0.1, 0.0])


def test_wrong_arguments_say_what_is_wanted():
    import gymnasium

    lib = library("sheldrake")
    for wrong, words in (
        ({"time_step": 0.0}, "time_step must be positive"),
        ({"reward": 3.0}, "reward must be a function or an output port"),
        ({"reward": "state"}, "one number"),
        ({"render_mode": "video"}, "render_mode must be one of"),
        ({"info_handler": 1}, "info_handler must be a function"),
    ):
        with pytest.raises(ValueError, match=words):
            swing(lib, **wrong)
    simulator, spaces = swing(lib).simulator, gymnasium.spaces
    for wrong in (spaces.Box(-1.0, 1.0, (9,)), spaces.Box(-1.0, 1.0, ()), spaces.Discrete(3)):
        with pytest.raises(ValueError, match=r"action_space has shape .* and port '\w+' size 1"):
            lib.DrakeGymEnv(simulator, 0.1, wrong, None, lambda *_: 0.0)
    with pytest.raises(ValueError, match="a Simulator or a function"):
        lib.DrakeGymEnv(3, 0.1, None, None, lambda *_: 0.0)
    with pytest.raises(gymnasium.error.Error, match="no port for the action"):
        lib.DrakeGymEnv(lib.Simulator(lib.ConstantVectorSource([1.0])), 0.1, None, None, lambda *_: 0.0)
    with pytest.raises(RuntimeError, match=r"call reset\(\) first"):
        lib.DrakeGymEnv(lambda g: None, 0.1, 1, 1, lambda *_: 0.0).step(0)


def test_render_modes():
    lib = library("sheldrake")
    assert "Context" in swing(lib, render_mode="ansi").render()
    assert swing(lib).render() is None
    with pytest.raises(RuntimeError, match="render_rgb_port_id"):
        swing(lib, render_mode="rgb_array").render()
