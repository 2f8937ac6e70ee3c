"""Sanitised kernels stop where an address is in no array that they were given; else they do what others do."""

import os
import subprocess
import sys

import numpy as np
import pytest
from tests.unit.systems.framework.saved_run import build

from sheldrake.common.kernel import INDEX_ERROR, Vector, jit_enabled, kernel
from sheldrake.systems.analysis import Simulator

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")


@kernel(top=True)
def add_up(x: Vector, y: Vector) -> int:
    for i in range(len(x)):
        y[0] += x[i]
    return 0


def binding(size):
    x, y = np.ones(size), np.zeros(1)
    bound = add_up.bind(x, y)
    words, _ = bound.keep
    bound.keep = None
    return bound, words, x, y


def a_wrong_shape():
    bound, words, _x, y = binding(5)
    words[1] = 10_000  # what it was told of is longer than what there is
    return bound(), bool(y[0] < 10_000)


def an_address_that_has_grown_old():
    bound, _, x, y = binding(5000)
    del x
    return bound(), bool(y[0] == 0.0)


def an_address_that_never_was():
    bound, words, _x, y = binding(5)
    words[0] += 1 << 40
    return bound(), bool(y[0] == 0.0)


def what_is_right():
    bound, _, _x, y = binding(5)
    view = np.arange(8.0)[2:5]
    return bound(), y.tolist(), add_up.native(view, y), y.tolist()


def state_after_a_while():
    simulator = Simulator(build())
    simulator.AdvanceTo(0.1)
    context = simulator.get_context()
    return (
        context.get_discrete_state(0).value().tolist() + context.get_continuous_state_vector().CopyToVector().tolist()
    )


def in_a_process(call, sanitised="1"):
    environment = {
        **os.environ,
        "SHELDRAKE_SANITIZE": sanitised,
        "SHELDRAKE_QUIET": "1",
        "PYTHONPATH": os.pathsep.join(os.path.abspath(p) for p in sys.path),
    }
    code = f"from {__name__} import {call}; print({call}())"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.parametrize("call", [a_wrong_shape, an_address_that_has_grown_old, an_address_that_never_was])
def test_a_kernel_that_leaves_what_it_was_given_stops_there(call):
    assert in_a_process(call.__name__) == str((INDEX_ERROR, True))


def test_what_is_right_runs():
    assert in_a_process("what_is_right") == str((0, [5.0], 0, [14.0]))


@pytest.mark.slow
def test_a_whole_run_comes_to_the_same_end():
    """A block that falls on the ground, a controller, noise, logs: every kernel's loads and stores are looked at."""
    found, wanted = (eval(in_a_process("state_after_a_while", sanitised)) for sanitised in "10")
    assert np.allclose(found, wanted, rtol=1e-9, atol=1e-12)  # sums are not fused over a check
