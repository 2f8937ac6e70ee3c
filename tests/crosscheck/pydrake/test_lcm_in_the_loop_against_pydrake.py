"""When messages that a diagram sends to itself are seen: at the samples at which pydrake's systems see them."""

import importlib

import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer


class Count:
    """A message of one number."""

    value = 0

    def encode(self):
        return str(self.value).encode()

    @staticmethod
    def decode(data):
        message = Count()
        message.value = int(data)
        return message


def seen(library, connected, order, period):
    """(what publishes every 0.1 s saw, what updates every 0.1 s saw): microseconds at which messages were sent."""
    m = importlib.import_module(f"{library}.all")

    class Clock(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareAbstractOutputPort("message", lambda: m.AbstractValue.Make(Count()), self.calc)

        def calc(self, context, output):
            message = Count()
            message.value = round(1e6 * context.get_time()) + 1
            output.set_value(message)

    class Reader(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.published, self.updated = [], []
            self.DeclareAbstractInputPort("message", m.AbstractValue.Make(Count()))
            self.DeclarePeriodicPublishEvent(0.1, 0.0, self.publish)
            self.DeclarePeriodicUnrestrictedUpdateEvent(0.1, 0.0, self.update)

        def publish(self, context):
            self.published.append(self.get_input_port().Eval(context).value)

        def update(self, context, state):
            self.updated.append(self.get_input_port().Eval(context).value)

    lcm = m.DrakeLcm("memq://")
    interface = m.LcmInterfaceSystem(lcm)
    line = interface if connected == "by the interface" else lcm
    clock, reader = Clock(), Reader()
    publisher = m.LcmPublisherSystem.Make("C", Count, line, publish_period=period)
    subscriber = m.LcmSubscriberSystem.Make("C", Count, line)
    builder = m.DiagramBuilder()
    systems = {
        "clock": clock,
        "publisher": publisher,
        "subscriber": subscriber,
        "reader": reader,
        "interface": interface,
    }
    for name in order.split():
        builder.AddSystem(systems[name])
    builder.Connect(clock.get_output_port(), publisher.get_input_port())
    builder.Connect(subscriber.get_output_port(), reader.get_input_port())
    m.Simulator(builder.Build()).AdvanceTo(0.5)
    return reader.published, reader.updated


@pytest.mark.parametrize("period", [0.1, 0.05, 0.07])
@pytest.mark.parametrize(
    "order", ["interface subscriber clock publisher reader", "clock publisher subscriber reader interface"]
)
@pytest.mark.parametrize("connected", ["by the interface", "by the connection itself"])
def test_messages_are_seen_when_drake_sees_them(connected, order, period):
    ours, theirs = (seen(library, connected, order, period) for library in ("sheldrake", "pydrake"))
    assert ours == theirs


def events_with_messages_from_outside(library, connected):
    """What a system's events see of messages that come between calls of `AdvanceTo`; and the number of steps."""
    m = importlib.import_module(f"{library}.all")

    class Reader(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.seen = []
            self.DeclareAbstractInputPort("message", m.AbstractValue.Make(Count()))
            self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, lambda context, x: self.note("discrete", context))
            self.DeclarePeriodicUnrestrictedUpdateEvent(0.1, 0.0, lambda context, x: self.note("unrestricted", context))
            self.DeclarePeriodicPublishEvent(0.1, 0.0, lambda context: self.note("publish", context))
            self.DeclarePerStepDiscreteUpdateEvent(lambda context, x: self.note("discrete in a step", context))
            self.DeclarePerStepUnrestrictedUpdateEvent(lambda context, x: self.note("unrestricted in a step", context))
            self.DeclarePerStepPublishEvent(lambda context: self.note("publish in a step", context))

        def note(self, event, context):
            self.seen.append((event, context.get_time(), self.get_input_port().Eval(context).value))

    lcm, builder = m.DrakeLcm("memq://"), m.DiagramBuilder()
    if connected == "by the interface":
        line = builder.AddSystem(m.LcmInterfaceSystem(lcm))
    else:
        line = lcm
    subscriber = builder.AddSystem(m.LcmSubscriberSystem.Make("C", Count, line))
    reader = builder.AddSystem(Reader())
    builder.Connect(subscriber.get_output_port(), reader.get_input_port())
    simulator = m.Simulator(builder.Build())
    simulator.Initialize()
    for value, until in ((1, 0.1), (2, 0.15), (3, 0.3)):
        message = Count()
        message.value = value
        lcm.Publish("C", message.encode())
        if connected == "by hand":
            lcm.HandleSubscriptions(0)
        simulator.AdvanceTo(until)
    return reader.seen, simulator.get_num_steps_taken()


@pytest.mark.parametrize("connected", ["by the interface", "by hand"])
def test_messages_from_outside_come_in_steps_of_no_length(connected):
    ours, theirs = (events_with_messages_from_outside(library, connected) for library in ("sheldrake", "pydrake"))
    assert ours == theirs
    assert ("discrete", 0.0, 0) in ours[0]  # what updates at this time has not seen the message
