"""Publishers, subscribers and buses in diagrams."""

from __future__ import annotations

import pytest

from sheldrake.common.value import AbstractValue
from sheldrake.lcm import DrakeLcm, DrakeLcmParams, Subscriber
from sheldrake.lcm._messages import lcmt_scope
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, TriggerType
from sheldrake.systems.lcm import (
    ApplyLcmBusConfig,
    LcmBuses,
    LcmInterfaceSystem,
    LcmPublisherSystem,
    LcmScopeSystem,
    LcmSubscriberSystem,
    PySerializer,
    SerializerInterface,
)
from sheldrake.systems.primitives import ConstantVectorSource, Sine


def loop(order):
    """A sine's scope message goes out every 0.1 s and comes back; subscriber and interface in either order."""
    lcm, builder = DrakeLcm("memq://"), DiagramBuilder()
    sine = builder.AddSystem(Sine(1.0, 1.0, 0.0, 1))
    _, publisher = LcmScopeSystem.AddToBuilder(builder, lcm, sine.get_output_port(0), "SINE", 0.1)
    interface = LcmInterfaceSystem(lcm)
    subscriber = LcmSubscriberSystem.Make("SINE", lcmt_scope, interface)
    for system in (interface, subscriber)[:: 1 if order == "interface first" else -1]:
        builder.AddSystem(system)
    return lcm, builder.Build(), subscriber, publisher


@pytest.mark.parametrize("order", ["interface first", "subscriber first"])
def test_what_is_published_comes_back_before_the_next_step(order):
    lcm, diagram, subscriber, _ = loop(order)
    simulator = Simulator(diagram)
    simulator.Initialize()
    for k, t in enumerate((0.05, 0.15, 0.25, 0.95)):
        simulator.AdvanceTo(t)
        context = subscriber.GetMyContextFromRoot(simulator.get_context())
        message = subscriber.get_output_port().Eval(context)
        assert message.utime == [0, 100_000, 200_000, 900_000][k]
        assert subscriber.GetMessageCount(context) == [1, 2, 3, 10][k]
    assert len(message.value) == 1 and lcm.HandleSubscriptions(0) == 0


def test_triggers():
    lcm = DrakeLcm("memq://")
    source = ConstantVectorSource([1.0])

    def count(publisher, until):
        builder, seen = DiagramBuilder(), Subscriber(lcm, publisher.get_channel_name(), lcmt_scope)
        scope = builder.AddSystem(LcmScopeSystem(1))
        builder.Connect(builder.AddSystem(source._clone()).get_output_port(), scope.get_input_port())
        builder.AddSystem(publisher)
        builder.Connect(scope.get_output_port(), publisher.get_input_port())
        diagram = builder.Build()
        simulator = Simulator(diagram)
        simulator.AdvanceTo(until)
        lcm.HandleSubscriptions(0)
        stepped = seen.count
        diagram.ForcedPublish(simulator.get_context())
        lcm.HandleSubscriptions(0)
        return stepped, seen.count - stepped

    make = LcmPublisherSystem.Make
    assert count(make("A", lcmt_scope, lcm, 0.25), 1.0) == (5, 1)
    assert count(make("B", lcmt_scope, lcm, 0.25, publish_offset=0.1), 1.0) == (4, 1)
    assert count(make("C", lcmt_scope, lcm, publish_triggers={TriggerType.kForced}), 1.0) == (0, 1)
    per_step, forced = count(make("D", lcmt_scope, lcm), 1.0)
    assert per_step >= 1 and forced == 1
    serializer = PySerializer(lcmt_scope)
    with pytest.raises(RuntimeError, match="goes with the trigger kPeriodic"):
        LcmPublisherSystem("E", serializer, lcm, {TriggerType.kPerStep}, 0.1)
    with pytest.raises(RuntimeError, match="must be some of kForced, kPeriodic and kPerStep"):
        LcmPublisherSystem("E", serializer, lcm, {TriggerType.kWitness})


def test_names_and_ports():
    lcm = DrakeLcm("memq://")
    publisher = LcmPublisherSystem("A", PySerializer(lcmt_scope), lcm)
    subscriber = LcmSubscriberSystem("A", PySerializer(lcmt_scope), lcm)
    assert publisher.get_name() == "LcmPublisherSystem(A)" and publisher.get_input_port().get_name() == "lcm_message"
    assert subscriber.get_name() == "LcmSubscriberSystem(A)" and subscriber.get_output_port().get_name() == "y0"


def test_waiting_for_messages():
    lcm = DrakeLcm("memq://")
    subscriber = LcmSubscriberSystem.Make("A", lcmt_scope, lcm)
    assert subscriber.WaitForMessage(0, timeout=0.01) == 0
    lcm.Publish("A", lcmt_scope(utime=5).encode())
    message = AbstractValue.Make(lcmt_scope())
    assert subscriber.WaitForMessage(0, message=message) == 1 and message.get_value().utime == 5
    context = subscriber.CreateDefaultContext()
    assert subscriber.get_output_port().Eval(context).utime == 0
    subscriber.ExecuteForcedEvents(context)
    assert subscriber.get_output_port().Eval(context).utime == 5


