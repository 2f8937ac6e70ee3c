"""Brings output ports up to date for who looks at a frozen diagram from outside."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Vector, kernel
from sheldrake.systems.framework._kernels.program import Program, Side, call


@kernel(top=True, strict=True, short_loops=True)
def refresh_outputs(program_model: Program, S: Vector, side: Side, rows: IntVector, wanted: IntVector) -> int:
    """Computes those of the `wanted` rows, in topological order, that are out of date; the status of one that fails."""
    program = program_model
    for j in range(len(wanted)):
        r = wanted[j]
        if side.word[program.stamps + r] != side.word[program.level[r]]:
            call(program, S, side, rows, r)
            if side.status != 0:
                return side.status
            side.word[program.stamps + r] = side.word[program.level[r]]
    return 0
