"""A Meshcat's panel: time and rate, buttons, sliders, gamepad."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .controls import Gamepad
from .realtime import RealtimeRateCalculator

if TYPE_CHECKING:
    from .hub import Hub


class Panel:
    """Time and rate, buttons, sliders, a gamepad.

    Args:
        hub: What the page shows and says.
        period: Wall time between two rates [s].
    """

    def __init__(self, hub: Hub, period: float):
        self._hub, self.rate_calculator, self._rate = hub, RealtimeRateCalculator(period), 0.0

    def SetRealtimeRate(self, rate: float) -> None:
        """Shows how fast simulated time runs; 1 is real time."""
        self._rate = float(rate)
        if self._hub.status is not None:
            self._hub.status.show(None, self._rate)

    def GetRealtimeRate(self) -> float:
        """Returns the rate that was shown last."""
        return self._rate

    def SetSimulationTime(self, sim_time: float) -> None:
        """Says what simulation time [s] is shown, from which the realtime rate is measured."""
        rate = self.rate_calculator.update(float(sim_time))
        if rate is not None:
            self._rate = rate
        if self._hub.status is not None:
            self._hub.status.show(float(sim_time), rate)

    def AddButton(self, name: str, keycode: str = "") -> None:
        """Adds a button; one that exists starts counting from zero again.

        Args:
            name: Label.
            keycode: Key that also presses it, by its name in JavaScript ("KeyG", "ArrowLeft").

        Raises:
            RuntimeError: when a slider has the name, or the button has another keycode.
        """
        self._hub.controls.add_button(name, keycode)

    def GetButtonClicks(self, name: str) -> int:
        """Returns how often a button was pressed, in all pages together.

        Raises:
            RuntimeError: when there is no such button.
        """
        return self._hub.controls.button_clicks(name)

    def GetButtonNames(self) -> list[str]:
        """Returns the names of all buttons."""
        return self._hub.controls.button_names()

    def DeleteButton(self, name: str, strict: bool = True) -> bool:
        """Removes a button; returns whether it was there.

        Raises:
            RuntimeError: when it was not, and `strict`.
        """
        return self._hub.controls.delete_button(name, strict)

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
            RuntimeError: when the name is taken.
            ValueError: when the step is not positive or min is above max.
        """
        return self._hub.controls.add_slider(name, min, max, step, value, decrement_keycode, increment_keycode)

    def GetSliderValue(self, name: str) -> float:
        """Returns where a slider stands.

        Raises:
            RuntimeError: when there is no such slider.
        """
        return self._hub.controls.slider_value(name)

    def SetSliderValue(self, name: str, value: float) -> float:
        """Moves a slider in every page and returns the value it took.

        Raises:
            RuntimeError: when there is no such slider.
        """
        return self._hub.controls.set_slider_value(name, value)

    def GetSliderNames(self) -> list[str]:
        """Returns the names of all sliders."""
        return self._hub.controls.slider_names()

    def DeleteSlider(self, name: str, strict: bool = True) -> bool:
        """Removes a slider; returns whether it was there.

        Raises:
            RuntimeError: when it was not, and `strict`.
        """
        return self._hub.controls.delete_slider(name, strict)

    def DeleteAddedControls(self) -> None:
        """Removes every button and slider."""
        self._hub.controls.delete_all()

    def _notify(self, title: str, text: str) -> None:
        """Shows a note in every page that is open, until somebody closes it."""
        for client in self._hub.server.get_clients().values():
            client.add_notification(title, text)

    def GetGamepad(self) -> Gamepad:
        """Returns the last state of a gamepad seen by a page; its index is None when there was none."""
        return self._hub.controls.gamepad()
