"""Rows called again and again on kept slabs, to measure what each costs."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.systems.framework._kernels.program import Program, call


@kernel(top=True, strict=True)
def replay(
    program_model: Program,
    S: Vector,
    I: IntVector,
    L: Vector,
    rows: IntVector,
    places: IntVector,
    slabs: Matrix,
    chain: IntVector,
    count: int,
) -> None:
    """Puts each of `slabs` in its `places` in turn and calls the first `count` rows of `chain`.

    -1 - n in a chain stands for log n; its sample goes to the beginning of L.
    """
    P = program_model
    for s in range(slabs.shape[0]):
        for i in range(slabs.shape[1]):
            S[places[i]] = slabs[s, i]
        for j in range(count):
            r = chain[j]
            if r >= 0:
                call(P, S, I, rows, r)
            else:
                L[0] = S[0]
                for i in range(P.log[-1 - r, 1]):
                    L[1 + i] = S[P.log[-1 - r, 0] + i]
