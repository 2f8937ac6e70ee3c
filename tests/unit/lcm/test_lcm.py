"""Channels in memory, LCM's datagrams, and LCM's encoding of messages."""

from __future__ import annotations

import copy
import struct
import threading

import numpy as np
import pytest

from sheldrake.lcm import DrakeLcm, DrakeLcmInterface, DrakeLcmParams, Subscriber
from sheldrake.lcm._message import Message
from sheldrake.lcm._messages import lcmt_iiwa_status, lcmt_scope
from sheldrake.lcm._multicast import MOST_SHORT, Multicast, datagrams


class TestMemory:
    def test_messages_wait_until_they_are_handled_in_order(self):
        lcm, got = DrakeLcm("memq://"), []
        lcm.Subscribe("A", got.append)
        lcm.Publish("A", b"1")
        lcm.Publish("A", b"2", 0.5)
        assert got == []
        assert lcm.HandleSubscriptions(0) == 2 and got == [b"1", b"2"]
        assert lcm.HandleSubscriptions(0) == 0

    def test_channels_by_name_by_pattern_and_all(self):
        lcm, one, some, every = DrakeLcm("memq://"), [], [], []
        lcm.Subscribe(channel="A.", handler=one.append)  # a name, not a pattern
        lcm.SubscribeMultichannel("[AB]", lambda name, message: some.append(name))
        lcm.SubscribeAllChannels(lambda name, message: every.append(name))
        for name in ("A", "B", "AB", "A."):
            lcm.Publish(name, b"")
        assert lcm.HandleSubscriptions(0) == 4
        assert one == [b""] and some == ["A", "B"] and every == ["A", "B", "AB", "A."]

    def test_a_suffix_is_added_and_taken_off(self):
        lcm, got = DrakeLcm(DrakeLcmParams(lcm_url="memq://", channel_suffix="_LEFT")), []
        lcm.SubscribeAllChannels(lambda name, message: got.append(name))
        lcm.Publish("ARM", b"")
        lcm.HandleSubscriptions(0)
        assert got == ["ARM"]

    def test_what_a_handler_raises_is_raised(self):
        lcm = DrakeLcm("memq://")

        def refuse(message):
            raise ValueError("not this one")

        lcm.Subscribe("A", refuse)
        lcm.Publish("A", b"")
        with pytest.raises(ValueError, match="not this one"):
            lcm.HandleSubscriptions(0)

    def test_a_message_from_another_thread_ends_the_wait(self):
        lcm, got = DrakeLcm("memq://"), []
        lcm.Subscribe("A", got.append)
        sender = threading.Timer(0.05, lambda: lcm.Publish("A", b"x"))
        sender.start()
        assert lcm.HandleSubscriptions(60_000) == 1 and got == [b"x"]
        sender.join()

    def test_urls(self):
        assert DrakeLcm("memq://").get_lcm_url() == "memq://"
        with pytest.raises(RuntimeError, match="valid: memq, udpm"):
            DrakeLcm("carrier-pigeon://")
        with pytest.raises(RuntimeError, match="empty"):
            DrakeLcm("memq://").Publish("", b"")
        with pytest.raises(NotImplementedError, match="Publish"):
            DrakeLcmInterface().Publish("A", b"")

    def test_params_are_values(self):
        params = DrakeLcmParams(lcm_url="memq://", channel_suffix="X")
        twin = copy.deepcopy(params)
        twin.channel_suffix = "Y"
        assert params.channel_suffix == "X"
        assert repr(params) == "DrakeLcmParams(lcm_url='memq://', channel_suffix='X', defer_initialization=False)"
        with pytest.raises(AttributeError, match="it has lcm_url"):
            DrakeLcmParams(url="memq://")


