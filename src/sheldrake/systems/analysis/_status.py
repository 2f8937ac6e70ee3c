"""How an advance of a simulation ended."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common._checked import checked
from sheldrake.common._enums import NumberEnum
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._text import number

if TYPE_CHECKING:
    from sheldrake.systems.framework import System


@no_constructor()
class SimulatorStatus:
    """Why and when `Simulator.AdvanceTo` or `Initialize` returned."""

    _boundary: float
    _time: float
    _reason: SimulatorStatus.ReturnReason
    _system: System | None
    _message: str

    class ReturnReason(NumberEnum):
        """Why it returned."""

        kReachedBoundaryTime = 0
        kReachedTerminationCondition = 1
        kEventHandlerFailed = 2

    @classmethod
    def _make(
        cls,
        boundary: float,
        time: float,
        reason: SimulatorStatus.ReturnReason,
        system: System | None = None,
        message: str = "",
    ) -> SimulatorStatus:
        status = object.__new__(cls)
        status._boundary, status._time, status._reason = boundary, time, reason
        status._system, status._message = system, message
        return status

    def boundary_time(self) -> float:
        """The time asked for [s]."""
        return self._boundary

    def return_time(self) -> float:
        """The time reached [s]."""
        return self._time

    def reason(self) -> SimulatorStatus.ReturnReason:
        """Why it returned."""
        return self._reason

    def system(self) -> System | None:
        """The system that asked to end, or None."""
        return self._system

    def message(self) -> str:
        """What that system said."""
        return self._message

    def succeeded(self) -> bool:
        """Whether the boundary time was reached."""
        return self._reason is SimulatorStatus.ReturnReason.kReachedBoundaryTime

    def FormatMessage(self) -> str:
        """All of it as a sentence."""
        if self.succeeded():
            return f"Simulator successfully reached the boundary time ({number(self._boundary)})."
        who = (
            "System"
            if self._system is None
            else (f"{self._system.GetSystemType()} System '{self._system.GetSystemPathname()}'")
        )
        if self._reason is SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            return (
                f"Simulator returned early at time {number(self._time)} because {who} requested termination with "
                f'message: "{self._message}"'
            )
        return f'Simulator stopped at time {number(self._time)} because {who} failed with message: "{self._message}"'

    def __repr__(self) -> str:
        return f"<SimulatorStatus: {self.FormatMessage()}>"

    @checked
    def IsIdenticalStatus(self, other: SimulatorStatus) -> bool:
        """Whether all of it is the same."""
        mine = (self._boundary, self._time, self._reason, self._message)
        return mine == (other._boundary, other._time, other._reason, other._message) and self._system is other._system
