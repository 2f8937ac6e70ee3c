"""Messages by channel: publishing, subscribing, and handling what has come."""

from __future__ import annotations

import collections
import os
import re
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from sheldrake.common._options import Options
from sheldrake.common._overloads import Mismatch

if TYPE_CHECKING:
    from sheldrake.lcm._messages import Message

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"


class DrakeLcmParams(Options):
    """Settings of a DrakeLcm.

    Args:
        lcm_url: Where messages go; "" is the default (see `DrakeLcm`).
        channel_suffix: Follows every channel's name on the way out, and is taken off on the way in.
        defer_initialization: Connect when first used.
    """

    lcm_url: str = ""
    channel_suffix: str = ""
    defer_initialization: bool = False


class DrakeLcmInterface:
    """What publishes and subscribes; see `DrakeLcm`."""

    def get_lcm_url(self) -> str:
        """Where messages go."""
        raise NotImplementedError(f"{type(self).__name__} has no get_lcm_url().")

    def Publish(self, channel: str, buffer: bytes, time_sec: float | None = None) -> None:
        """Sends a message.

        Args:
            channel: Its channel; not empty.
            buffer: The message.
            time_sec: When it is sent [s], for those who log.
        """
        raise NotImplementedError(f"{type(self).__name__} has no Publish().")

    def Subscribe(self, channel: str, handler: Callable[[bytes], None]) -> None:
        """Lets `handler(message)` have the messages of a channel."""
        if not callable(handler):
            raise Mismatch(f"DrakeLcm.Subscribe(): incompatible function arguments: {handler!r} is no handler")
        self._subscribe(re.escape(channel), lambda name, message: handler(message))

    def SubscribeMultichannel(self, regex: str, handler: Callable[[str, bytes], None]) -> None:
        """Lets `handler(channel, message)` have the messages of all channels whose whole names match.

        Raises:
            RuntimeError: `regex` is no regular expression.
        """
        self._subscribe(regex, handler)

    def SubscribeAllChannels(self, handler: Callable[[str, bytes], None]) -> None:
        """Lets `handler(channel, message)` have all messages."""
        self._subscribe(".*", handler)

    def HandleSubscriptions(self, timeout_millis: int) -> int:
        """Hands waiting messages to their handlers.

        Args:
            timeout_millis: How long to wait for the first one [ms].

        Returns:
            How many messages there were. What a handler raises, this raises.
        """
        raise NotImplementedError(f"{type(self).__name__} has no HandleSubscriptions().")

    def _subscribe(self, regex: str, handler: Callable[[str, bytes], None]) -> None:
        raise NotImplementedError(f"{type(self).__name__} has no Subscribe().")


class Provider(Protocol):
    """What carries messages."""

    def send(self, channel: str, message: bytes) -> None:
        """Sends."""

    def receive(self, timeout: float) -> tuple[str, bytes] | None:
        """The next message, waited for at most so long [s]; None: there is none."""


class MemoryQueue:
    """Messages of one process to itself."""

    def __init__(self) -> None:
        self._queue: collections.deque[tuple[str, bytes]] = collections.deque()
        self._arrived = threading.Condition()

    def send(self, channel: str, message: bytes) -> None:
        """Keeps a message."""
        with self._arrived:
            self._queue.append((channel, message))
            self._arrived.notify()

    def receive(self, timeout: float) -> tuple[str, bytes] | None:
        """The oldest message kept."""
        with self._arrived:
            if not self._queue and timeout > 0:
                self._arrived.wait_for(lambda: self._queue, timeout)
            return self._queue.popleft() if self._queue else None


