"""Runs that an event or a monitor ends, end when those of pydrake do: also at the very start."""

import importlib

import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer

DECLARE = {
    "publish": lambda s: s.DeclarePeriodicPublishEvent(0.05, 0.0, s.count),
    "update": lambda s: s.DeclarePeriodicDiscreteUpdateEvent(0.05, 0.0, s.count),
    "unrestricted": lambda s: s.DeclarePeriodicUnrestrictedUpdateEvent(0.05, 0.0, s.count),
    "publish each step": lambda s: s.DeclarePerStepPublishEvent(s.count),
    "update each step": lambda s: s.DeclarePerStepDiscreteUpdateEvent(s.count),
    "publish at the start": lambda s: s.DeclareInitializationPublishEvent(s.count),
    "update at the start": lambda s: s.DeclareInitializationDiscreteUpdateEvent(s.count),
    "unrestricted at the start": lambda s: s.DeclareInitializationUnrestrictedUpdateEvent(s.count),
    "monitor": lambda s: None,
}


def runs(library, kind, spared, first):
    """What some calls return, and how many events there were."""
    m = importlib.import_module(f"{library}.all")

    class Ends(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.counted = 0
            self.DeclareDiscreteState(1)
            DECLARE[kind](self)

        def count(self, *_):
            self.counted += 1
            return m.EventStatus.ReachedTermination(self, "enough") if self.counted > spared else None

    system = Ends()
    simulator = m.Simulator(system)
    if kind == "monitor":
        simulator.set_monitor(lambda _: system.count() or m.EventStatus.DidNothing())
    told = []
    for call, arguments in [(first, ()), ("AdvanceTo", (0.2,)), ("AdvanceTo", (0.3,))][not first :]:
        status = getattr(simulator, call)(*arguments)
        time = round(simulator.get_context().get_time(), 9)
        told.append((status.reason().name, status.message(), time, round(status.return_time(), 9), system.counted))
    return told


@pytest.mark.parametrize("first", ["", "Initialize", "AdvancePendingEvents"])
@pytest.mark.parametrize("spared", [0, 1, 2])
@pytest.mark.parametrize("kind", DECLARE)
def test_runs_end_alike(kind, spared, first):
    assert runs("sheldrake", kind, spared, first) == runs("pydrake", kind, spared, first)
