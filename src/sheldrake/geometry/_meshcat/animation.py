"""MeshcatAnimation: poses and properties at integer frames, to be played back in the page."""

from __future__ import annotations

import collections
import enum
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked

from .tree import full_path

if TYPE_CHECKING:
    from sheldrake.math._rigid_transform import RigidTransform


def _javascript_type(value: Any) -> tuple[str, Any]:
    """Returns the kind of track a property value belongs to, and the value as plain Python."""
    if isinstance(value, (bool, np.bool_)):
        return "boolean", bool(value)
    if isinstance(value, (int, float, np.integer, np.floating)):
        return "number", float(value)
    return "vector", [float(v) for v in value]


@checked
class MeshcatAnimation:
    """Records where things are at each frame; Meshcat.SetAnimation() plays it.

    Args:
        frames_per_second: Playback rate [1/s], positive.

    Raises:
        ValueError: when frames_per_second is not positive.
    """

    class LoopMode(enum.IntEnum):
        """How playback goes on at the end."""

        kLoopOnce = 2200
        kLoopRepeat = 2201
        kLoopPingPong = 2202

        __str__ = enum.Enum.__str__

    def __init__(self, frames_per_second: float = 64.0):
        if not frames_per_second > 0:
            raise ValueError(f"MeshcatAnimation(): frames_per_second must be positive, got {frames_per_second}.")
        self._frames_per_second = float(frames_per_second)
        self._start_time = 0.0
        self._loop_mode = self.LoopMode.kLoopRepeat
        self._repetitions = 1
        self._autoplay = True
        self._clamp_when_finished = True
        # path -> {frame: pose, shape (3, 4)}
        self._poses_of_paths: dict[str, dict[int, np.ndarray]] = {}
        # frame, paths and their poses, not yet among the former: who records does not wait until they are sorted
        self._recorded: collections.deque[tuple[int, list[str], list[np.ndarray]]] = collections.deque()
        # path -> property -> (kind of track, {frame: value})
        self._tracks: dict[str, dict[str, tuple[str, dict[int, Any]]]] = {}

    def frames_per_second(self) -> float:
        """Returns the playback rate [1/s]."""
        return self._frames_per_second

    def frame(self, time_from_start: float) -> int:
        """Returns the frame number of a time [s], counted from start_time() and rounded down.

        Raises:
            ValueError: when the time lies before start_time().
        """
        if time_from_start < self._start_time:
            raise ValueError(
                f"MeshcatAnimation.frame(): time {time_from_start} s lies before start_time() = {self._start_time} s."
            )
        return math.floor((time_from_start - self._start_time) * self._frames_per_second)

    def start_time(self) -> float:
        """Returns the time of frame 0 [s]."""
        return self._start_time

    def set_start_time(self, time: float) -> None:
        """Sets the time of frame 0 [s]; frames that exist already stay."""
        self._start_time = float(time)

    def autoplay(self) -> bool:
        """Returns whether playback starts by itself."""
        return self._autoplay

    def set_autoplay(self, play: bool) -> None:
        """Sets whether playback starts by itself."""
        self._autoplay = bool(play)

    def loop_mode(self) -> LoopMode:
        """Returns how playback goes on at the end."""
        return self._loop_mode

    def set_loop_mode(self, mode: LoopMode) -> None:
        """Sets how playback goes on at the end."""
        self._loop_mode = self.LoopMode(mode)

    def repetitions(self) -> int:
        """Returns how often one press of "play" repeats the animation."""
        return self._repetitions

    def set_repetitions(self, repetitions: int) -> None:
        """Sets how often one press of "play" repeats the animation.

        Raises:
            ValueError: when it is not positive.
        """
        if int(repetitions) != repetitions or repetitions <= 0:
            raise ValueError(f"MeshcatAnimation.set_repetitions(): expected a positive integer, got {repetitions}.")
        self._repetitions = int(repetitions)

    def clamp_when_finished(self) -> bool:
        """Returns whether playback stays on the last frame."""
        return self._clamp_when_finished

    def set_clamp_when_finished(self, clamp: bool) -> None:
        """Sets whether playback stays on the last frame."""
        self._clamp_when_finished = bool(clamp)

    def SetTransform(self, frame: int, path: str, X_ParentPath: RigidTransform) -> None:
        """Sets where a path is at a frame.

        Args:
            frame: Frame number, not negative.
            path: Path in the scene.
            X_ParentPath: RigidTransform from the path to its parent.

        Raises:
            ValueError: when the frame is negative.
            RuntimeError: when "position" or "quaternion" of the path has a track of another kind.
        """
        path = full_path(path)
        for name, expected in (("position", "vector3"), ("quaternion", "quaternion")):
            if name in self._tracks.get(path, {}):
                kind = self._tracks[path][name][0]
                raise RuntimeError(
                    f"MeshcatAnimation.SetTransform(): property '{name}' of '{path}' already has a track of type "
                    f"{kind}, which is not {expected}."
                )
        self._set_pose(self._checked(frame), path, np.array(X_ParentPath.GetAsMatrix34(), dtype=float))

    def SetProperty(self, frame: int, path: str, property: str, value: object) -> None:
        """Sets a property of a path at a frame.

        Args:
            frame: Frame number, not negative.
            path: Path in the scene.
            property: Name of the property, for example "visible" or "opacity".
            value: A bool, a number or a list of numbers; the same kind at every frame.

        Raises:
            ValueError: when the frame is negative.
            RuntimeError: when the property has a track of another kind.
        """
        path, frame = full_path(path), self._checked(frame)
        kind, value = _javascript_type(value)
        if property in ("position", "quaternion") and path in self._poses:
            raise RuntimeError(
                f"MeshcatAnimation.SetProperty(): '{path}' already has a track of transforms, which sets '{property}'."
            )
        track = self._tracks.setdefault(path, {}).setdefault(property, (kind, {}))
        if track[0] != kind:
            raise RuntimeError(
                f"MeshcatAnimation.SetProperty(): property '{property}' of '{path}' already has a track of type "
                f"{track[0]}, got {kind}."
            )
        track[1][frame] = value

    @staticmethod
    def _checked(frame: int) -> int:
        if frame < 0 or int(frame) != frame:
            raise ValueError(f"MeshcatAnimation: a frame must be an integer >= 0, got {frame}.")
        return int(frame)

    def _set_pose(self, frame: int, path: str, pose: np.ndarray) -> None:
        """Keeps a pose, shape (3, 4), which nobody changes any more, under a full path."""
        track = self._poses.get(path)
        if track is None:
            track = self._poses[path] = {}
        track[frame] = pose

    def _set_poses(self, frame: int, paths: list[str], poses: list[np.ndarray]) -> None:
        """Keeps poses, shape (3, 4) each, under full paths; nobody changes either list any more."""
        self._recorded.append((frame, paths, poses))

    @property
    def _poses(self) -> dict[str, dict[int, np.ndarray]]:
        """Poses by path and frame, with all that was recorded until now."""
        while self._recorded:
            frame, paths, poses = self._recorded.popleft()
            for path, pose in zip(paths, poses):
                self._poses_of_paths.setdefault(path, {})[frame] = pose
        return self._poses_of_paths

    def _set_values(self, frame: int, paths: list[str], name: str, values: list[Any]) -> None:
        """Keeps one property of many full paths; values of the kind that the tracks have, if there are any."""
        tracks = self._tracks
        for path, value in zip(paths, values):
            found = tracks.get(path)
            if found is None or name not in found:
                self.SetProperty(frame, path, name, value)
            else:
                found[name][1][frame] = value

    def _num_frames(self) -> int:
        """Returns one more than the highest frame number, 0 when empty."""
        frames = [max(track) for track in self._poses.values()]
        frames += [max(values) for tracks in self._tracks.values() for _, values in tracks.values()]
        return 1 + max(frames, default=-1)
