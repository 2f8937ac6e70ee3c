"""Trials that go wrong in every way there is, for the test of the machinery; nothing that takes long is imported."""

import ctypes
import re
import threading
import time


def bad_every_fifth(chance, number):
    """Crashes, hangs in machine code, waits for ever, breaks a promise, raises what no user should see."""
    if number == 0:
        ctypes.string_at(0)
    elif number == 5:
        re.match("(a+)+$", "a" * 60 + "b")
    elif number == 10:
        threading.Event().wait()
    elif number == 15:
        raise AssertionError("dropped")
    elif number == 20:
        raise KeyError("x")


def sleepy(chance, number):
    time.sleep(0.2)


def always_bad(chance, number):
    assert chance.random() > 2.0
