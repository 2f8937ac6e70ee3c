"""How many owners an object has."""

from __future__ import annotations

import sys
from typing import Any

__all__ = ["actual_ref_count"]


def actual_ref_count(obj: Any) -> int:
    """The references to `obj` that the caller knows of: without those this call makes."""
    return sys.getrefcount(obj) - 2
