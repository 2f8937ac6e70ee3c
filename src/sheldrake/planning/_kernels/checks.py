"""Whether configurations are free of collisions, many in one call."""

from __future__ import annotations

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.rows import call_row
from sheldrake.geometry._kernels.model import ContactTable


@kernel(top=True, strict=True)
def first_collisions(
    t: float,
    memory: Vector,
    rows: IntVector,
    words: IntVector,
    at: IntVector,
    configurations: Matrix,
    q: Vector,
    poses: Matrix,
    places: IntMatrix,
    placed: Matrix,
    table: ContactTable,
    body: IntVector,
    filtered: IntMatrix,
    padding: Matrix,
    begin: IntVector,
    found: IntVector,
    first: int,
    last: int,
) -> int:
    """For each way of `first` to `last`: the number of its first configuration that collides, or how many it has.

    Returns 0, or the status of the first row that fails, with which all ends.

    Args:
        t: For the rows.
        memory: All of it, from address 0.
        rows: Addresses of what is called for a configuration: kinematics, of `q`, then the search, which fills `table`.
        words: Of all of these.
        at: Where in `words` each one's begin.
        configurations: Those of all ways, one after the other.
        q: That of which kinematics are computed.
        poses: What these give, X_WB by body of the plant.
        places: Of each frame with geometry: its row in `placed` and its row in `poses`.
        placed: X_WB by frame, for the search.
        table: What the search finds, its depth less than 0 where there is a distance.
        body: Of the plant, by geometry.
        filtered: Of each pair of bodies; not 0 where it does not count.
        padding: Likewise, what is to be kept between them [m].
        begin: Where each way's configurations begin; behind them, where all end.
        found: By way.
    """
    for way in range(first, last):
        found[way] = begin[way + 1] - begin[way]
        for c in range(begin[way], begin[way + 1]):
            for i in range(len(q)):
                q[i] = configurations[c, i]
            status = call_row(rows, 0, t, memory, words, at[0])
            for i in range(places.shape[0]):
                for k in range(placed.shape[1]):
                    placed[places[i, 0], k] = poses[places[i, 1], k]
            for r in range(1, len(rows)):
                if status == 0:
                    status = call_row(rows, r, t, memory, words, at[r])
            if status == 0:
                status = table.status
            if status != 0:
                return status
            if touches(table, body, filtered, padding):
                found[way] = c - begin[way]
                break
    return 0


@kernel
def touches(table, body, filtered, padding):
    """Whether what the search has found is a collision."""
    for i in range(table.num_contacts):
        a = body[table.pair[i, 0]]
        b = body[table.pair[i, 1]]
        if filtered[a, b] == 0 and -table[i].depth - padding[a, b] <= 0.0:
            return True
    return False
