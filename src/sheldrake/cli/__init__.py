"""The command `sheldrake`."""

from sheldrake.cli._main import main

__all__ = ["main"]
