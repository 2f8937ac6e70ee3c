"""Why a simulation went wrong, in words: when, which body, and what is odd about the model."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.multibody.tree import BodyIndex

from ._plausible import HEAVIEST, LIGHTEST

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import RigidBody
    from sheldrake.systems.analysis import Simulator
    from sheldrake.systems.framework import Context, System

_FAST = 1e3  # [m/s] what moves faster has been thrown by a fault
_UNITS = (
    (1e3, "large", "a mesh in millimetres, read as metres"),
    (1e-3, "small", "a mesh in metres, read as millimetres"),
)


def ExplainFailure(simulator: Simulator) -> str:
    """Says why a simulation failed or exploded: the time, the body, what is wrong with the model, what mends it.

    Looks at the simulator's context as it is: after an error of AdvanceTo(), or when something has flown away. Of every
    body mass and geometry are held against each other: a mesh in millimetres makes a part a thousand times too large,
    of less density than air.

    Args:
        simulator: A Simulator whose system is, or has in it, a MultibodyPlant.

    Returns:
        One line a finding; the first says when and where it was seen.
    """
    context = simulator.get_context()
    lines = []
    for plant in _plants(simulator.get_system()):
        own = plant.GetMyContextFromRoot(context)
        bodies = [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]
        speeds = [_speed(body, own) for body in bodies]
        if bodies:
            worst = int(np.argmax(speeds))
            how = "is nowhere any more" if np.isinf(speeds[worst]) else f"moves at {speeds[worst]:.3g} m/s"
            fast = "" if speeds[worst] < _FAST else ", which nothing in a real scene does"
            lines.append(f"at t = {float(context.get_time()):g} s '{bodies[worst].name()}' {how}{fast}")
        odd = [text for body in bodies for text in _odd(plant, own, body)]
        lines += odd
        if odd:
            lines.append("`sheldrake doctor MODEL --fix FILE` finds such faults and writes the model without them")
    return "\n".join(lines)


def _plants(system: System) -> Iterator[MultibodyPlant]:
    """A system that is a plant, and the plants in one that is a diagram."""
    if hasattr(system, "EvalBodySpatialVelocityInWorld"):
        yield system  # type: ignore[misc]
    elif hasattr(system, "GetSystems"):
        for part in system.GetSystems():
            yield from _plants(part)


def _speed(body: RigidBody, context: Context) -> float:
    """Of a body's origin [m/s]; infinite where it is not a number."""
    speed = float(np.linalg.norm(body.EvalSpatialVelocityInWorld(context).translational()))
    return speed if np.isfinite(speed) else np.inf


def _odd(plant: MultibodyPlant, context: Context, body: RigidBody) -> Iterator[str]:
    """What is wrong with a body's size: no material has the density that it would have."""
    sides = _largest_box(plant, context, body)
    mass = float(body.get_mass(context))
    if sides is None or mass <= 0.0 or not sides.all():
        return
    density = mass / float(np.prod(sides))
    if LIGHTEST <= density <= HEAVIEST:
        return
    for factor, what, how in _UNITS:
        if LIGHTEST <= density * factor**3 <= HEAVIEST:
            size = " x ".join(f"{side:.3g}" for side in sides)
            yield f"'{body.name()}' is {size} m and has {mass:.3g} kg: 1000 times too {what} ({how})"


def _largest_box(plant: MultibodyPlant, context: Context, body: RigidBody) -> np.ndarray | None:
    """Sides of the largest box around one of a body's geometries [m], shape (3,)."""
    query = plant.get_geometry_query_input_port()
    if not query.HasValue(context):
        return None
    inspector = query.Eval(context).inspector()
    geometries = [*plant.GetCollisionGeometriesForBody(body), *plant.GetVisualGeometriesForBody(body)]
    boxes = [box for box in map(inspector.GetObbInGeometryFrame, geometries) if box is not None]
    return max((2.0 * np.asarray(box.half_width()) for box in boxes), key=np.prod, default=None)
