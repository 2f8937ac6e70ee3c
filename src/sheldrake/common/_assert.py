"""Failures of conditions that the library itself guarantees."""

from sheldrake.common._enums import BoundEnum

# As in a release build of Drake: arguments are checked where a mistake is certain, not to the last bit.
kDrakeAssertIsArmed = False


class ToleranceType(BoundEnum):
    """Whether a tolerance is a difference or a ratio."""

    kAbsolute = 0
    kRelative = 1


def trigger_an_assertion_failure() -> None:
    """Fail as a broken internal condition does, to test how a program takes it.

    Raises:
        SystemExit: always.
    """
    raise SystemExit("Failure at sheldrake.common.trigger_an_assertion_failure(): condition 'false' failed.")