def test_subscriber_keeps_the_last_message():
    lcm = DrakeLcm("memq://")
    subscriber = Subscriber(lcm, "S", lcmt_scope)
    assert subscriber.count == 0 and subscriber.message.value == []
    for k in range(3):
        lcm.Publish("S", lcmt_scope(utime=k, size=1, value=[float(k)]).encode())
    lcm.HandleSubscriptions(0)
    assert subscriber.count == 3 and subscriber.message.value == [2.0] and subscriber.message.utime == 2
    subscriber.clear()
    assert subscriber.count == 0 and subscriber.raw == []


class TestDatagrams:
    @staticmethod
    def receiver() -> Multicast:
        receiver = object.__new__(Multicast)
        receiver._pending = {}
        return receiver

    @pytest.mark.parametrize("size", [0, 1, MOST_SHORT - 5, MOST_SHORT - 4, MOST_SHORT, 10 * MOST_SHORT, 100_003])
    def test_messages_come_together_in_any_order(self, size):
        rng = np.random.default_rng(size)
        message = rng.bytes(size)
        parts = datagrams(7, b"NAME\0", message)
        rng.shuffle(parts)
        receiver = self.receiver()
        found = [receiver._assembled(part, ("here", 1)) for part in parts]
        assert found[-1] == ("NAME", message) and found[:-1] == [None] * (len(parts) - 1)
        assert not receiver._pending

    def test_senders_are_told_apart(self):
        message = bytes(3 * MOST_SHORT)
        parts, receiver = datagrams(7, b"N\0", message), self.receiver()
        for k, part in enumerate(parts):
            assert receiver._assembled(part, ("a", 1)) is None or k == len(parts) - 1
        assert receiver._assembled(parts[0], ("b", 1)) is None

    def test_noise_and_lost_fragments_are_left_out(self):
        receiver = self.receiver()
        assert receiver._assembled(b"", ("a", 1)) is None
        assert receiver._assembled(bytes(100), ("a", 1)) is None
        for number in range(1000):
            assert receiver._assembled(datagrams(number, b"N\0", bytes(2000))[0], ("a", 1)) is None
        assert len(receiver._pending) <= 64

    def test_datagrams_of_an_attacker_are_left_out(self):
        receiver = self.receiver()
        unreadable, none = b"\xff\xfe\0" + bytes(5), b"no zero"
        long = struct.Struct(">IIIIHH")
        for content in (unreadable, none):
            assert receiver._assembled(struct.pack(">II", 0x4C433032, 1) + content, ("a", 1)) is None
            assert receiver._assembled(long.pack(0x4C433033, 1, 5, 0, 0, 1) + content, ("a", 1)) is None
        assert receiver._assembled(long.pack(0x4C433033, 2, 0, 0, 0, 0), ("a", 1)) is None  # the first of none
        for place, count in ((7, 2), (8, 2), (5, 9), (0, 9), (0, 2)):  # fragments that do not agree
            assert receiver._assembled(long.pack(0x4C433033, 3, 2, 0, place, count) + b"N\0x", ("a", 1)) is None
        assert receiver._assembled(datagrams(4, b"N\0", b"good")[0], ("a", 1)) == ("N", b"good")


