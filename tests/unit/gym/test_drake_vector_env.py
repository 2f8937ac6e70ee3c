"""Vector environments: Gymnasium's rules of autoreset, and episodes that do not depend on how many there are."""

import importlib.util
import sys
import types

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.vector import AutoresetMode  # noqa: E402

from sheldrake.common.kernel import jit_enabled  # noqa: E402
from sheldrake.gym import DrakeVectorEnv, StableBaselinesVecEnv, Streams, _adapters  # noqa: E402
from sheldrake.systems.framework import DiagramBuilder  # noqa: E402
from sheldrake.systems.primitives import DiscreteTimeIntegrator  # noqa: E402

TASKS = ["CartPoleSwingUp", "QuadrupedStand", "ArmReach"]
compiled = pytest.mark.skipif(not jit_enabled(), reason="takes minutes as Python")


def counters(num_envs=3, first=(0.0, 1.0, 2.0), **options):
    """Environments whose state counts steps from `first`; an episode ends at 3."""
    builder = DiagramBuilder()
    integrator = builder.AddSystem(DiscreteTimeIntegrator(1, 1.0))
    builder.ExportInput(integrator.get_input_port())
    builder.ExportOutput(integrator.get_output_port())

    def reset_state(batch, worlds, streams):
        batch.states()[worlds, 0] = np.asarray(first)[worlds]

    return DrakeVectorEnv(
        builder.Build(),
        num_envs,
        reward=lambda batch, actions: 10.0 * batch.states()[:, 0],
        reset_state=reset_state,
        terminated=lambda batch: batch.states()[:, 0] >= 3.0,
        **options,
    )


def steps(env, count):
    """Observations, rewards, ends and infos of steps with an action of 1."""
    found = []
    for _ in range(count):
        observations, rewards, ended, _, infos = env.step(np.ones((env.num_envs, 1)))
        found.append((observations[:, 0].tolist(), rewards.tolist(), ended.tolist(), infos))
    return found


def test_next_step():
    env = counters()
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    observations, _ = env.reset(seed=1)
    assert observations[:, 0].tolist() == [0, 1, 2]
    one, two, three = steps(env, 3)
    assert one[:3] == ([1, 2, 3], [10, 20, 30], [False, False, True])
    assert two[:3] == ([2, 3, 2], [20, 30, 0], [False, True, False])  # the third begins anew
    assert three[:3] == ([3, 1, 3], [30, 0, 30], [True, False, True])


def test_same_step():
    env = counters(autoreset_mode=AutoresetMode.SAME_STEP)
    env.reset(seed=1)
    one, two = steps(env, 2)
    assert one[:3] == ([1, 2, 2], [10, 20, 30], [False, False, True])
    assert one[3]["final_obs"][2, 0] == 3 and one[3]["_final_obs"].tolist() == [False, False, True]
    assert two[:3] == ([2, 1, 2], [20, 30, 30], [False, True, True])


def test_disabled():
    env = counters(autoreset_mode="Disabled")
    env.reset(seed=1)
    steps(env, 1)
    with pytest.raises(RuntimeError, match=r"\[2\] are over; call reset"):
        steps(env, 1)
    observations, _ = env.reset(options={"reset_mask": np.array([False, False, True])})
    assert observations[:, 0].tolist() == [1, 2, 2]
    assert steps(env, 1)[0][0] == [2, 3, 3]
    for options in ({"reset_mask": np.ones(2, bool)}, {"reset_mask": np.zeros(3, bool)}, {"other": 1}):
        with pytest.raises(ValueError, match="reset_mask"):
            env.reset(options=options)


def test_truncation_is_not_an_end():
    env = counters(first=(-9.0, 1.0, 2.0), max_episode_steps=2)
    env.reset(seed=1)
    env.step(np.ones((3, 1)))
    *_, ended, truncated, _ = env.step(np.ones((3, 1)))
    assert ended.tolist() == [False, True, False] and truncated.tolist() == [True, False, False]


