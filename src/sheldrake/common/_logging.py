"""Text logging through Python's `logging`, in the logger "drake"."""

from __future__ import annotations

import logging

TRACE = 5
_LEVELS = {
    "trace": TRACE,
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warn": logging.WARNING,
    "err": logging.ERROR,
    "critical": logging.CRITICAL,
    "off": logging.CRITICAL + 10,
}

logger = logging.getLogger("drake")  # pydrake's name, so that one setting serves both


def configure_logging() -> None:
    """Show messages of level INFO and above on stderr, with time, logger and level. Calling it is optional."""
    text = "[%(asctime)s] [%(name)s] [%(levelname)s] %(message)s"
    logging.basicConfig(level=logging.INFO, format=text)
    logger.setLevel(logging.NOTSET)
    logging.addLevelName(TRACE, "TRACE")


def set_log_level(level: str) -> str:
    """Set the level of the "drake" logger, and tell the old one.

    Args:
        level: "trace", "debug", "info", "warn", "err", "critical", "off", or "unchanged".

    Raises:
        RuntimeError: `level` is none of these.
    """
    effective = logger.getEffectiveLevel()
    old = min(_LEVELS, key=lambda name: abs(_LEVELS[name] - effective))
    if level == "unchanged":
        return old
    if level not in _LEVELS:
        raise RuntimeError(f"set_log_level(): unknown level '{level}'; known are {', '.join(_LEVELS)}, unchanged.")
    logger.setLevel(_LEVELS[level])
    return old


def use_native_cpp_logging() -> None:
    """Nothing to do: there is no other logging than Python's. Here for scripts that call it under pydrake."""
