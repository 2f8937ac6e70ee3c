"""When bodies began and ceased to touch, and how hard, from logged states."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._replay import StateLog

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.plant._contact.results import ContactResults
    from sheldrake.systems.framework import Context

RATE = 1000.0  # [Hz] at which contact is looked at, at most
MOST = 3000  # looks, at most
_APART = 0.02  # [s] pauses shorter than this are one touch
_NOTHING = 1e-9  # of a plant's weight and its largest force: less is rounding of bodies that nearly touch


class ContactEvent(NamedTuple):
    """One touch of two bodies.

    Attributes:
        bodies: Their names.
        begin: [s].
        end: [s], or None when they still touch at the end.
        peak: Largest sum of the normal forces between them [N].
        last: The same sum at the end of the touch [N].
    """

    bodies: tuple[str, str]
    begin: float
    end: float | None
    peak: float
    last: float


def find_contact_events(context: Context, logs: list[StateLog]) -> tuple[list[ContactEvent], float]:
    """All touches in logged states, in order of time, and the time between two looks [s].

    Forces are computed anew from the logged states; memory of controllers is as it is in `context`.
    """
    events: list[ContactEvent] = []
    root = context.Clone()
    step = 0.0
    for plant in {id(log.plant): log.plant for log in logs}.values():
        own = [log for log in logs if log.plant is plant]
        times = own[0].times
        every = max(1, int(np.ceil(len(times) / MOST)), int(np.ceil(_mean_rate(times) / RATE)))
        looks = times[::every]
        if len(looks) > 1:
            step = max(step, float(np.median(np.diff(looks))))
        touches = _touches(plant, own, root, looks)
        least = _least_force(plant, touches)
        events += [event for event in touches if event.peak > least]
    return sorted(events, key=lambda event: (event.begin, event.bodies)), step


def _least_force(plant: MultibodyPlant, events: list[ContactEvent]) -> float:
    """The peak of a touch that is worth telling [N]."""
    weight = plant.CalcTotalMass(plant.CreateDefaultContext()) * np.linalg.norm(plant.gravity_field().gravity_vector())
    return _NOTHING * max(float(weight), *(event.peak for event in events), 0.0)


def _mean_rate(times: np.ndarray) -> float:
    return (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 and times[-1] > times[0] else 0.0


def _touches(plant: MultibodyPlant, logs: list[StateLog], root: Context, looks: np.ndarray) -> list[ContactEvent]:
    context = plant.GetMyMutableContextFromRoot(root)
    sampled = plant.is_discrete() and plant.has_sampled_output_ports()
    port = plant.get_contact_results_output_port()
    running: dict[tuple[str, str], list[float]] = {}  # begin, time seen last, peak, force seen last
    finished: list[ContactEvent] = []

    def close(bodies: tuple[str, str], still: bool) -> None:
        begin, seen, peak, last = running.pop(bodies)
        finished.append(ContactEvent(bodies, begin, None if still else seen, peak, last))

    for t in looks.tolist():
        root.SetTime(t)
        for log in logs:
            log.set_state(root, t)
        if sampled:  # its ports tell of the last step: make one from here
            plant.ExecuteForcedEvents(context, publish=False)
        forces = _forces(plant, port.Eval(context))
        for bodies, force in forces.items():
            state = running.setdefault(bodies, [t, t, 0.0, 0.0])
            state[1], state[2], state[3] = t, max(state[2], force), force
        for bodies in [b for b, state in running.items() if t - state[1] > _APART]:
            close(bodies, False)
    last = looks[-1] if len(looks) else 0.0
    for bodies in list(running):
        close(bodies, last - running[bodies][1] <= _APART)
    return finished


def _forces(plant: MultibodyPlant, results: ContactResults) -> dict[tuple[str, str], float]:
    """Sum of the normal forces between each two bodies that touch [N]."""
    found: dict[tuple[str, str], float] = {}

    def add(a: Any, b: Any, force: np.ndarray, normal: np.ndarray) -> None:
        first, second = sorted((plant.get_body(a).name(), plant.get_body(b).name()))
        found[first, second] = found.get((first, second), 0.0) + abs(float(np.dot(force, normal)))

    for i in range(results.num_point_pair_contacts()):
        info = results.point_pair_contact_info(i)
        if np.any(info.contact_force()):
            pair = info.point_pair()
            add(info.bodyA_index(), info.bodyB_index(), info.contact_force(), pair.nhat_BA_W)
    return found
