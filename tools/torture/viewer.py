"""Clients of the viewer's page that are slow, dead or hostile: a proper one is served all the same."""

from __future__ import annotations

import functools
import random
import socket

from sheldrake.geometry import Box, Meshcat, Rgba
from sheldrake.math import RigidTransform

HOSTS = (
    "localhost",
    "127.0.0.1",
    "evil.example",
    "",
    "localhost:99999",
    "[::1",
    "a b",
    "localhost\r\nHost: localhost",
    "\x00",
)
ORIGINS = ("http://localhost", "http://evil.example", "null", "", "file://", "http://[", "http://localhost:80:80")
PATHS = (
    "/",
    "/index.html",
    "/x",
    "*",
    "http://a/",
    "/../../etc/passwd",
    "/%00",
    "/" + "a" * 9000,
    "",
    "?",
    "/download",
)
WEBSOCKET = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
_kept: list[socket.socket] = []  # clients that are never heard of again


@functools.cache
def _meshcat() -> Meshcat:
    meshcat = Meshcat(port=0)
    meshcat.SetObject("/box", Box(1, 1, 1), Rgba(1, 0, 0, 1))
    return meshcat


def _request(chance: random.Random, port: int) -> bytes:
    host = chance.choice((*HOSTS, f"localhost:{port}", f"localhost:{port}"))
    method, version = (
        chance.choice(("GET", "GET", "GET", "POST", "BREW", "")),
        chance.choice(("1.1", "1.1", "1.1", "9", "")),
    )
    lines = [f"{method} {chance.choice(PATHS)} HTTP/{version}"]
    lines += [f"Host: {host}"] * chance.choice((0, 1, 1, 1, 2))
    lines += [f"Origin: {chance.choice((*ORIGINS, f'http://{host}'))}"] * chance.choice((0, 0, 1, 2))
    lines += [f"X-{k}: {'a' * chance.choice((1, 100, 10_000))}" for k in range(chance.choice((0, 0, 3, 200)))]
    text = "\r\n".join(lines) + "\r\n"
    if chance.random() < 0.5:
        text += WEBSOCKET + f"Sec-WebSocket-Key: {chance.choice(('dGhlIHNhbXBsZSBub25jZQ==', 'x', ''))}\r\n"
    return (text + "\r\n").encode("latin-1", "replace")


def clients(chance: random.Random, number: int) -> None:
    """One strange client after the other, some of which stay; after each the page is there, and calls return."""
    meshcat = _meshcat()
    port = meshcat.port()
    client = socket.create_connection(("127.0.0.1", port), timeout=30)
    data = _request(chance, port) if chance.random() < 0.85 else chance.randbytes(chance.choice((1, 100, 100_000)))
    kind = chance.choice(("whole", "whole", "whole", "cut", "reset", "stays", "frames"))
    try:
        client.sendall(data[: chance.randrange(len(data))] if kind in ("cut", "stays") else data)
        if kind == "frames":
            client.sendall(chance.randbytes(chance.choice((2, 14, 1000))))
        if kind == "whole":
            answer = client.recv(1 << 16) if data.endswith(b"\r\n\r\n") else b""
            assert not answer.startswith(b"HTTP/1.1 5"), f"{data[:300]!r} is answered {answer[:100]!r}"
    except (ConnectionResetError, BrokenPipeError):
        pass
    if kind == "stays":
        _kept.append(client)
        del _kept[:-50]
    else:
        if kind == "reset":
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
        client.close()
    meshcat.SetTransform("/box", RigidTransform([0.0, 0.0, chance.random()]))
    if number % 5 == 0:
        meshcat.SetObject(f"/box/{number % 50}", Box(1, 1, 1), Rgba(0, 1, 0, 1))
        assert _page(port).startswith(b"HTTP/1.1 200"), f"the page is not served after {data[:300]!r}"


def _page(port: int) -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=30) as client:
        client.sendall(f"GET / HTTP/1.1\r\nHost: localhost:{port}\r\nAccept-Encoding: gzip\r\n\r\n".encode())
        return _all_of(client)


def _all_of(client: socket.socket) -> bytes:
    found = b""
    while part := client.recv(1 << 16):
        found += part
    return found
