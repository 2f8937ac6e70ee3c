"""Runs a frozen diagram in this process, without the systems that it was made of."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native import store
from sheldrake.common._native.binding import HERE
from sheldrake.export._frozen import FrozenDiagram
from sheldrake.systems.framework._kernels.program import BREAK, DONE, ROOM, TERMINATED

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_BUDGET = 1 << 20
"""Steps until Python looks in."""


class FrozenSimulation:
    """Steps a frozen diagram; it begins where the simulator stood that was frozen.

    Args:
        frozen: What is run. Kernels are compiled when they are not in the user's cache.

    Raises:
        ModuleNotFoundError: kernels must be compiled, and llvmlite is not installed.
    """

    def __init__(self, frozen: FrozenDiagram):
        self.frozen = frozen
        self._about = about = frozen.description
        loaded = [store.load_text(f["text"], f["symbol"], f["short_loops"]) for f in about["functions"]]
        self._functions = [function for function, _ in loaded]
        self._addresses = [address for _, address in loaded]
        self._words = np.zeros(about["memory"]["size"], np.int64)
        self._numbers = self._words.view(float)
        self._base = HERE.place(self._words)
        slab = about["memory"]["slab"]
        self._slab = self._numbers[slab : slab + about["memory"]["num_slab"]]
        self.Reset()

    def Reset(self) -> None:
        """Back to the beginning."""
        about = self._about
        self._words[:] = np.frombuffer(self.frozen.image, np.int64)
        for at, to, absolute in about["fixups"]:
            address = self._base + to
            self._words[at] = address if absolute else address >> 3
        table = about["memory"]["table"]
        for r, function in enumerate(about["rows"]):
            if function >= 0:
                self._words[table + r] = self._addresses[function]
        self._samples: list[list[np.ndarray]] = [[] for _ in about["logs"]]

    def get_time(self) -> float:
        """Simulated time [s]."""
        return float(self._slab[0])

    def AdvanceTo(self, boundary_time: float) -> None:
        """Advances to a time [s]; updates due just then stay pending, as with `Simulator.AdvanceTo`.

        Raises:
            RuntimeError: the time lies in the past, or a step failed: it names the system.
        """
        T, words = float(boundary_time), self._about["words"]
        if not self.get_time() <= T:
            raise RuntimeError(f"AdvanceTo(): boundary_time {T} lies before the current time {self.get_time()}.")
        self._words[words["fresh"]] = 1
        self._numbers[words["t_break"]] = np.inf
        while True:
            self._words[words["budget"]] = _BUDGET
            code = self._call("advance", T=T)
            if code == ROOM:
                self._take_samples()
            elif code in (DONE, TERMINATED):
                return
            elif code != BREAK:
                self._raise()

    def _call(self, name: str, **numbers: float) -> int:
        call = self._about["calls"][name]
        for parameter, value in numbers.items():
            self._numbers[call["words"] + call["numbers"][parameter]] = value
        where = ctypes.c_void_p(self._base + 8 * call["words"])
        return self._functions[call["function"]](0.0, ctypes.c_void_p(None), where)

    def _raise(self) -> None:
        words, names = self._about["words"], self._about["row_names"]
        status, r = int(self._words[words["status"]]), int(self._words[words["row"]])
        self._words[words["status"]] = 0
        name = names[r] if 0 <= r < len(names) else "the integrator: accuracy asks for too small a step"
        raise RuntimeError(f"{name} failed with status {status} at t = {self.get_time()} s.")

    # Values.

    def _find(self, kind: str, name: str) -> dict[str, Any]:
        known = {v["name"]: v for v in self._about[kind]}
        if name not in known:
            raise ValueError(
                f"There is no {name!r} among the {kind}; there are {', '.join(map(repr, known)) or 'none'}."
            )
        return known[name]

    def _vector(self, about: dict[str, Any]) -> np.ndarray:
        return self._slab[about["at"] : about["at"] + len(about["elements"])]

    def _write(self, kind: str, name: str, value: ArrayLike) -> None:
        vector = self._vector(self._find(kind, name))
        given = np.asarray(value, float).reshape(-1)
        if given.shape != vector.shape:
            raise ValueError(f"{name!r} has {len(vector)} elements, not {len(given)}.")
        vector[:] = given
        first = self._about["words"]["constant"]
        self._words[first : first + 3] += 1  # all that was computed is out of date

    def GetState(self, name: str) -> np.ndarray:
        """State of a system; a copy.

        Raises:
            ValueError: there is no such system, or it has no state; those that have are named.
        """
        return self._vector(self._find("states", name)).copy()

    def SetState(self, name: str, value: ArrayLike) -> None:
        """Sets the state of a system.

        Raises:
            ValueError: there is no such system, or the size does not fit.
        """
        self._write("states", name, value)

    def SetInput(self, name: str, value: ArrayLike) -> None:
        """Sets an input port.

        Raises:
            ValueError: there is no such port, or the size does not fit.
        """
        self._write("inputs", name, value)

    def SetParameters(self, name: str, value: ArrayLike) -> None:
        """Sets a group of parameters.

        Raises:
            ValueError: there is no such group, or the size does not fit.
        """
        self._write("parameters", name, value)

    def EvalOutput(self, name: str) -> np.ndarray:
        """Value of an output port at the current time and state; a copy.

        Raises:
            ValueError: there is no such port.
            RuntimeError: it cannot be computed.
        """
        about = self._find("outputs", name)
        if self._call("refresh_outputs"):
            self._raise()
        return self._vector(about).copy()

    def FindLog(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Times [s], shape (n,), and values, shape (size, n), of a log.

        Raises:
            ValueError: there is no such log.
        """
        about = self._find("logs", name)
        self._take_samples()
        width = 1 + len(about["elements"])
        rows = np.concatenate([np.zeros((0, width)), *self._samples[self._about["logs"].index(about)]])
        return rows[:, 0].copy(), rows[:, 1:].T.copy()

    def _take_samples(self) -> None:
        """Takes out what the logs in memory hold."""
        begin = self._about["memory"]["log"]
        for about, samples in zip(self._about["logs"], self._samples):
            width, table = 1 + len(about["elements"]), about["table"]
            start, count = int(self._words[table]), int(self._words[table + 2])
            at = begin + start
            samples.append(self._numbers[at : at + count * width].reshape(count, width).copy())
            self._words[table + 2] = 0
