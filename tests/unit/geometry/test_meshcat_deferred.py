"""What a visualizer defers is drawn when somebody looks, once, and at once while it is recorded."""

import threading

import pytest

from sheldrake.geometry import Meshcat, Sphere


@pytest.fixture
def meshcat():
    return Meshcat(port=0)


def draws(meshcat, drawn, name):
    def draw():
        drawn.append(name)
        meshcat.SetObject(f"forces/{name}", Sphere(1))

    return draw


def test_nobody_looks_nothing_is_drawn_and_then_the_last_alone(meshcat):
    drawn = []
    for name in "abc":
        meshcat._defer("forces", draws(meshcat, drawn, name))
    meshcat._defer("others", draws(meshcat, drawn, "d"))
    assert drawn == []
    assert meshcat.HasPath("forces/c") and meshcat.HasPath("forces/d") and not meshcat.HasPath("forces/a")
    assert drawn == ["c", "d"]


def test_pages_and_files_get_what_was_deferred(meshcat):
    drawn = []
    meshcat._defer("forces", draws(meshcat, drawn, "a"))
    meshcat.StaticHtml()
    assert drawn == ["a"]


def test_every_picture_of_a_recording_counts(meshcat):
    drawn = []
    meshcat._defer("forces", draws(meshcat, drawn, "a"))
    meshcat.StartRecording()
    meshcat._defer("others", draws(meshcat, drawn, "b"))
    assert sorted(drawn) == ["a", "b"]


def test_what_is_deleted_is_not_drawn_later(meshcat):
    drawn, begun, go = [], threading.Event(), threading.Event()

    def slow():
        begun.set()
        go.wait(60)
        draws(meshcat, drawn, "a")()

    meshcat._defer("forces", slow)
    looking = threading.Thread(target=meshcat.HasPath, args=("",))
    looking.start()
    begun.wait(60)
    deleting = threading.Thread(target=meshcat.Delete, args=("forces",))
    deleting.start()
    go.set()
    looking.join(60)
    deleting.join(60)
    assert drawn == ["a"] and not meshcat.HasPath("forces")
