"""Simulations as environments for reinforcement learning, by the rules of Gymnasium (`pip install gymnasium`).

Importing this module registers ready tasks, for `gymnasium.make_vec(name, num_envs)` and `gymnasium.make(name)`:
sheldrake/CartPoleSwingUp-v0, sheldrake/QuadrupedStand-v0 and sheldrake/ArmReach-v0.
"""

try:
    import gymnasium as _gymnasium
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "sheldrake.gym needs Gymnasium: pip install 'sheldrake[gym]'.", name=error.name
    ) from error

from sheldrake.common._names import show_as_own
from sheldrake.gym._adapters import StableBaselinesVecEnv
from sheldrake.gym._drake_gym_env import DrakeGymEnv
from sheldrake.gym._drake_vector_env import DrakeVectorEnv
from sheldrake.gym._streams import Streams

for _name in ("CartPoleSwingUp", "QuadrupedStand", "ArmReach"):
    _gymnasium.register(
        f"sheldrake/{_name}-v0",
        entry_point=f"sheldrake.gym._tasks:One{_name}",
        vector_entry_point=f"sheldrake.gym._tasks:{_name}",
    )

__all__ = ["DrakeGymEnv", "DrakeVectorEnv", "StableBaselinesVecEnv", "Streams"]

show_as_own(globals())
