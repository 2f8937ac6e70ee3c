"""LCM on the network: UDP multicast, with the datagrams that LCM's protocol description gives.

A short message is one datagram: magic number, sequence number, channel, message. A longer one is cut into fragments,
each with its place; the channel is in the first. Numbers are big-endian (Huang, Olson and Moore, "LCM: Lightweight
Communications and Marshalling", 2010).
"""

from __future__ import annotations

import itertools
import select
import socket
import struct
import time
from urllib.parse import parse_qs, urlsplit

SHORT, LONG = 0x4C433032, 0x4C433033
_SHORT_HEAD, _LONG_HEAD = struct.Struct(">II"), struct.Struct(">IIIIHH")
MOST_SHORT = 1400
"""Longest channel and message of a datagram [bytes]."""
MOST_PENDING = 64
"""Incomplete messages kept."""


class Multicast:
    """A multicast group.

    Args:
        url: "udpm://address:port?ttl=n".

    Raises:
        RuntimeError: the URL cannot be read, or the network cannot be joined.
    """

    def __init__(self, url: str):
        parts = urlsplit(url)
        query = parse_qs(parts.query)
        try:
            self._address = parts.hostname or "239.255.76.67", parts.port or 7667
            ttl = int(query.get("ttl", ["0"])[0])
            group = socket.inet_aton(self._address[0])
        except (ValueError, OSError) as e:
            raise RuntimeError(f"DrakeLcm(): cannot read the URL {url}; expected udpm://address:port?ttl=n.") from e
        self._numbers = itertools.count()
        self._pending: dict[tuple, dict[int, bytes]] = {}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_UDP)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if hasattr(socket, "SO_REUSEPORT"):
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
            self._socket.bind(("", self._address[1]))
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
            membership = struct.pack("4s4s", group, socket.inet_aton("0.0.0.0"))
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        except OSError as e:
            self._socket.close()
            raise RuntimeError(
                f"DrakeLcm(): cannot join {url}: {e}. Without a network that carries multicast, use memq://."
            ) from e

    def send(self, channel: str, message: bytes) -> None:
        """Sends a message, in fragments if it is long."""
        number, name = next(self._numbers) & 0xFFFFFFFF, channel.encode() + b"\0"
        for datagram in datagrams(number, name, message):
            try:
                self._socket.sendto(datagram, self._address)
            except OSError as e:
                raise RuntimeError(f"DrakeLcm.Publish(): cannot send to {self._address[0]}: {e}.") from e

    def receive(self, timeout: float) -> tuple[str, bytes] | None:
        """The next complete message."""
        until = time.monotonic() + timeout
        while True:
            ready, _, _ = select.select([self._socket], [], [], max(until - time.monotonic(), 0.0))
            if not ready:
                return None
            datagram, sender = self._socket.recvfrom(1 << 16)
            found = self._assembled(datagram, sender)
            if found is not None:
                return found

    def _assembled(self, datagram: bytes, sender: tuple) -> tuple[str, bytes] | None:
        if len(datagram) < _SHORT_HEAD.size:
            return None
        magic, number = _SHORT_HEAD.unpack_from(datagram)
        if magic == SHORT:
            return _on_channel(datagram[_SHORT_HEAD.size :])
        if magic != LONG or len(datagram) < _LONG_HEAD.size:
            return None
        _, _, size, _, place, count = _LONG_HEAD.unpack_from(datagram)
        if place >= count:
            return None
        parts = self._pending.setdefault((sender, number, size), {})
        parts[place] = datagram[_LONG_HEAD.size :]
        if len(parts) < count:
            while len(self._pending) > MOST_PENDING:
                self._pending.pop(next(iter(self._pending)))  # its fragments were lost
            return None
        del self._pending[sender, number, size]
        if len(parts) != count or max(parts) >= count:
            return None  # its fragments do not agree on how many they are
        found = _on_channel(b"".join(parts[k] for k in range(count)))
        return found if found is not None and len(found[1]) == size else None


def _on_channel(content: bytes) -> tuple[str, bytes] | None:
    """A channel and a message; None of what has no channel that can be read: anybody may send to the group."""
    name, zero, message = content.partition(b"\0")
    try:
        return (name.decode(), message) if zero else None
    except UnicodeDecodeError:
        return None


def datagrams(number: int, name: bytes, message: bytes) -> list[bytes]:
    """The datagrams of a message; `name` ends with a zero."""
    if len(name) + len(message) <= MOST_SHORT:
        return [_SHORT_HEAD.pack(SHORT, number) + name + message]
    size, first = len(message), MOST_SHORT - len(name)
    cuts = [0, *range(first, size, MOST_SHORT), size]
    count = len(cuts) - 1
    heads = (_LONG_HEAD.pack(LONG, number, size, cuts[k], k, count) for k in range(count))
    return [head + (name if k == 0 else b"") + message[cuts[k] : cuts[k + 1]] for k, head in enumerate(heads)]
