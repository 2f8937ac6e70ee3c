"""Events that happen at once come in the order of pydrake, see the same numbers and leave the same."""

import pytest

pytest.importorskip("pydrake")

from tests.crosscheck.pydrake.random_events import run

pytestmark = [pytest.mark.peer, pytest.mark.filterwarnings("ignore")]


@pytest.mark.parametrize("block", range(10))
def test_events_of_chance(block):
    for seed in range(40 * block, 40 * block + 40):
        assert run("sheldrake", seed, ends=0.0) == run("pydrake", seed, ends=0.0), seed


@pytest.mark.parametrize("block", range(10))
def test_events_of_chance_that_end_runs_or_fail(block):
    for seed in range(1000 + 40 * block, 1040 + 40 * block):
        assert run("sheldrake", seed, ends=0.1) == run("pydrake", seed, ends=0.1), seed


CALLS = {
    "DeclareForcedPublishEvent": "ForcedPublish",
    "DeclareForcedDiscreteUpdateEvent": "ExecuteForcedEvents",
    "DeclareForcedUnrestrictedUpdateEvent": "ExecuteForcedEvents",
    "DeclareInitializationPublishEvent": "ExecuteInitializationEvents",
    "DeclareInitializationDiscreteUpdateEvent": "ExecuteInitializationEvents",
    "DeclareInitializationUnrestrictedUpdateEvent": "ExecuteInitializationEvents",
}


@pytest.mark.parametrize("declare", CALLS)
def test_what_fails_in_calls_by_hand(declare):
    def told(library):
        m, handled = pytest.importorskip(f"{library}.systems.framework"), []

        class Fails(m.LeafSystem):
            def __init__(self, name):
                super().__init__()
                self.set_name(name)
                self.DeclareDiscreteState(1)
                for status in (None, m.EventStatus.Failed(self, "oh no"), m.EventStatus.Failed(self, "never said")):
                    getattr(self, declare)(lambda *_, status=status: handled.append(name) or status)

        builder = m.DiagramBuilder()
        builder.AddSystem(Fails("first"))
        builder.AddSystem(Fails("second"))
        diagram = builder.Build()
        diagram.set_name("both")
        with pytest.raises(RuntimeError) as error:
            getattr(diagram, CALLS[declare])(diagram.CreateDefaultContext())
        return handled, str(error.value).replace("<locals>", "")

    assert told("sheldrake") == told("pydrake")
