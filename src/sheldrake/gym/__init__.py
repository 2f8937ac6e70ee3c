"""A simulation as an environment for reinforcement learning, by the rules of Gymnasium (`pip install gymnasium`)."""

try:
    import gymnasium as _gymnasium
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "sheldrake.gym needs Gymnasium: pip install 'sheldrake[gym]'.", name=error.name
    ) from error

from sheldrake.gym._drake_gym_env import DrakeGymEnv

__all__ = ["DrakeGymEnv"]
