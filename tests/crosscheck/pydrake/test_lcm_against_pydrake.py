"""Our LCM and Drake's on one network: each reads what the other sends."""

from __future__ import annotations

import time

import numpy as np
import pytest

from sheldrake.lcm import DrakeLcm

pytestmark = pytest.mark.peer
URL = "udpm://239.255.76.68:7691?ttl=0"


@pytest.mark.parametrize("direction", ["ours to Drake", "Drake to ours"])
def test_each_reads_the_other(direction):
    lcm = pytest.importorskip("pydrake.lcm")
    try:
        ours, theirs = DrakeLcm(URL), lcm.DrakeLcm(URL)
    except RuntimeError as e:
        pytest.skip(f"no multicast here: {e}")
    sender, receiver = (ours, theirs) if direction == "ours to Drake" else (theirs, ours)
    got = []
    receiver.SubscribeMultichannel("CHECK_.*", lambda name, message: got.append((name, message)))
    rng = np.random.default_rng(1)
    sent = [(f"CHECK_{size}", rng.bytes(size)) for size in (0, 1, 1390, 1400, 5000, 60_000)]
    for name, message in sent:
        sender.Publish(name, message)
        until = time.monotonic() + 2.0
        while (not got or got[-1][0] != name) and time.monotonic() < until:
            receiver.HandleSubscriptions(50)
    assert got == sent
