"""Diagrams of chance, stepped by sanitised kernels, and scenes with contact among them."""

from __future__ import annotations

import random

from tests.unit.systems.framework import test_random_diagrams


def random_diagrams(chance: random.Random, number: int) -> None:
    """A nested diagram of many clocks: native, interpreted and by an oracle, bit for bit."""
    test_random_diagrams.compare(chance.getrandbits(32))