def test_a_world_that_fails_is_truncated_and_begins_anew():
    env = gymnasium.make_vec("sheldrake/CartPoleSwingUp-v0", num_envs=4).unwrapped
    env.reset(seed=1)
    before = env._observe()
    actions = np.zeros((4, 1))
    actions[2] = np.nan
    observations, rewards, ended, truncated, _ = env.step(actions)
    assert truncated.tolist() == [False, False, True, False] and not ended.any() and np.isfinite(rewards).all()
    np.testing.assert_array_equal(observations[2], before[2])
    assert [f.world for f in env.batch.failures] == [2]
    env.step(np.zeros((4, 1)))
    assert env.batch.failures == []


def test_reset_must_come_first():
    with pytest.raises(RuntimeError, match="reset"):
        counters().step(np.ones((3, 1)))


@compiled
@pytest.mark.parametrize("task", TASKS)
def test_an_episode_does_not_depend_on_the_others(task):
    """Bit by bit, whatever the number of environments and threads."""
    found = []
    for count, threads in ((3, 1), (6, 2)):
        env = gymnasium.make_vec(f"sheldrake/{task}-v0", num_envs=count, num_threads=threads)
        env.reset(seed=11)
        actions = np.random.default_rng(0).uniform(-1, 1, (20, 3, *env.single_action_space.shape))
        episode = []
        for action in actions:
            observations, rewards, *_ = env.step(np.resize(action, env.action_space.shape))
            episode.append((observations[:3].copy(), rewards[:3].copy()))
        found.append(episode)
    for (x, r), (y, s) in zip(*found):
        assert x.tobytes() == y.tobytes() and r.tobytes() == s.tobytes()


@compiled
@pytest.mark.parametrize("task", TASKS)
def test_tasks_keep_to_their_spaces(task):
    env = gymnasium.make_vec(f"sheldrake/{task}-v0", num_envs=5)
    observations, infos = env.reset(seed=2)
    assert infos == {} and observations in env.observation_space
    env.action_space.seed(3)
    for _ in range(30):
        observations, rewards, ended, truncated, _ = env.step(env.action_space.sample())
        assert observations in env.observation_space and rewards.shape == ended.shape == truncated.shape == (5,)
    first, _ = env.reset(seed=2)
    again, _ = env.reset(seed=2)
    assert np.array_equal(first, again) and not np.array_equal(first, env.reset()[0])


@compiled
def test_the_quadruped_stands_when_nothing_is_done():
    env = gymnasium.make_vec("sheldrake/QuadrupedStand-v0", num_envs=8)
    env.reset(seed=1)
    for _ in range(249):
        _, rewards, ended, truncated, _ = env.step(np.zeros((8, 12)))
        assert not ended.any() and not truncated.any()
    assert np.all(rewards > 0.95)
    assert env.step(np.zeros((8, 12)))[3].all()


def test_the_arm_sees_its_point_and_is_rewarded_where_its_tip_is():
    """The reward's formula against poses of the plant."""
    env = gymnasium.make_vec("sheldrake/ArmReach-v0", num_envs=6).unwrapped
    env.reset(seed=4)
    observations, rewards, *_ = env.step(np.zeros((6, 3)))
    assert len(np.unique(observations[:, 6:], axis=0)) == 6
    diagram = env.batch.get_system()
    (plant,) = (s for s in diagram.GetSystems() if hasattr(s, "GetFrameByName"))
    for w in range(6):
        context = plant.GetMyContextFromRoot(env.batch.context(w))
        tip = plant.GetFrameByName("end2").CalcPoseInWorld(context).translation()[:2]
        np.testing.assert_allclose(rewards[w], -np.linalg.norm(tip - observations[w, 6:]), rtol=1e-12)


def test_streams_are_even_and_their_own():
    streams = Streams(range(1000))
    numbers = streams.uniform(np.arange(1000), -1.0, 3.0, 50)
    assert numbers.min() >= -1.0 and numbers.max() < 3.0 and len(np.unique(numbers)) == numbers.size
    # mean 1 and variance 16/12 of 50,000 numbers: five standard errors
    assert abs(numbers.mean() - 1.0) < 5 * np.sqrt(16 / 12 / 50_000)
    assert abs(np.corrcoef(numbers[:-1].ravel(), numbers[1:].ravel())[0, 1]) < 5 / np.sqrt(50_000)
    one = Streams([7])
    assert np.array_equal(np.hstack([one.uniform(np.array([0]), -1.0, 3.0, 25) for _ in range(2)])[0], numbers[7])


