"""What all tests share: no windows, no progress lines, less noise; and which suites also run without machine code."""

from __future__ import annotations

import logging
import os
import pathlib
import signal

import pytest

os.environ.setdefault("SHELDRAKE_PROGRESS", "0")
os.environ.setdefault("MPLBACKEND", "Agg")
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job starts with Ctrl-C ignored

TESTS = pathlib.Path(__file__).parent
TWINS = (
    "unit/common/test_kernel.py",
    "unit/geometry/test_half_space_contacts.py",
    "unit/multibody/contact_solvers",
    "unit/multibody/tree",
    "unit/systems/framework",
    "unit/systems/primitives",
    "scenes/test_bits.py",
)
"""Suites that say something with SHELDRAKE_JIT=0 and SHELDRAKE_BOUNDSCHECK=1, and are quick without a compiler."""


@pytest.fixture
def quiet():
    """Warnings and errors that a test causes over and over, on purpose, are not printed."""
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.CRITICAL)
    yield
    log.setLevel(level)


@pytest.fixture
def meshcat():
    """A page of its own, at any free port."""
    from sheldrake.geometry import Meshcat

    return Meshcat(port=0)


def pytest_collection_modifyitems(items):
    for item in items:
        path = item.path.relative_to(TESTS).as_posix()
        if path.startswith(TWINS):
            item.add_marker(pytest.mark.twin)
