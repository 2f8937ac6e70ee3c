"""Numbers that carry their derivatives (forward-mode automatic differentiation)."""

from sheldrake.autodiffutils._autodiffxd import AutoDiffXd
from sheldrake.autodiffutils._matrices import (
    ExtractGradient,
    ExtractValue,
    InitializeAutoDiff,
    InitializeAutoDiffTuple,
    autodiff_equal_to,
)

__all__ = [
    "AutoDiffXd",
    "ExtractGradient",
    "ExtractValue",
    "InitializeAutoDiff",
    "InitializeAutoDiffTuple",
]
