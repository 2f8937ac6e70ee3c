"""Warnings about retired names, caught and counted."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from typing import Any

from sheldrake.common.deprecation import DrakeDeprecationWarning

__all__ = ["catch_drake_warnings"]


@contextlib.contextmanager
def catch_drake_warnings(expected_count: int | None = None, action: Any = "always") -> Iterator[list]:
    """Collects the warnings of the block; with `expected_count`, asserts how many are DrakeDeprecationWarnings.

    Raises:
        AssertionError: how many there were, and their texts.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter(action, DrakeDeprecationWarning)
        yield caught
    if expected_count is not None:
        texts = [str(w.message) for w in caught if issubclass(w.category, DrakeDeprecationWarning)]
        assert len(texts) == expected_count, f"{len(texts)} deprecation warnings, expected {expected_count}: {texts}"
