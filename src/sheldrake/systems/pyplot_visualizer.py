"""A base for drawings of planar systems by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.framework import LeafSystem, PublishEvent, TriggerType

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation

    from sheldrake.systems.framework import Context

__all__ = ["PyPlotVisualizer"]


class PyPlotVisualizer(LeafSystem):
    """Draws its input in a matplotlib figure, periodically.

    A derived class declares input ports, sets up the axes `self.ax`, and overrides `draw(context)`, which is also given
    bare vectors when recordings and trajectories are animated.

    Args:
        draw_period: Time between drawings [s]; by default 1/30.
        facecolor: Color of the figure.
        figsize: Size of the figure [inch].
        ax: Axes to draw into, instead of a figure of its own.
        show: Whether to draw what is published, and to show the figure where matplotlib's backend can. By default,
            unless the backend is "template". Without it, recordings and `draw()` make the pictures.
    """

    def __init__(
        self,
        draw_period: float | None = None,
        facecolor: Any = (1, 1, 1),
        figsize: Any = None,
        ax: Any = None,
        show: bool | None = None,
    ):
        import matplotlib
        import matplotlib.pyplot as plt

        super().__init__()
        self.set_name("pyplot_visualization")
        self.timestep = draw_period or 1.0 / 30
        self.DeclarePeriodicPublishEvent(self.timestep, 0.0, self._on_publish)
        self.DeclareInitializationEvent(PublishEvent(TriggerType.kInitialization, self._on_initialization))
        self.DeclareForcedPublishEvent(self._on_publish)
        if ax is None:
            self.fig = plt.figure(facecolor=facecolor, figsize=figsize)
            self.ax = plt.axes()
            self.fig.add_axes(self.ax)
        else:
            self.ax, self.fig = ax, ax.get_figure()
        self.ax.axis("equal")
        self.ax.axis("off")
        if show is None:
            show = matplotlib.get_backend().lower() != "template"
        self._show, self._has_window = show, show and matplotlib.get_backend().lower() != "agg"
        if not show:
            plt.close(self.fig)
        self._is_recording = False
        self._recorded_contexts: list[Any] = []

    def _on_initialization(self, context: Context, event: Any) -> None:
        if self._has_window:
            self.fig.show()
        self._on_publish(context)

    def _on_publish(self, context: Context) -> None:
        if self._is_recording:
            snapshot = self.AllocateContext()
            snapshot.SetTimeStateAndParametersFrom(context)
            self.FixInputPortsFrom(self, context, snapshot)
            self._recorded_contexts.append(snapshot)
        if self._show:
            self.draw(context)
        if self._has_window:
            self.fig.canvas.draw()
            self.fig.canvas.flush_events()

    def draw(self, context: Context) -> None:
        """Draws one frame of a context, or of a bare vector; to be overridden."""
        raise NotImplementedError(f"{self._describe()} must override draw(context).")

    # Recording and animation.

    def start_recording(self) -> None:
        """Keeps what is published from now on."""
        self._is_recording = True

    def stop_recording(self) -> None:
        """Keeps no more."""
        self._is_recording = False

    def reset_recording(self) -> None:
        """Forgets the recording."""
        self._recorded_contexts = []

    def get_recording_as_animation(self, **kwargs: Any) -> Any:
        """The recording as a matplotlib animation; arguments go to FuncAnimation."""
        return self._animation(self._recorded_contexts, kwargs)

    def animate(self, log: Any, resample: bool = True, **kwargs: Any) -> Any:
        """A VectorLog or a Trajectory as a matplotlib animation; arguments go to FuncAnimation.

        Args:
            log: What was logged of the input.
            resample: Draw a log at even times.
            kwargs: For FuncAnimation.
        """
        if hasattr(log, "sample_times"):
            times, values = log.sample_times(), log.data()
            if resample and len(times) > 1:
                even = np.arange(times[0], times[-1], self.timestep)
                values = np.stack([np.interp(even, times, row) for row in values])
        else:
            times = np.arange(log.start_time(), log.end_time(), self.timestep)
            values = log.vector_values(times)
        return self._animation(list(values.T), kwargs)

    def _animation(self, frames: list, kwargs: dict) -> FuncAnimation:
        from matplotlib import animation

        return animation.FuncAnimation(
            fig=self.fig,
            func=lambda k: self.draw(frames[k]),
            frames=len(frames),
            interval=1000 * self.timestep,
            **kwargs,
        )