def test_an_own_serializer():
    class Text(SerializerInterface):
        def CreateDefaultValue(self):
            return AbstractValue.Make("")

        def Serialize(self, abstract_value):
            return abstract_value.get_value().encode()

        def Deserialize(self, message_bytes, abstract_value):
            abstract_value.set_value(message_bytes.decode())

    lcm = DrakeLcm("memq://")
    publisher, subscriber = LcmPublisherSystem("A", Text(), lcm), LcmSubscriberSystem("A", Text(), lcm)
    context = publisher.CreateDefaultContext()
    publisher.get_input_port().FixValue(context, "hello")
    publisher.ForcedPublish(context)
    lcm.HandleSubscriptions(0)
    reader = subscriber.CreateDefaultContext()
    subscriber.ExecuteForcedEvents(reader)
    assert subscriber.get_output_port().Eval(reader) == "hello"
    with pytest.raises(TypeError, match="has no decode"):
        PySerializer(str)
    assert repr(PySerializer(lcmt_scope)) == "PySerializer(lcmt_scope)"


def test_who_serializes_does_not_matter():
    lcm = DrakeLcm("memq://")
    publisher = LcmPublisherSystem.Make("A", lcmt_scope, lcm, use_cpp_serializer=True)
    subscriber = LcmSubscriberSystem.Make("A", lcmt_scope, lcm, use_cpp_serializer=True)
    context = publisher.CreateDefaultContext()
    publisher.get_input_port().FixValue(context, AbstractValue.Make(lcmt_scope()))
    publisher.ForcedPublish(context)
    lcm.HandleSubscriptions(0)
    reader = subscriber.CreateDefaultContext()
    subscriber.ExecuteForcedEvents(reader)
    assert isinstance(subscriber.get_output_port().Eval(reader), lcmt_scope)
    assert subscriber.GetInternalMessageCount() == 1


def test_buses():
    builder = DiagramBuilder()
    buses = ApplyLcmBusConfig({"robot": DrakeLcmParams(lcm_url="memq://"), "nobody": None}, builder)
    assert buses.GetAllBusNames() == ["nobody", "robot"] and buses.size() == 2
    assert buses.Find("a driver", "nobody").get_lcm_url() == LcmBuses.kLcmUrlMemqNull
    assert isinstance(buses.Find("a driver", "robot"), LcmInterfaceSystem)
    names = [s.get_name() for s in builder.GetSystems()]
    assert names == ["DrakeLcm(bus_name=nobody)", "DrakeLcm(bus_name=robot)", "LcmInterfaceSystem(bus_name=robot)"]
    with pytest.raises(RuntimeError, match=r"a driver requested an LCM bus 'x' that .*nobody, robot"):
        buses.Find("a driver", "x")
    with pytest.raises(RuntimeError, match="'robot' has already been defined"):
        buses.Add("robot", DrakeLcm("memq://"))


def test_initialization_fails_when_no_message_has_come_in_time():
    lcm = DrakeLcm("memq://")
    subscriber = LcmSubscriberSystem.Make("C", lcmt_scope, lcm, wait_for_message_on_initialization_timeout=0.01)
    simulator = Simulator(subscriber)
    with pytest.raises(RuntimeError, match="Timed out without receiving any message on channel C at url memq://"):
        simulator.Initialize()
    message = lcmt_scope()
    message.size, message.value = 1, [3.0]
    lcm.Publish("C", message.encode())
    simulator.Initialize()
    assert list(subscriber.get_output_port().Eval(simulator.get_context()).value) == [3.0]


@pytest.mark.parametrize("period", [-0.1, float("nan")])
def test_a_period_is_not_negative(period):
    with pytest.raises(RuntimeError, match="publish_period"):
        LcmPublisherSystem.Make("C", lcmt_scope, DrakeLcm("memq://"), publish_period=period)


def test_what_is_no_connection_and_no_settings_is_refused():
    with pytest.raises(TypeError, match="is no DrakeLcmInterface"):
        LcmInterfaceSystem(None)
    with pytest.raises(TypeError, match=r"LcmSubscriberSystem.*None is no DrakeLcmInterface"):
        LcmSubscriberSystem.Make("C", lcmt_scope, None)
    builder = DiagramBuilder()
    with pytest.raises(TypeError, match="bus 'b': 3 is no DrakeLcmParams"):
        ApplyLcmBusConfig({"a": None, "b": 3}, builder)
    assert builder.empty()


def test_a_publisher_may_have_a_connection_of_its_own(monkeypatch):
    monkeypatch.setenv("LCM_DEFAULT_URL", "memq://")
    publisher = LcmPublisherSystem.Make("C", lcmt_scope, lcm=None)
    context = publisher.CreateDefaultContext()
    publisher.get_input_port().FixValue(context, AbstractValue.Make(lcmt_scope()))
    sent = []
    publisher._lcm.Subscribe("C", sent.append)
    publisher.ForcedPublish(context)
    publisher._lcm.HandleSubscriptions(0)
    assert sent == [lcmt_scope().encode()]


def test_time_goes_on_where_every_step_sends_a_message():
    """With Drake it stands still: the message makes a step of no length, in which the next one is sent."""
    lcm, builder = DrakeLcm("memq://"), DiagramBuilder()
    interface = builder.AddSystem(LcmInterfaceSystem(lcm))
    subscriber = builder.AddSystem(LcmSubscriberSystem.Make("S", lcmt_scope, interface))
    source = builder.AddSystem(ConstantVectorSource([1.0]))
    scope = builder.AddSystem(LcmScopeSystem(1))
    publisher = builder.AddSystem(LcmPublisherSystem.Make("S", lcmt_scope, interface))
    builder.Connect(source.get_output_port(), scope.get_input_port())
    builder.Connect(scope.get_output_port(), publisher.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.25)
    assert simulator.get_context().get_time() == 0.25
    assert simulator.get_num_steps_taken() == 2  # one takes the message of initialization
    context = subscriber.GetMyContextFromRoot(simulator.get_context())
    assert list(subscriber.get_output_port().Eval(context).value) == [1.0]
