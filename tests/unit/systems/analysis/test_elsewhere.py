"""A span in another memory: all that holds an address is a relocation, so a diagram may run where it was not built."""

import numpy as np
import pytest
from tests.scenes.scene import drop, library

import sheldrake
from sheldrake.common._native.binding import HERE, Words, arguments
from sheldrake.common.kernel import jit_enabled
from sheldrake.systems.analysis._span import Span
from sheldrake.systems.framework._kernels import loop

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")


class Image:
    """A memory of its own, in one piece, into which arrays are copied when they are first asked for."""

    def __init__(self, size: int):
        self.memory, self.end = np.full(size, 2**63 - 1, np.int64), 0
        self.parts: dict[int, np.ndarray] = {}

    def part(self, array: np.ndarray) -> np.ndarray:
        """The copy of an array."""
        key = HERE.place(array)
        if key not in self.parts:
            begin, self.end = self.end, self.end + array.size
            assert self.end <= self.memory.size
            self.parts[key] = self.memory[begin : self.end]
            self.parts[key][:] = array.reshape(-1).view(np.int64)
        return self.parts[key]

    def place(self, array: np.ndarray) -> int:
        return HERE.place(self.part(array))

    def address(self, kernel) -> int:
        return HERE.address(kernel)


def moved(span: Span, T: float, image: Image) -> tuple[int, np.ndarray, np.ndarray]:
    """Runs the span in the image; its status, and slab and log afterwards."""
    store = span.store
    given, _ = arguments(loop.advance, (*span._tables(), span.table, T))
    words = given.placed(image)
    rows = store.layout.arguments.placed(image)
    image.part(span.program.words)[: len(rows)] = rows
    status = loop.advance.function(0.0, None, HERE.place(words))
    return status, image.part(store.S).view(float).copy(), image.part(store.L).view(float).copy()


def span_of(simulator) -> Span:
    simulator.Initialize()
    span = simulator._span
    assert span.native
    return span


def falling_block():
    block = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
    simulator, *_ = drop(library("sheldrake"), block, height=0.005, rpy=(0.0, 0.0, 0.1))
    simulator.AdvanceTo(0.02)
    return span_of(simulator)


def test_a_span_in_another_memory_gives_the_same_bits():
    here, there = falling_block(), falling_block()
    before = there.store.S.copy()
    status, S, L = moved(there, 0.06, Image(10**6))
    assert here.advance(0.06) == status
    np.testing.assert_array_equal(there.store.S, before)
    assert S.tobytes() == here.store.S.tobytes()
    samples = int(here.store.I[here.layout.log0 + 2])
    logged = samples * 14  # time and 13 states; what lies behind has never been written
    assert samples > 50
    assert L[:logged].tobytes() == here.store.L[:logged].tobytes()
    assert S[0] == 0.06


def test_a_forgotten_relocation_is_noticed():
    """The planted fault: the solver's model is found where it was, and the copy in the image is not used."""
    span = falling_block()
    image = Image(10**6)
    layout = span.store.layout
    whole = layout.arguments
    layout.arguments = Words(whole.placed(), whole.relocations[1:])
    try:
        moved(span, 0.06, image)
    finally:
        layout.arguments = whole
    assert HERE.place(whole.relocations[0].array) not in image.parts
