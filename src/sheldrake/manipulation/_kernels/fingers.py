"""Forces on the two fingers of a gripper."""

from __future__ import annotations

from sheldrake.common._kernels.generic import clip
from sheldrake.common.kernel import Vector, Vectors, kernel
from sheldrake.common.record import Record, number


class Springs(Record):
    """Of the distance of the fingers, and of their middle."""

    kp = number("stiffness of the distance", "N/m")
    kd = number("damping of the distance", "N s/m")
    kp_middle = number("stiffness of the middle", "N/m")
    kd_middle = number("damping of the middle", "N s/m")


@kernel
def opening_force(springs, desired, limit, state):
    """Force that opens the gripper [N]."""
    opening = springs.kp * (desired[0] - (state[1] - state[0])) + springs.kd * (desired[1] - (state[3] - state[2]))
    return clip(opening, -limit, limit)


@kernel(top=True)
def forces_on_fingers(spring_model: Springs, u: Vectors, y: Vector) -> int:
    """Generalized forces; the inputs are the desired distance and its rate, the limit, and the fingers' state.

    Returns:
        0, or 1 when the limit is not positive.
    """
    limit, state = u[1][0], u[2]
    if not limit > 0.0:
        return 1
    opening = opening_force(spring_model, u[0], limit, state)
    middle = -spring_model.kp_middle * (state[0] + state[1]) - spring_model.kd_middle * (state[2] + state[3])
    y[0] = 0.5 * middle - 0.5 * opening
    y[1] = 0.5 * middle + 0.5 * opening
    return 0


@kernel(top=True)
def grip_force(spring_model: Springs, u: Vectors, y: Vector) -> int:
    """The size of the force that opens or closes; inputs and status as in `forces_on_fingers`."""
    if not u[1][0] > 0.0:
        return 1
    y[0] = abs(opening_force(spring_model, u[0], u[1][0], u[2]))
    return 0
