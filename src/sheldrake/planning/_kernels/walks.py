"""Random walks of many points in a polyhedron (R. L. Smith, Operations Research 32, 1984)."""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel


@kernel(top=True)
def walk_all(
    faces: Matrix, b: Vector, directions: Matrix, reaches: Matrix, room: Vector, slopes: Vector, points: Matrix
) -> None:
    """Goes with each point along given directions to given parts of the chords of A x <= b.

    Args:
        faces: A transposed, shape (n, m).
        b: Shape (m,).
        directions: Of each step n rows, columns by point, shape (steps * n, count).
        reaches: Where on the chords, from 0 to 1, shape (steps, count).
        room: Scratch, shape (m,).
        slopes: Scratch, shape (m,).
        points: Where they begin, inside; filled with where they end, rows, shape (count, n).
    """
    n, m = faces.shape
    steps, count = reaches.shape
    for p in range(count):
        for i in range(m):
            room[i] = b[i]
        for k in range(n):
            x = points[p, k]
            for i in range(m):
                room[i] -= faces[k, i] * x
        for s in range(steps):
            for i in range(m):
                slopes[i] = 0.0
            for k in range(n):
                step = directions[s * n + k, p]
                for i in range(m):
                    slopes[i] += faces[k, i] * step
            # How steep ways to faces are, of the room that is left; 0 / 0 says nothing, as no comparison holds.
            down, up = -1e-300, 1e-300
            for i in range(m):
                steepness = slopes[i] / max(room[i], 0.0)
                if steepness > up:
                    up = steepness
                if steepness < down:
                    down = steepness
            low, high = 1.0 / down, 1.0 / up
            reach = low + (high - low) * reaches[s, p]
            for k in range(n):
                points[p, k] += reach * directions[s * n + k, p]
            for i in range(m):
                room[i] -= reach * slopes[i]