@compiled
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.filterwarnings("ignore:.*WARN")
def test_tasks_obey_the_rules_of_gymnasium(task):
    """One world by Gymnasium's own checker; many by what it asks of each: spaces, seeds, wrappers of vectors."""
    from gymnasium.utils.env_checker import check_env
    from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

    one = gymnasium.make(f"sheldrake/{task}-v0")
    check_env(one.unwrapped, skip_render_check=True)
    env = RecordEpisodeStatistics(NormalizeObservation(gymnasium.make_vec(f"sheldrake/{task}-v0", num_envs=3)))
    env.action_space.seed(1)
    observations, _ = env.reset(seed=5)
    assert env.unwrapped.observation_space.contains(env.unwrapped._observe())
    for _ in range(3):
        action = env.action_space.sample()
        observations, rewards, ended, truncated, _ = env.step(action)
    assert observations.shape == env.observation_space.shape and rewards.shape == ended.shape == truncated.shape == (3,)
    alone, _ = one.reset(seed=6)
    many, _ = gymnasium.make_vec(f"sheldrake/{task}-v0", num_envs=3).reset(seed=5)
    assert np.array_equal(alone, many[1])


def test_one_environment_draws_nothing():
    with pytest.raises(ValueError, match="render_mode must be None, not 'human'"):
        gymnasium.make("sheldrake/ArmReach-v0", render_mode="human")


def test_stable_baselines_needs_episodes_that_begin_in_the_same_step():
    with pytest.raises(ValueError, match="autoreset_mode='SameStep'"):
        StableBaselinesVecEnv(counters())


@pytest.fixture
def vec_env_base(monkeypatch):
    """stable-baselines3 where it is installed; else a base class with its constructor's part in the bargain."""
    _adapters._adapter.cache_clear()
    if importlib.util.find_spec("stable_baselines3") is None:

        class VecEnv:
            def __init__(self, num_envs, observation_space, action_space):
                self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
                self._reset_seeds()
                self._reset_options()

            def seed(self, seed):
                self._seeds = [seed + i for i in range(self.num_envs)]

            def step(self, actions):
                self.step_async(actions)
                return self.step_wait()

        names = ("stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env")
        for name in names:
            monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        sys.modules[names[-1]].VecEnv = VecEnv
    yield
    _adapters._adapter.cache_clear()


@pytest.mark.usefixtures("vec_env_base")
def test_stable_baselines_sees_ends_and_what_was_last():
    env = StableBaselinesVecEnv(counters(autoreset_mode="SameStep", max_episode_steps=2))
    env.seed(3)
    assert env.reset()[:, 0].tolist() == [0, 1, 2]
    observations, rewards, over, infos = env.step(np.ones((3, 1)))
    assert observations[:, 0].tolist() == [1, 2, 2] and over.tolist() == [False, False, True]
    assert rewards.dtype == np.float32 and rewards.tolist() == [10, 20, 30]
    assert infos[0] == {} and infos[2]["terminal_observation"] == [3.0] and not infos[2]["TimeLimit.truncated"]
    observations, _, over, infos = env.step(np.ones((3, 1)))
    assert over.tolist() == [True, True, True]
    assert [info["TimeLimit.truncated"] for info in infos] == [True, False, False]
    assert env.get_attr("num_envs", 0) == [3] and env.env_is_wrapped(dict) == [False] * 3
    env.set_attr("note", 7)
    assert env.get_attr("note", [0, 2]) == [7, 7]
    with pytest.raises(ValueError, match="set it for all"):
        env.set_attr("note", 8, 1)
    env.close()


@compiled
def test_stable_baselines_checkers_pass():
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.vec_env import VecCheckNan, VecMonitor

    for task in TASKS:
        check_env(gymnasium.make(f"sheldrake/{task}-v0"))
        made = gymnasium.make_vec(f"sheldrake/{task}-v0", num_envs=2, autoreset_mode="SameStep")
        env = VecMonitor(VecCheckNan(StableBaselinesVecEnv(made), raise_exception=True))
        env.reset()
        env.step(np.zeros((2, *env.action_space.shape), np.float32))
