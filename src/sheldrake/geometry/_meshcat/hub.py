"""What lives behind a Meshcat: the scene, the server, the page, the player."""

from __future__ import annotations

import socket
import threading

from .animation import MeshcatAnimation
from .controls import Controls
from .export import TITLE, static_html, static_zip
from .grabs import Grabs
from .page import Page
from .params import MeshcatParams
from .player import Player
from .realtime import StatusLine
from .scripts import LIVE_PAGE
from .server import Gatekeeper, Site, client_page, start_viser, stop_viser
from .tree import SceneTree


class Hub:
    """What lives behind a Meshcat. The server's thread holds this, never the Meshcat itself."""

    def __init__(self, params: MeshcatParams, listener: socket.socket):
        self.tree = SceneTree()
        self.lock = threading.RLock()
        self.animation = MeshcatAnimation()
        self.recording = False
        self.show_while_recording = True
        self.published: MeshcatAnimation | None = None
        self.player: Player | None = None
        public = params.web_url_pattern.format(host="localhost", port=0).partition("//")[2]
        gatekeeper = Gatekeeper(params.host, public.partition("/")[0].partition(":")[0])
        downloads = {
            "/download": ("text/html; charset=utf-8", lambda: self.static_html().encode()),
            "/download.zip": ("application/zip", self.static_zip),
        }
        page = client_page(LIVE_PAGE, TITLE)
        self.server = start_viser(listener, Site(gatekeeper, page, downloads))
        self.page = Page(self.server, self.tree)
        self.status = StatusLine(self.server) if params.show_stats_plot else None
        self.grabs = Grabs(self.tree)
        self.controls = Controls(self.server, self.grabs)
        self.tree.on_change = self.page.wake

    def static_html(self) -> str:
        return static_html(self.page, self.published)

    def static_zip(self) -> bytes:
        return static_zip(self.page, self.published)

    def notify(self, title: str, text: str) -> None:
        """Shows a note in every page that is open, until somebody closes it."""
        for client in self.server.get_clients().values():
            client.add_notification(title, text)

    def stop(self) -> None:
        with self.lock:
            if self.player is not None:
                self.player.halt()
        stop_viser(self.server)


def stop(hub: Hub) -> None:
    """Stops a hub; for finalizers, which must not know the Meshcat."""
    hub.stop()
