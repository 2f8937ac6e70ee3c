"""Repairs of other libraries. NumPy has needed none since 1.13; the call stays for scripts that make it."""

__all__ = ["maybe_patch_numpy_formatters"]


def maybe_patch_numpy_formatters() -> None:
    """Nothing to do: every supported NumPy prints arrays of expressions."""
