"""Buttons, sliders, keys, gamepad and camera reports: what comes back from the page."""

from __future__ import annotations

import copy
import dataclasses
import json
import logging
import math
import threading
from typing import TYPE_CHECKING, Any, TypeVar

from sheldrake.common._options import Options

from .grabs import Grabs
from .server import Sweeper

if TYPE_CHECKING:
    import numpy as np
    import viser


log = logging.getLogger("drake")


class Gamepad(Options):
    """The last state of a gamepad seen by a page.

    Attributes:
        index: Number of the gamepad, None when none was seen.
        button_values: How far each button is pressed, in [0, 1].
        axes: Each axis, in [-1, 1].
    """

    index: int | None = None
    button_values: list[float] = []
    axes: list[float] = []


@dataclasses.dataclass
class _Button:
    keycode: str
    clicks: int = 0
    handle: Any = None


@dataclasses.dataclass
class _Slider:
    min: float
    max: float
    step: float
    value: float
    decrement_keycode: str
    increment_keycode: str
    handle: Any = None

    def quantized(self, value: float) -> float:
        """Returns the value kept in the range and rounded to a multiple of the step, as Drake does."""
        value = min(self.max, max(self.min, value))
        value = math.copysign(math.floor(abs(value) / self.step + 0.5), value) * self.step
        return min(self.max, max(self.min, value))


_Control = TypeVar("_Control", _Button, _Slider)


