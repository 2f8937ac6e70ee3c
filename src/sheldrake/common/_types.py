"""Types for annotations that several packages share. Only type checkers need this module: import it for these alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from sheldrake.autodiffutils import AutoDiffXd
    from sheldrake.symbolic import Expression, Variable

    Number = TypeVar("Number", float, AutoDiffXd, Expression)
    """One scalar type, in signatures whose numbers are all of it."""

Scalar: TypeAlias = "float | AutoDiffXd | Expression"  # what a quantity of a model is: a number, or what stands for one
Scalars: TypeAlias = "ArrayLike | Sequence[Scalar] | Sequence[Variable] | Sequence[Sequence[Scalar]]"  # arrays of these
Symbolic: TypeAlias = "float | Expression | Variable"  # what symbolic calls take for an expression
Symbolics: TypeAlias = "ArrayLike | Sequence[Symbolic]"  # arrays of these
Vector: TypeAlias = "Sequence[Scalar] | np.ndarray"  # a vector of these, whose items can be walked
KernelArgument: TypeAlias = "float | np.ndarray | Sequence[Any]"  # what kernels take: numbers, arrays, their tuples
