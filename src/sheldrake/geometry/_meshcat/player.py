"""Playback of a recording in the live page: play, pause, a time slider, speed."""

from __future__ import annotations

import bisect
import time
from typing import Any

import numpy as np

from .animation import MeshcatAnimation
from .page import PERIOD, Page

_SPEEDS = ("0.1x", "0.25x", "0.5x", "1x", "2x", "4x", "8x")


class Frames:
    """An animation, ready to be looked up by frame number.

    Args:
        animation: What to look up; later changes of it are not seen.
    """

    def __init__(self, animation: MeshcatAnimation):
        self.num_frames = animation._num_frames()
        self.frames_per_second = animation.frames_per_second()
        self._poses = [(path, sorted(track), dict(track)) for path, track in animation._poses.items()]
        self._properties = [
            (path, name, sorted(values), dict(values))
            for path, tracks in animation._tracks.items()
            for name, (_, values) in tracks.items()
        ]

    def duration(self) -> float:
        """Returns the time of the last frame [s]."""
        return max(0, self.num_frames - 1) / self.frames_per_second

    def poses_at(self, frame: int) -> list[tuple[str, np.ndarray]]:
        """Returns the path and pose, shape (3, 4), of everything that moves, at the last record before a frame."""
        return [(path, track[_latest(frames, frame)]) for path, frames, track in self._poses if frames]

    def properties_at(self, frame: int) -> list[tuple[str, str, Any]]:
        """Returns path, name and value of every recorded property, at the last record before a frame."""
        return [
            (path, name, values[_latest(frames, frame)]) for path, name, frames, values in self._properties if frames
        ]

    def changes_at(self, frame: int) -> tuple[list[tuple[str, np.ndarray]], list[tuple[str, str, Any]]]:
        """Returns the poses and properties recorded exactly at a frame."""
        return (
            [(path, track[frame]) for path, _, track in self._poses if frame in track],
            [(path, name, values[frame]) for path, name, _, values in self._properties if frame in values],
        )


def _latest(frames: list[int], frame: int) -> int:
    return frames[max(0, bisect.bisect_right(frames, frame) - 1)]


class Player:
    """Plays an animation into a page and shows the buttons for it.

    Args:
        page: Where to play.
        animation: What to play.
    """

    def __init__(self, page: Page, animation: MeshcatAnimation):
        self._page = page
        self._frames = Frames(animation)
        self._loop_mode = animation.loop_mode()
        self._repetitions = animation.repetitions()
        self._clamp = animation.clamp_when_finished()
        self._playing = False
        self._time = 0.0
        self._round = 0
        self._stopped = False
        self._timer: Any = None
        gui = page._server.gui
        duration = self._frames.duration()
        with page._server.atomic():  # no page gets a button that nobody listens to yet
            self._folder = gui.add_folder("Recording")
            with self._folder:
                self._button = gui.add_button("Play")
                self._slider = gui.add_slider("Time [s]", 0.0, max(duration, 1e-3), 1e-3, 0.0)
                self._speed = gui.add_dropdown("Speed", _SPEEDS, initial_value="1x")

            @self._button.on_click
            async def _(_event: Any) -> None:
                self.pause() if self._playing else self.play()

            @self._slider.on_update
            async def _(event: Any) -> None:
                if event.client is not None:
                    self.pause()
                    self.show(float(event.target.value))

        if self._frames.num_frames:
            self.show(0.0)
            if animation.autoplay():
                self._page._server.get_event_loop().call_soon_threadsafe(self.play)

    def play(self) -> None:
        """Starts, or goes on; from the beginning when it had ended. In viser's thread only."""
        if self._stopped or self._playing:
            return
        if self._time >= self._frames.duration():
            self._time, self._round = 0.0, 0
        self._playing = True
        self._button.label = "Pause"
        self._tick(time.monotonic())

    def pause(self) -> None:
        """Stops where it is."""
        self._playing = False
        self._button.label = "Play"

    def _tick(self, before: float) -> None:
        with self._page._lock:
            if self._playing and not self._stopped:
                self._advance(before)

    def _advance(self, before: float) -> None:
        now = time.monotonic()
        self._time += (now - before) * float(self._speed.value[:-1])
        duration = self._frames.duration()
        if self._time >= duration:
            self._round += 1
            if self._loop_mode == MeshcatAnimation.LoopMode.kLoopOnce or self._round >= self._repetitions:
                self.show(duration if self._clamp else 0.0)
                self.pause()
                return
            self._time = 0.0
        self.show(self._time)
        self._timer = self._page._server.get_event_loop().call_later(PERIOD, self._tick, now)

    def show(self, time: float) -> None:
        """Shows the scene at a time of the recording [s]."""
        self._time = time
        shown = time
        if self._loop_mode == MeshcatAnimation.LoopMode.kLoopPingPong and self._round % 2:
            shown = self._frames.duration() - time
        frame = int(shown * self._frames.frames_per_second + 1e-9)
        server = self._page._server
        with self._page._lock, server.atomic():
            for path, pose in self._frames.poses_at(frame):
                self._page.show_pose(path, pose)
            for path, name, value in self._frames.properties_at(frame):
                self._page.show_property(path, name, value)
            self._slider.value = min(self._slider.max, round(shown, 3))

    def halt(self) -> None:
        """Ends playback for good: nothing is shown any more once this has returned."""
        with self._page._lock:
            self._stopped = True
            self._playing = False
            timer, self._timer = self._timer, None
        if timer is not None:
            try:
                self._page._server.get_event_loop().call_soon_threadsafe(timer.cancel)
            except RuntimeError:  # the server has stopped
                pass

    def stop(self) -> None:
        """Ends playback for good and takes the buttons away."""
        self.halt()
        self._folder.remove()
