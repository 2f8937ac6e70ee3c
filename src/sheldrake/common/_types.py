"""Names that annotations alone need: numbers and arrays of any scalar type."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from sheldrake.autodiffutils import AutoDiffXd
    from sheldrake.symbolic import Expression

    Number: TypeAlias = float | AutoDiffXd | Expression
    Vector: TypeAlias = Sequence[Number] | np.ndarray
    Numbers: TypeAlias = ArrayLike | Vector | Sequence[Sequence[Number]]
