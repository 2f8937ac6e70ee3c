"""Warnings about models in one line, for commands that are about something else."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Iterator

_LOG = logging.getLogger("drake")


@contextlib.contextmanager
def warnings_in_one_line(*files: str) -> Iterator[None]:
    """Counts what is warned of while files are read, and says in the end how much it was and how to see it."""
    counted: list[str] = []

    def count(record: logging.LogRecord) -> bool:
        if record.levelno != logging.WARNING:
            return True
        counted.append(record.getMessage())
        return False

    _LOG.addFilter(count)
    try:
        yield
    finally:
        _LOG.removeFilter(count)
        if len(counted) == 1:
            print(counted[0], file=sys.stderr)
        elif counted:
            commands = ", ".join(f"sheldrake doctor {file}" for file in files)
            print(f"{len(counted)} warnings about the model; all of them: {commands}", file=sys.stderr)
