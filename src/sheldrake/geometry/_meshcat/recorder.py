"""A Meshcat's recording, and pages that replay it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .animation import MeshcatAnimation
from .player import Player

if TYPE_CHECKING:
    from .hub import Hub


class Recorder:
    """Records, and makes pages of what was recorded.

    Args:
        hub: The scene and its recording.
    """

    def __init__(self, hub: Hub):
        self._hub = hub

    def StartRecording(self, frames_per_second: float = 64.0, set_visualizations_while_recording: bool = True) -> None:
        """Starts recording what is set with a time_in_recording, on top of what was recorded before.

        Args:
            frames_per_second: Rate of the recording [1/s].
            set_visualizations_while_recording: Whether the page shows it meanwhile, too.
        """
        hub = self._hub
        if hub.animation.frames_per_second() != frames_per_second:
            hub.animation = MeshcatAnimation(frames_per_second)
        hub.recording = True
        hub.show_while_recording = bool(set_visualizations_while_recording)

    def _is_recording(self) -> bool:
        """Returns whether it records now."""
        return self._hub.recording

    def _has_published(self) -> bool:
        """Returns whether a page has something to replay."""
        return self._hub.player is not None

    def StopRecording(self) -> None:
        """Stops recording; what was recorded stays."""
        self._hub.recording = False

    def PublishRecording(self) -> None:
        """Plays what was recorded in the page and puts it into StaticHtml()."""
        self.SetAnimation(self._hub.animation)

    def DeleteRecording(self) -> None:
        """Forgets what was recorded; a page that plays it goes on."""
        self._hub.animation = MeshcatAnimation(self._hub.animation.frames_per_second())

    def get_mutable_recording(self) -> MeshcatAnimation:
        """Returns the recording, valid until DeleteRecording()."""
        return self._hub.animation

    def SetAnimation(self, animation: MeshcatAnimation) -> None:
        """Plays an animation in the page, with a time slider, and puts it into StaticHtml()."""
        hub = self._hub
        hub.page.sync()
        with hub.lock:
            if hub.player is not None:
                hub.player.stop()
                hub.player = None
            hub.published = animation
            if animation._num_frames() > 0:
                hub.player = Player(hub.page, animation)

    def StaticHtml(self) -> str:
        """Returns the scene, with the published animation, as one HTML page that needs no network."""
        return self._hub.static_html()

    def StaticZip(self) -> bytes:
        """Returns the same as a ZIP file with the page and the scene apart, to be put on a web server."""
        return self._hub.static_zip()
