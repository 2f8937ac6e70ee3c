"""Rows called again and again on kept slabs, to measure what each costs."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.systems.framework._kernels.program import Program, Side, call


@kernel(top=True, strict=True)
def replay(
    program_model: Program,
    S: Vector,
    side: Side,
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
    for s in range(slabs.shape[0]):
        for i in range(slabs.shape[1]):
            S[places[i]] = slabs[s, i]
        for j in range(count):
            r = chain[j]
            if r >= 0:
                call(program_model, S, side, rows, r)
            else:
                L[0] = S[0]
                log = program_model.logs[-1 - r]
                for i in range(log.length):
                    L[1 + i] = S[log.start + i]