class TestMessages:
    def test_bytes_of_a_scope_message(self):
        """Recorded from pydrake 1.51.1's LcmScopeSystem at t = 0.25 s."""
        recorded = bytes.fromhex("900d93672b47f7de") + bytes.fromhex("000000000003d09000000002")
        recorded += np.array([1.0, 2.0], ">f8").tobytes()
        assert lcmt_scope(utime=250000, size=2, value=[1.0, 2.0]).encode() == recorded
        assert lcmt_scope.decode(recorded).value == [1.0, 2.0]

    def test_round_trip(self):
        class Everything(Message):
            layout = "string name; int32_t n; boolean on; double x[n]; float y[3], z[n][2]; lcmt_scope scope"

        rows, scope = [[1.0, 2.0], [3.0, 4.0]], lcmt_scope(size=1, value=[2.5])
        message = Everything(name="Ω", n=2, on=True, x=[1.0, -0.0], y=[0.5, 0.25, 0.0], z=rows, scope=scope)
        assert repr(Everything.decode(message.encode())) == repr(message)

    def test_faults_are_told(self):
        with pytest.raises(ValueError, match="value has 1 elements, not 2"):
            lcmt_scope(size=2, value=[1.0]).encode()
        with pytest.raises(ValueError, match="no lcmt_iiwa_status"):
            lcmt_iiwa_status.decode(lcmt_scope().encode())
        with pytest.raises(ValueError, match="ends early"):
            lcmt_scope.decode(lcmt_scope(size=2, value=[1.0, 2.0]).encode()[:-1])
        with pytest.raises(TypeError, match="it has utime, size, value"):
            lcmt_scope(time=1)

    @pytest.mark.parametrize("size", [-1, -(2**31), 3, 2**31 - 1])
    def test_lengths_that_cannot_be(self, size):
        class Named(Message):
            layout = "int32_t n; string names[n]"

        class Lines(Message):
            layout = "int32_t n; byte raw[n]"

        for kind, message in (
            (lcmt_scope, lcmt_scope(size=2, value=[1.0, 2.0])),
            (Named, Named(n=1, names=[""])),
            (Lines, Lines(n=2, raw=b"ab")),
        ):
            good = message.encode()
            at = 16 if kind is lcmt_scope else 8
            bad = good[:at] + struct.pack(">i", size) + good[at + 4 :]
            with pytest.raises(ValueError, match=rf"length (is|of) {size}\b|ends early"):
                kind.decode(bad)

    @pytest.mark.parametrize("size", [-4, 0, 2, 2**31 - 1])
    def test_a_text_whose_length_cannot_be(self, size):
        """-4 is where the text itself began: a list of a billion such took hours."""

        class Named(Message):
            layout = "int32_t n; string names[n]; int64_t more[4]"

        text = struct.pack(">i", size) + b"\0"
        tail = b"" if size > 0 else bytes(32)
        with pytest.raises(ValueError, match=rf"a text.* {size}\b"):
            Named.decode(Named(n=1, names=[""]).encode()[:8] + struct.pack(">i", 1) + text + tail)

    def test_damaged_messages_are_refused_or_read(self):
        class Part(Message):
            layout = "int16_t k; string text"

        class Whole(Message):
            layout = "int32_t n; double x[n]; string names[n]; byte raw[n]; int32_t m; Part parts[m]"

        parts = [Part(k=1, text="one"), Part(k=2, text="Ω")]
        good = Whole(n=2, x=[1.0, 2.0], names=["a", ""], raw=b"xy", m=2, parts=parts).encode()
        rng, refused = np.random.default_rng(5), 0
        for _ in range(3000):
            bad = bytearray(good[: rng.integers(8, len(good) + 1)])
            for at in rng.integers(8, max(len(bad), 9), 2):
                if at < len(bad):
                    bad[at] = rng.choice([0, 1, 127, 128, 255])
            try:
                assert isinstance(Whole.decode(bytes(bad)), Whole)
            except ValueError:
                refused += 1
        assert refused > 1000


@pytest.mark.parametrize("buffer", [5, None, "text", [1, 2]])
def test_a_message_is_bytes(buffer):
    lcm, got = DrakeLcm("memq://"), []
    lcm.Subscribe("A", got.append)
    with pytest.raises(TypeError, match="is no bytes"):
        lcm.Publish("A", buffer)
    lcm.HandleSubscriptions(0)
    assert got == []


def test_subscriptions_that_cannot_be():
    lcm = DrakeLcm("memq://")
    with pytest.raises(RuntimeError, match=r"'\(' is no regular expression"):
        lcm.SubscribeMultichannel("(", lambda channel, message: None)
    for subscribe in (lambda: lcm.Subscribe("A", 3), lambda: lcm.SubscribeMultichannel("A", 3)):
        with pytest.raises(TypeError, match="3 is no handler"):
            subscribe()
