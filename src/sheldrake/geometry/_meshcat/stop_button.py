"""Loops that follow a page until somebody presses a button in it."""

from __future__ import annotations

import time
from collections.abc import Iterator

from sheldrake.common._ctrl_c import deferred_ctrl_c

from .meshcat import Meshcat

_POLL = 0.05  # time between two looks at the page [s]


def until_stopped(meshcat: Meshcat, button: str, keycode: str, timeout: float | None) -> Iterator[None]:
    """Shows a button and goes around until it is pressed or time is over; at least once.

    Args:
        meshcat: The page.
        button: Name of the button.
        keycode: Key that also presses it; "" for none.
        timeout: Wall time to stay at most [s]; for ever if None.

    Raises:
        KeyboardInterrupt: on Ctrl-C, between two rounds.
    """
    deadline = None if timeout is None else time.monotonic() + timeout
    meshcat.AddButton(button, keycode)
    keys = f"Keys: {keycode} stops" if keycode else "no key"
    print(f"Press the '{button}' button in the page to continue ({keys}).", flush=True)
    with deferred_ctrl_c() as check:
        try:
            while True:
                check()
                yield
                if meshcat.GetButtonClicks(button) > 0:
                    break
                if deadline is not None and time.monotonic() >= deadline:
                    break
                time.sleep(_POLL if deadline is None else max(0.0, min(_POLL, deadline - time.monotonic())))
        finally:
            meshcat.DeleteButton(button, strict=False)
