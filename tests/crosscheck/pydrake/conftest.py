"""Garbage of pydrake is collected by the thread that made it, whose end it otherwise is.

pydrake's viewers and their sliders end the process where another thread takes them away, and Python collects garbage in
whatever thread happens to allocate: so not by itself here, but after each file of tests.
"""

import gc

import pytest

gc.disable()


@pytest.fixture(autouse=True, scope="module")
def garbage_is_collected_here():
    yield
    gc.collect()