class Controls:
    """Buttons, sliders and gamepad of a Meshcat, and what else its pages say.

    Args:
        server: A viser.ViserServer.
        grabs: What pages may hold with the mouse.
    """

    def __init__(self, server: viser.ViserServer, grabs: Grabs):
        self._server, self._grabs = server, grabs
        self._lock = threading.RLock()
        self._buttons: dict[str, _Button] = {}
        self._sliders: dict[str, _Slider] = {}
        self._gamepad = Gamepad()
        self._tracked: set[int] = set()
        self._order = -1e5  # of the last button: they come before the sliders, of which there may be many
        self.is_shown = False  # whether a page has drawn something
        self._sweeper = Sweeper(server)
        self._sent_keys: Any = None
        self._camera_pose: Any = None
        self._channel = server.gui.add_text("channel", "", visible=False)

        @self._channel.on_update
        async def _(event: Any) -> None:
            self._hear(event.target.value, event.client_id)

        self._send_keys()
        grabs.on_offer = self._send_keys

        async def let_go(connection: Any) -> None:
            grabs.end(int(connection.client_id))

        server._websock_server.on_client_disconnect(let_go)

    def AddButton(self, name: str, keycode: str = "") -> None:
        """Adds a button; one that exists starts counting from zero again.

        Args:
            name: Label.
            keycode: Key that also presses it, by its name in JavaScript ("KeyG", "ArrowLeft").

        Raises:
            RuntimeError: when a slider has the name, or the button has another keycode.
        """
        with self._lock:
            if name in self._sliders:
                raise RuntimeError(f"Meshcat.AddButton(): there is a slider named '{name}' already.")
            button = self._buttons.get(name)
            if button is not None:
                if button.keycode and button.keycode != keycode:
                    raise RuntimeError(
                        f"Meshcat.AddButton(): button '{name}' already has keycode '{button.keycode}', which is not "
                        f"'{keycode}'. To give it another one, delete the button first."
                    )
                button.keycode, button.clicks = keycode, 0
            else:
                button = _Button(keycode)
                with self._server.atomic():  # no page gets a button that nobody listens to yet
                    hint = f"Key: {keycode}" if keycode else None
                    self._order += 1
                    button.handle = self._server.gui.add_button(name, hint=hint, order=self._order)

                    @button.handle.on_click
                    async def _(_event: Any) -> None:
                        self._click(name)

                    self._buttons[name] = button  # last: Ctrl-C may come at any line

            self._send_keys()

    def _click(self, name: str) -> None:
        with self._lock:
            if name in self._buttons:
                self._buttons[name].clicks += 1

    def GetButtonNames(self) -> list[str]:
        """Returns the names of all buttons, sorted."""
        with self._lock:
            return sorted(self._buttons)

    def GetButtonClicks(self, name: str) -> int:
        """Returns how often a button was pressed, in all pages together.

        Raises:
            RuntimeError: when there is no such button.
        """
        with self._lock:
            return self._known("GetButtonClicks", "button", self._buttons, name).clicks

    def DeleteButton(self, name: str, strict: bool = True) -> bool:
        """Removes a button; returns whether it was there.

        Raises:
            RuntimeError: when it was not, and `strict`.
        """
        return self._delete("DeleteButton", "button", self._buttons, name, strict)

    def AddSlider(
        self,
        name: str,
        min: float,
        max: float,
        step: float,
        value: float,
        decrement_keycode: str = "",
        increment_keycode: str = "",
    ) -> float:
        """Adds a slider and returns its value, kept in the range and rounded to a multiple of the step.

        Args:
            name: Label.
            min: Lowest value.
            max: Highest value.
            step: Least change.
            value: First value.
            decrement_keycode: Key that lowers it by a step, by its name in JavaScript.
            increment_keycode: Key that raises it by a step.

        Raises:
            RuntimeError: when the name is taken, the step is not positive, or min is above max.
        """
        with self._lock:
            for kind, known in (("slider", self._sliders), ("button", self._buttons)):
                if name in known:
                    raise RuntimeError(f"Meshcat.AddSlider(): Meshcat already has a {kind} named {name}.")
            if not (step > 0 and math.isfinite(step)):
                raise RuntimeError(f"Meshcat.AddSlider(): step of '{name}' must be positive, got {step}.")
            if not min <= max:
                raise RuntimeError(f"Meshcat.AddSlider(): min of '{name}' is above its max: {min} > {max}.")
            slider = _Slider(float(min), float(max), float(step), 0.0, decrement_keycode, increment_keycode)
            slider.value = slider.quantized(value)
            with self._server.atomic():
                slider.handle = self._server.gui.add_slider(
                    name, min=slider.min, max=slider.max, step=slider.step, initial_value=slider.value
                )

                @slider.handle.on_update
                async def _(event: Any) -> None:
                    if event.client is not None:
                        self._slide(name, event.target.value)

                self._sliders[name] = slider

            self._send_keys()
            return slider.value

    def _slide(self, name: str, value: float) -> None:
        with self._lock:
            if name in self._sliders and isinstance(value, (int, float)) and math.isfinite(value):
                slider = self._sliders[name]
                slider.value = min(slider.max, max(slider.min, float(value)))

    def GetSliderNames(self) -> list[str]:
        """Returns the names of all sliders, sorted."""
        with self._lock:
            return sorted(self._sliders)

    def GetSliderValue(self, name: str) -> float:
        """Returns where a slider stands.

        Raises:
            RuntimeError: when there is no such slider.
        """
        with self._lock:
            return self._known("GetSliderValue", "slider", self._sliders, name).value

    def SetSliderValue(self, name: str, value: float) -> float:
        """Moves a slider in every page and returns the value it took.

        Raises:
            RuntimeError: when there is no such slider.
        """
        with self._lock:
            slider = self._known("SetSliderValue", "slider", self._sliders, name)
            slider.value = slider.quantized(float(value))
            slider.handle.value = slider.value
            return slider.value

    def DeleteSlider(self, name: str, strict: bool = True) -> bool:
        """Removes a slider; returns whether it was there.

        Raises:
            RuntimeError: when it was not, and `strict`.
        """
        return self._delete("DeleteSlider", "slider", self._sliders, name, strict)

    @staticmethod
    def _known(call: str, kind: str, controls: dict[str, _Control], name: str) -> _Control:
        if name not in controls:
            raise RuntimeError(
                f"Meshcat.{call}(): Meshcat does not have any {kind} named {name}. "
                f"The registered {kind} names are ({', '.join(sorted(controls))})."
            )
        return controls[name]

    def _delete(self, call: str, kind: str, controls: dict[str, _Control], name: str, strict: bool) -> bool:
        with self._lock:
            if name not in controls and not strict:
                return False
            self._known(call, kind, controls, name).handle.remove()
            del controls[name]
            self._send_keys()
            return True

    def DeleteAddedControls(self) -> None:
        """Removes every button and slider."""
        for name in self.GetButtonNames():
            self.DeleteButton(name, strict=False)
        for name in self.GetSliderNames():
            self.DeleteSlider(name, strict=False)

    def GetGamepad(self) -> Gamepad:
        """Returns the last state of a gamepad seen by a page; its index is None when there was none."""
        return copy.copy(self._gamepad)

    def tracked_camera_pose(self) -> tuple[np.ndarray, np.ndarray] | list[float] | None:
        """Returns wxyz, shape (4,), and position [m], shape (3,), of the page that reports its camera, or None.

        The camera's axes: x right, y down, z forward.
        """
        clients = self._server.get_clients()
        tracked = [clients[c].camera for c in self._tracked if c in clients]
        if not tracked:
            return self._camera_pose
        camera = max(tracked, key=lambda camera: camera.update_timestamp)
        return camera.wxyz, camera.position

    def newest_camera_pose(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns the same of the page whose camera moved last, or None."""
        cameras = [client.camera for client in self._server.get_clients().values() if client.camera.update_timestamp]
        if not cameras:
            return None
        camera = max(cameras, key=lambda camera: camera.update_timestamp)
        return camera.wxyz, camera.position

    def _send_keys(self) -> None:
        with self._lock:
            self._send_script()

    def _send_script(self) -> None:
        """Tells pages which keys count, and which bodies the mouse may hold."""
        from viser import _messages

        keys = {button.keycode for button in self._buttons.values()}
        for slider in self._sliders.values():
            keys |= {slider.decrement_keycode, slider.increment_keycode}
        own = {"channel": self._channel._impl.uuid, "keys": sorted(keys - {""}), "bodies": self._grabs.bodies()}
        source = f"window.__sheldrake = Object.assign(window.__sheldrake || {{}}, {json.dumps(own)});"
        self._sweeper.sweep_if_due()
        if self._sent_keys is not None:
            if self._sent_keys.source == source:
                return
            self._sweeper.drop(self._sent_keys)
        self._sent_keys = _messages.RunJavascriptMessage(source=source)
        self._server._websock_server.queue_message(self._sent_keys)

    def _hear(self, text: str, client_id: int | None) -> None:
        """Takes one message of the page's script."""
        if not text:
            return
        try:
            self.receive(json.loads(text), client_id)
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            log.debug("a page said something unreadable: %r", error)

    def receive(self, message: dict[str, Any], client_id: int | None = None) -> None:
        """Acts on a message from a page: key, button, slider, gamepad, mouse, camera, that it has drawn something.

        Raises:
            ValueError, TypeError, KeyError: when it is not one of these.
        """
        kind = message["type"]
        if kind == "key":
            self._press(str(message["code"]))
        elif kind == "button":
            self._click(str(message["name"]))
        elif kind == "slider":
            self._slide(str(message["name"]), message["value"])
        elif kind == "gamepad":
            pad = message["gamepad"]
            self._gamepad = Gamepad(
                index=None if pad["index"] is None else int(pad["index"]),
                button_values=[float(v) for v in pad["button_values"]],
                axes=[float(v) for v in pad["axes"]],
            )
        elif kind == "mouse_drag":
            self._grabs.receive(message, client_id)
        elif kind == "shown":
            self.is_shown = True
        elif kind == "tracked_camera" and client_id is not None:
            self._tracked.add(client_id)
        elif kind == "camera_pose":
            self._camera_pose = message["camera_pose"] if message["is_perspective"] else None
        else:
            raise ValueError(f"a page sent a message of unknown type {kind!r}")

    def _press(self, code: str) -> None:
        with self._lock:
            for button in self._buttons.values():
                button.clicks += button.keycode == code
            for name, slider in self._sliders.items():
                steps = (slider.increment_keycode == code) - (slider.decrement_keycode == code)
                if steps:
                    self.SetSliderValue(name, slider.value + steps * slider.step)