class DrakeLcm(DrakeLcmInterface):
    """A connection to LCM: the network's (`udpm://`), or one of its own in memory (`memq://`).

    Args:
        lcm_url: "memq://", or "udpm://address:port?ttl=n". "" stands for the environment variable LCM_DEFAULT_URL,
            else for udpm://239.255.76.67:7667?ttl=0: this machine only. Or DrakeLcmParams.

    Raises:
        RuntimeError: there is no such kind of URL.
    """

    def __init__(self, lcm_url: str | DrakeLcmParams = "", *, params: DrakeLcmParams | None = None):
        given = params if params is not None else lcm_url
        if isinstance(given, str):
            given = DrakeLcmParams(lcm_url=given)
        if not isinstance(given, DrakeLcmParams):
            raise Mismatch(f"DrakeLcm(): incompatible constructor arguments: {given!r} is no URL and no DrakeLcmParams")
        self._url = given.lcm_url or os.environ.get("LCM_DEFAULT_URL", "") or DEFAULT_URL
        self._suffix = given.channel_suffix
        self._handlers: list[tuple[re.Pattern, Callable[[str, bytes], None]]] = []
        self._provider: Provider | None = None
        scheme = self._url.partition("://")[0]
        if scheme not in ("memq", "udpm"):
            raise RuntimeError(f'DrakeLcm(): LCM provider "{scheme}" not found; valid: memq, udpm. URL: {self._url}')
        if not given.defer_initialization:
            self._connect()

    @staticmethod
    def available() -> bool:
        """Whether LCM is part of this build: it is."""
        return True

    def get_lcm_url(self) -> str:
        return self._url

    def _connect(self) -> Provider:
        if self._provider is None:
            if self._url.startswith("memq"):
                self._provider = MemoryQueue()
            else:
                from sheldrake.lcm._multicast import Multicast

                self._provider = Multicast(self._url)
        return self._provider

    def Publish(self, channel: str, buffer: bytes, time_sec: float | None = None) -> None:
        """Sends a message; see `DrakeLcmInterface.Publish`."""
        if not isinstance(buffer, (bytes, bytearray)):  # `bytes(5)` would be five zeros
            raise Mismatch(f"DrakeLcm.Publish(): incompatible function arguments: {buffer!r} is no bytes")
        if not channel:
            raise RuntimeError("DrakeLcm.Publish(): the channel's name is empty.")
        name, provider = channel + self._suffix, self._connect()
        if isinstance(provider, MemoryQueue) and not self._handlers_of(name):
            return  # nobody will ever ask for it
        provider.send(name, bytes(buffer))

    def _subscribe(self, regex: str, handler: Callable[[str, bytes], None]) -> None:
        if not callable(handler):
            raise Mismatch(
                f"DrakeLcm.SubscribeMultichannel(): incompatible function arguments: {handler!r} is no handler"
            )
        try:
            pattern = re.compile(f"(?:{regex}){re.escape(self._suffix)}")
        except re.error as error:
            raise RuntimeError(
                f"DrakeLcm.SubscribeMultichannel(): {regex!r} is no regular expression: {error}."
            ) from error
        self._connect()
        self._handlers.append((pattern, handler))

    def _handlers_of(self, name: str) -> list[Callable[[str, bytes], None]]:
        return [handler for pattern, handler in self._handlers if pattern.fullmatch(name)]

    def HandleSubscriptions(self, timeout_millis: int) -> int:
        """Hands waiting messages to their handlers; see `DrakeLcmInterface.HandleSubscriptions`."""
        provider, handled = self._connect(), 0
        until = time.monotonic() + max(timeout_millis, 0) / 1000
        while True:
            found = provider.receive(max(until - time.monotonic(), 0.0) if not handled else 0.0)
            if found is None:
                return handled
            name, message = found
            handlers = self._handlers_of(name)
            handled += bool(handlers)
            for handler in handlers:
                handler(name[: len(name) - len(self._suffix)], message)


class Subscriber:
    """The last message of a channel.

    Args:
        lcm: Where to subscribe.
        channel: The channel.
        lcm_type: Class of its messages, with `encode()` and `decode(bytes)`, as lcm-gen makes them.

    Attributes:
        count: How many messages have come.
        raw: The last one's bytes.
        message: The last one, decoded.
    """

    def __init__(self, lcm: DrakeLcmInterface, channel: str, lcm_type: type[Message]):
        self.lcm_type = lcm_type
        self.clear()
        lcm.Subscribe(channel=channel, handler=self._handler)

    def clear(self) -> None:
        """Forgets what has come."""
        self.count: int = 0
        self.raw: bytes | list = []
        self.message = self.lcm_type()

    def _handler(self, raw: bytes) -> None:
        self.count += 1
        self.raw = raw
        self.message = self.lcm_type.decode(raw)
