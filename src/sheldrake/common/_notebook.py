"""Whether anybody reads the output of this process in a notebook."""

from __future__ import annotations

import sys


def in_notebook() -> bool:
    """Whether this is the process of a notebook; IPython is asked only where it is loaded, as notebooks have it."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return hasattr(shell, "kernel")
