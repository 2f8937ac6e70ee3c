"""Parts of joints and springs that URDF and SDFormat write alike."""

import numpy as np

from .._files.xml import Element
from .._model.description import JointDescription, SpringDamperDescription
from .reading import Reading


def make_path(joint: JointDescription, pieces, initial_tangent, plane_normal, is_periodic: bool, reading: Reading):
    """The path of a curvilinear joint, made of pieces (turning rate [1/m], length [m])."""
    from sheldrake.trajectories import PiecewiseConstantCurvatureTrajectory

    breaks = np.concatenate([[0.0], np.cumsum([length for _, length in pieces])])
    try:
        return PiecewiseConstantCurvatureTrajectory(
            breaks=list(breaks),
            turning_rates=[rate for rate, _ in pieces],
            initial_curve_tangent=initial_tangent,
            plane_normal=plane_normal,
            is_periodic=is_periodic,
        )
    except RuntimeError as wrong:
        reading.fail(joint, f"The path of joint '{joint.name}': {wrong}")


def read_gains(element: Element, owner: str, reading: Reading) -> "tuple[float, float] | None":
    """The proportional and derivative gain in a `<drake:controller_gains p d>` child."""
    gains = element.find("drake:controller_gains")
    if gains is None:
        return None
    reading.warn_unknown(gains, attributes=("p", "d"))
    p, d = reading.number(gains, "p"), reading.number(gains, "d")
    if p is None or d is None:
        reading.fail(gains, f"<drake:controller_gains> of {owner} needs the attributes 'p' and 'd'.")
    if p < 0.0 or d < 0.0:
        reading.fail(gains, f"<drake:controller_gains> of {owner}: gains must not be negative, found {p:g} and {d:g}.")
    return p, d


def check_spring_damper(spring: SpringDamperDescription, reading: Reading) -> None:
    """Checks the signs of a spring-damper's numbers."""
    if spring.free_length <= 0.0:
        reading.fail(spring, f"The free length of a spring-damper must be positive, found {spring.free_length:g}.")
    for name in ("stiffness", "damping"):
        if getattr(spring, name) < 0.0:
            reading.fail(
                spring, f"The {name} of a spring-damper must not be negative, found {getattr(spring, name):g}."
            )
