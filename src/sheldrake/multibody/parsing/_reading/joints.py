"""Parts of joints and springs that URDF and SDFormat write alike."""

from collections.abc import Callable

import numpy as np

from .._files.xml import Element
from .._model.description import JointDescription, SpringDamperDescription
from .reading import Reading


def read_path(
    element: Element,
    joint: JointDescription,
    reading: Reading,
    numbers: Callable[..., "list[float | None]"],
    vector: Callable[[str, list[float]], np.ndarray],
    is_periodic: bool,
) -> None:
    """Gives a curvilinear joint its planar path: straight and circular pieces, joined smoothly.

    Args:
        element: The joint's element.
        joint: The joint.
        reading: Its surroundings.
        numbers: Reads the numbers of a piece by their names, and warns of other things in it.
        vector: Reads the vector of a child with a tag, or a default.
        is_periodic: Whether the path is closed.
    """
    of = f"Curvilinear joint '{joint.name}':"
    curves = element.find("drake:curves")
    if curves is None:
        reading.fail(element, f"{of[:-1]} needs <drake:curves>.")
    reading.warn_unknown(curves, tags=[piece.tag for piece in curves])

    def positive(piece: Element, name: str, value: "float | None") -> float:
        if value is None or value <= 0.0:
            reading.fail(piece, f"{of} <{piece.tag}> needs a positive '{name}'.")
        return value

    pieces = []  # turning rate [1/m], length [m]
    for piece in curves:
        if piece.tag == "drake:line_segment":
            pieces.append((0.0, positive(piece, "length", *numbers(piece, "length"))))
        elif piece.tag == "drake:circular_arc":
            given, angle = numbers(piece, "radius", "angle")
            radius = positive(piece, "radius", given)
            if not angle:
                reading.fail(piece, f"{of} a circular arc needs an 'angle' other than 0.")
            pieces.append((np.sign(angle) / radius, radius * abs(angle)))
        else:
            reading.fail(piece, f"<drake:curves> has line segments and circular arcs, not <{piece.tag}>.")
    if not pieces:
        reading.fail(curves, f"{of} <drake:curves> is empty.")
    tangent = vector("drake:initial_tangent", [1.0, 0.0, 0.0])
    normal = vector("drake:plane_normal", [0.0, 0.0, 1.0])
    joint.curvilinear_path = _make_path(joint, pieces, tangent, normal, is_periodic, reading)


def _make_path(joint: JointDescription, pieces, initial_tangent, plane_normal, is_periodic: bool, reading: Reading):
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
