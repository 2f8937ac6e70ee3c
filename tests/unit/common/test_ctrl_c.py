"""Ctrl-C in loops that wait for people: never lost, never in the middle."""

import signal
import threading

import pytest

from sheldrake.common._ctrl_c import deferred_ctrl_c, imported


@pytest.fixture(autouse=True)
def default_handler():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def press():
    signal.raise_signal(signal.SIGINT)


def test_it_waits_for_the_question():
    done = []
    with pytest.raises(KeyboardInterrupt), deferred_ctrl_c() as check:
        check()
        press()
        done.append("the rest of the round")
        check()
        done.append("another round")
    assert done == ["the rest of the round"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_second_counts_at_once_and_none_is_forgotten():
    done = []
    with pytest.raises(KeyboardInterrupt), deferred_ctrl_c():
        press()
        done.append("after the first")
        press()
        done.append("after the second")
    assert done == ["after the first"]
    with pytest.raises(KeyboardInterrupt), deferred_ctrl_c():
        press()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_whoever_was_told_inside_is_not_told_again_outside():
    with deferred_ctrl_c() as check:
        press()
        with pytest.raises(KeyboardInterrupt):
            check()
        check()


def test_where_the_garbage_collector_would_lose_it():
    class Swallows:
        def __del__(self):
            press()

    with pytest.raises(KeyboardInterrupt), deferred_ctrl_c() as check:
        Swallows()
        check()


def test_threads_and_others_handlers_are_left_alone():
    heard = []
    signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    with deferred_ctrl_c() as check:
        press()
        check()
    assert heard == [1]
    passed = []

    def inside():
        with deferred_ctrl_c() as check:
            check()
            passed.append(1)

    thread = threading.Thread(target=inside)
    thread.start()
    thread.join()
    assert passed == [1]


def test_a_module_that_catches_everything_does_not_lose_it(tmp_path, monkeypatch):
    careless = (
        "import signal\ntry:\n    signal.raise_signal(signal.SIGINT)\nexcept BaseException:\n    pass\nwhole = 1\n"
    )
    (tmp_path / "careless_module.py").write_text(careless)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        imported("careless_module")
    assert imported("careless_module").whole == 1
