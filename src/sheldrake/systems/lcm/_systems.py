"""Systems that publish, receive, and keep a connection going.

The border between diagrams and channels: an input becomes messages, messages become an output.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from sheldrake.common._overloads import Mismatch
from sheldrake.common.value import AbstractValue
from sheldrake.lcm import DrakeLcm, DrakeLcmInterface
from sheldrake.systems.framework import AbstractStateIndex, EventStatus, LeafSystem, TriggerType
from sheldrake.systems.lcm._serializer import PySerializer, SerializerInterface

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


class LcmInterfaceSystem(LeafSystem, DrakeLcmInterface):
    """A connection that hands out its messages while the simulation runs, before every step.

    Args:
        lcm: The connection.
    """

    def __init__(self, lcm: DrakeLcmInterface):
        super().__init__()
        if not isinstance(lcm, DrakeLcmInterface):
            raise Mismatch(f"LcmInterfaceSystem(): incompatible constructor arguments: {lcm!r} is no DrakeLcmInterface")
        self._lcm = lcm
        self.DeclareInitializationUnrestrictedUpdateEvent(self._pump)

    def _pump(self, context: Context, state: Any) -> EventStatus:
        self._lcm.HandleSubscriptions(0)
        return EventStatus.DidNothing()

    def _asks(self, context: Context) -> bool:
        self._lcm.HandleSubscriptions(0)
        return False  # those who have got a message ask

    def get_lcm_url(self) -> str:
        return self._lcm.get_lcm_url()

    def Publish(self, channel: str, buffer: bytes, time_sec: float | None = None) -> None:
        """Sends a message; see `DrakeLcmInterface.Publish`."""
        self._lcm.Publish(channel, buffer, time_sec)

    def HandleSubscriptions(self, timeout_millis: int) -> int:
        """Hands waiting messages to their handlers; see `DrakeLcmInterface.HandleSubscriptions`."""
        return self._lcm.HandleSubscriptions(timeout_millis)

    def _subscribe(self, regex: str, handler: Callable[[str, bytes], None]) -> None:
        self._lcm._subscribe(regex, handler)


def _checked(call: str, serializer: Any, lcm: DrakeLcmInterface) -> None:
    if not isinstance(serializer, SerializerInterface):
        raise Mismatch(f"{call}(): incompatible constructor arguments: {serializer!r} is no SerializerInterface")
    if not isinstance(lcm, DrakeLcmInterface):
        raise Mismatch(f"{call}(): incompatible constructor arguments: {lcm!r} is no DrakeLcmInterface")


class LcmPublisherSystem(LeafSystem):
    """Publishes the message at its input port.

    Args:
        channel: The channel.
        serializer: Writes the messages.
        lcm: The connection, or the system that keeps it; None for a connection of its own.
        publish_triggers: When: any of kForced, kPeriodic, kPerStep. Without: forced, and periodic if there is a
            period, else in every step.
        publish_period: [s].
        publish_offset: [s].
    """

    def __init__(
        self,
        channel: str,
        serializer: SerializerInterface,
        lcm: DrakeLcmInterface | None,
        publish_triggers: Any = None,
        publish_period: float = 0.0,
        publish_offset: float = 0.0,
    ):
        super().__init__()
        lcm = DrakeLcm() if lcm is None else lcm
        _checked("LcmPublisherSystem", serializer, lcm)
        if isinstance(publish_triggers, (int, float)):  # (channel, serializer, lcm, publish_period, publish_offset)
            publish_triggers, publish_period, publish_offset = None, publish_triggers, publish_period
        if publish_triggers is None:
            publish_triggers = {TriggerType.kPeriodic if publish_period > 0 else TriggerType.kPerStep}
            publish_triggers.add(TriggerType.kForced)
        self._channel, self._serializer, self._lcm = channel, serializer, lcm
        self.set_name(f"LcmPublisherSystem({channel})")
        self.DeclareAbstractInputPort("lcm_message", serializer.CreateDefaultValue())
        self._declare(set(publish_triggers), publish_period, publish_offset)

    def _declare(self, triggers: Iterable[TriggerType], period: float, offset: float) -> None:
        valid = {TriggerType.kForced, TriggerType.kPeriodic, TriggerType.kPerStep}
        if not triggers or not valid.issuperset(triggers):
            raise RuntimeError(
                f"LcmPublisherSystem({self._channel}): publish_triggers must be some of kForced, kPeriodic and "
                f"kPerStep, not {sorted(str(t) for t in triggers)}."
            )
        if (TriggerType.kPeriodic in triggers) != (period > 0) or not period >= 0:
            raise RuntimeError(
                f"LcmPublisherSystem({self._channel}): a publish_period > 0 goes with the trigger kPeriodic, and only "
                f"with it; the period is {period} s."
            )
        if TriggerType.kForced in triggers:
            self.DeclareForcedPublishEvent(self._publish)
        if TriggerType.kPeriodic in triggers:
            self.DeclarePeriodicPublishEvent(period, offset, self._publish)
        if TriggerType.kPerStep in triggers:
            self.DeclarePerStepPublishEvent(self._publish)

    @staticmethod
    def Make(
        channel: str,
        lcm_type: Any,
        lcm: DrakeLcmInterface | None,
        publish_period: float = 0.0,
        use_cpp_serializer: bool = False,
        *,
        publish_triggers: Any = None,
        publish_offset: float = 0.0,
    ) -> LcmPublisherSystem:
        """A publisher of messages of a Python class; see `LcmPublisherSystem`.

        Messages are Python objects here for all systems, so `use_cpp_serializer` changes nothing.
        """
        serializer = PySerializer(lcm_type)
        return LcmPublisherSystem(channel, serializer, lcm, publish_triggers, publish_period, publish_offset)

    def get_channel_name(self) -> str:
        """The channel."""
        return self._channel

    def _publish(self, context: Context) -> None:
        message = self.get_input_port().EvalAbstract(context)
        self._lcm.Publish(self._channel, self._serializer.Serialize(message), context.get_time())


class LcmSubscriberSystem(LeafSystem):
    """Shows the last message of a channel at its output port.

    Messages come when somebody calls the connection's `HandleSubscriptions`: an `LcmInterfaceSystem` does.

    Args:
        channel: The channel.
        serializer: Reads the messages.
        lcm: The connection, or the system that keeps it.
        wait_for_message_on_initialization_timeout: How long initialization waits for a message [s, wall clock]; a
            RuntimeError of `Simulator.Initialize` if none has come by then. Not positive: it does not wait.
    """

    def __init__(
        self,
        channel: str,
        serializer: SerializerInterface,
        lcm: DrakeLcmInterface,
        wait_for_message_on_initialization_timeout: float = 0.0,
    ):
        super().__init__()
        _checked("LcmSubscriberSystem", serializer, lcm)
        self._channel, self._serializer, self._lcm = channel, serializer, lcm
        self._timeout = wait_for_message_on_initialization_timeout
        self._box: list[Any] = [b"", 0]  # the last message, and how many there were; not what holds this system
        self.set_name(f"LcmSubscriberSystem({channel})")
        message = self.DeclareAbstractState(serializer.CreateDefaultValue())
        self.DeclareAbstractState(AbstractValue.Make(0))
        self.DeclareStateOutputPort("y0", AbstractStateIndex(int(message)))
        self._declare_request(self._take)
        self.DeclareForcedUnrestrictedUpdateEvent(self._take)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._initialize)
        lcm.Subscribe(channel, _keeper(self._box))

    @staticmethod
    def Make(
        channel: str,
        lcm_type: Any,
        lcm: DrakeLcmInterface,
        use_cpp_serializer: bool = False,
        *,
        wait_for_message_on_initialization_timeout: float = 0.0,
    ) -> LcmSubscriberSystem:
        """A subscriber to messages of a Python class; see `LcmSubscriberSystem`.

        Messages are Python objects here for all systems, so `use_cpp_serializer` changes nothing.
        """
        return LcmSubscriberSystem(channel, PySerializer(lcm_type), lcm, wait_for_message_on_initialization_timeout)

    def get_channel_name(self) -> str:
        """The channel."""
        return self._channel

    def GetInternalMessageCount(self) -> int:
        """How many messages have come."""
        return self._box[1]

    def GetMessageCount(self, context: Context) -> int:
        """How many messages had come when the context's was taken."""
        return context.get_abstract_state(1).get_value()

    def WaitForMessage(
        self, old_message_count: int, message: AbstractValue | None = None, timeout: float = -1.0
    ) -> int:
        """Waits until more messages have come than `old_message_count`.

        Args:
            old_message_count: So many are old.
            message: Gets the last message, if there is a new one.
            timeout: How long to wait at most [s, wall clock]; for ever if not positive.

        Returns:
            How many messages have come.
        """
        until = time.monotonic() + timeout if timeout > 0 and math.isfinite(timeout) else math.inf
        while self._box[1] <= old_message_count and time.monotonic() < until:
            left = until - time.monotonic()
            self._lcm.HandleSubscriptions(max(0, min(100, int(left * 1000) if math.isfinite(left) else 100)))
        if message is not None and self._box[1] > old_message_count:
            self._serializer.Deserialize(self._box[0], message)
        return self._box[1]

    def _initialize(self, context: Context, state: Any) -> EventStatus:
        if self._timeout > 0:
            logging.getLogger("drake").info("Waiting for messages on %s", self._channel)
            old = context.get_abstract_state(1).get_value()
            if self.WaitForMessage(old, timeout=self._timeout) <= old:
                raise RuntimeError(
                    f"Timed out without receiving any message on channel {self._channel} at url "
                    f"{self._lcm.get_lcm_url()}, after {self._timeout} s."
                )
        return self._take(context, state)

    def _asks(self, context: Context) -> bool:
        return context.get_abstract_state(1).get_value() != self._box[1]

    def _take(self, context: Context, state: Any) -> EventStatus:
        raw, count = self._box
        if context.get_abstract_state(1).get_value() == count:
            return EventStatus.DidNothing()
        self._serializer.Deserialize(raw, state.get_mutable_abstract_state(0))
        state.get_mutable_abstract_state(1).set_value(count)
        return EventStatus.Succeeded()


def _keeper(box: list[Any]) -> Callable[[bytes], None]:
    def keep(message: bytes) -> None:
        box[0], box[1] = message, box[1] + 1

    return keep
