"""Makes closed, outward surfaces of what mesh files hold, and says what was done."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ._solids import Solid

_SAME = 1e-6  # relative to the size: vertices closer than that are one, as in single precision
_FLAT = 1e-3  # relative to its size: a hole flatter than that is closed exactly


@dataclass
class Repaired:
    """One connected surface.

    Attributes:
        solid: The surface, closed if `is_closed`, normals out.
        is_closed: Every edge has two triangles of opposite direction.
        is_cavity: It is the wall of a hollow inside another one, normals pointing into the hollow.
        done: What was changed, for people.
        warnings: What could not be put right or is a guess.
    """

    solid: Solid
    is_closed: bool = True
    is_cavity: bool = False
    done: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @property
    def is_changed(self) -> bool:
        """Whether the shape is another than in the file (merging equal vertices leaves it as it is)."""
        return bool(self.done)


def repair(solid: Solid) -> list[Repaired]:
    """The connected surfaces of a solid, each closed and turned outside out where that can be done."""
    vertices, triangles, done = _merged(solid)
    pieces = []
    for number, part in enumerate(_components(triangles, len(vertices))):
        name = solid.name if number == 0 else f"{solid.name} ({number + 1})"
        pieces.append(_repair_piece(name, vertices, part))
    if pieces:
        pieces[0].done[:0] = done
    return pieces


def _merged(solid: Solid) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Vertices made one where they coincide; triangles without area or that are there twice removed."""
    used, triangles = np.unique(solid.triangles, return_inverse=True)
    points = solid.vertices[used]
    triangles = triangles.reshape(-1, 3)
    size = float(np.ptp(points, axis=0).max()) or 1.0
    _, first, inverse = np.unique(
        np.round((points - points.min(axis=0)) / (size * _SAME)), axis=0, return_index=True, return_inverse=True
    )
    triangles = inverse.reshape(-1)[triangles]
    points = points[first]
    done = []
    a, b, c = triangles.T
    lines = (a == b) | (b == c) | (c == a)
    triangles = triangles[~lines]
    _, kept = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    if len(kept) < len(triangles):
        done.append(f"removed {len(triangles) - len(kept)} triangles that were there twice")
        triangles = triangles[np.sort(kept)]
    return points, triangles, done


def _components(triangles: np.ndarray, count: int) -> list[np.ndarray]:
    """Triangles that hang together by vertices, in the order of their first."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if not len(triangles):
        return []
    rows, columns = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]]).T
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    labels = connected_components(graph, directed=False)[1][triangles[:, 0]]
    _, first = np.unique(labels, return_index=True)
    return [triangles[labels == labels[i]] for i in np.sort(first)]


def _repair_piece(name: str, vertices: np.ndarray, triangles: np.ndarray) -> Repaired:
    used, local = np.unique(triangles, return_inverse=True)
    piece = Repaired(Solid(name, vertices[used], local.reshape(-1, 3)))
    solid = piece.solid
    if not _is_closed(solid.triangles):
        turned = _wind_alike(solid.triangles)
        flipped = int((turned != solid.triangles).any(axis=1).sum())
        solid.triangles = turned
        if flipped:
            piece.done.append(f"turned {min(flipped, len(turned) - flipped)} triangles that faced another way")
    if not _is_closed(solid.triangles):
        _close_holes(piece)
    piece.is_closed = _is_closed(solid.triangles)
    if not piece.is_closed:
        piece.warnings.append(
            f"the surface of '{name}' is not closed: {len(_bad_edges(solid.triangles))} edges have not "
            "two triangles, and could not be repaired"
        )
    return piece


def _directed(triangles: np.ndarray) -> np.ndarray:
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _is_closed(triangles: np.ndarray) -> bool:
    return not len(_bad_edges(triangles))


def _bad_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges that are not passed once in each direction (or as often in one as in the other, where solids touch)."""
    edges = _directed(triangles)
    undirected, inverse = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    balance = np.zeros(len(undirected), dtype=np.int64)
    np.add.at(balance, inverse.reshape(-1), np.where(edges[:, 0] < edges[:, 1], 1, -1))
    return undirected[balance != 0]


def _boundary(triangles: np.ndarray) -> np.ndarray:
    """Directed edges whose opposite is missing, shape (k, 2)."""
    edges = _directed(triangles)
    _, inverse, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    return edges[counts[inverse.reshape(-1)] == 1]


def _wind_alike(triangles: np.ndarray) -> np.ndarray:
    """The triangles turned so that neighbours pass their common edge in opposite directions."""
    neighbours: dict[tuple[int, int], list[int]] = {}
    rows = triangles.tolist()
    for number, (a, b, c) in enumerate(rows):
        for edge in ((a, b), (b, c), (c, a)):
            neighbours.setdefault((min(edge), max(edge)), []).append(number)
    seen = [False] * len(rows)
    for start in range(len(rows)):
        if seen[start]:
            continue
        seen[start] = True
        waiting = [start]
        while waiting:
            a, b, c = rows[waiting.pop()]
            for edge in ((a, b), (b, c), (c, a)):
                shared = neighbours[min(edge), max(edge)]
                if len(shared) != 2:
                    continue
                for other in shared:
                    if seen[other]:
                        continue
                    seen[other] = True
                    x, y, z = rows[other]
                    if edge in ((x, y), (y, z), (z, x)):
                        rows[other] = [x, z, y]
                    waiting.append(other)
    return np.array(rows, dtype=np.int64).reshape(-1, 3)


def _close_holes(piece: Repaired) -> None:
    """Closes each boundary loop with a fan about its centre; exact for volume and inertia where the loop is flat."""
    solid = piece.solid
    size = float(np.ptp(solid.vertices, axis=0).max())
    for loop in _loops(_boundary(solid.triangles)):
        points = solid.vertices[loop]
        centre = points.mean(axis=0)
        corners = np.array(loop)
        if len(loop) == 3:
            caps = np.array([[loop[0], loop[2], loop[1]]])
        else:
            solid.vertices = np.concatenate([solid.vertices, [centre]])
            last = np.full(len(loop), len(solid.vertices) - 1)
            caps = np.stack([np.roll(corners, -1), corners, last], axis=1)
        solid.triangles = np.concatenate([solid.triangles, caps])
        flatness = np.linalg.svd(points - centre, compute_uv=False)[-1] / np.sqrt(len(points))
        piece.done.append(f"closed a hole with {len(loop)} edges")
        if flatness > _FLAT * size:
            piece.warnings.append(
                f"the hole with {len(loop)} edges that was closed in '{solid.name}' is not flat: "
                "its lid, and so volume and inertia there, are a guess"
            )


def _loops(edges: np.ndarray) -> list[list[int]]:
    """Closed loops of vertices along directed edges; chains that do not close are left out."""
    following: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        following.setdefault(a, []).append(b)
    loops = []
    while following:
        start = next(iter(following))
        loop, at = [], start
        while at in following:
            loop.append(at)
            successors = following[at]
            at = successors.pop()
            if not successors:
                del following[loop[-1]]
            if at == start:
                break
        if at == start and len(loop) >= 3:
            loops.append(loop)
    return loops


def orient(pieces: list[Repaired]) -> None:
    """Turns closed surfaces outside out, and knows the walls of hollows by what they lie inside of."""
    closed = [piece for piece in pieces if piece.is_closed]
    volumes = [signed_volume(piece.solid) for piece in closed]
    for piece, volume in zip(closed, volumes):
        inside_of = [
            other.solid.name
            for other, larger in zip(closed, volumes)
            if other is not piece and abs(larger) > abs(volume) and _contains(other.solid, piece.solid)
        ]
        if inside_of and volume < 0.0:
            piece.is_cavity = True
        elif volume < 0.0:
            piece.solid.triangles = piece.solid.triangles[:, ::-1]
            piece.done.append("turned the surface, which was inside out")
        elif inside_of:
            piece.warnings.append(
                f"'{piece.solid.name}' lies inside '{inside_of[0]}': its material counts twice; if it is a hollow, "
                "its surface has to face inwards"
            )


def signed_volume(solid: Solid) -> float:
    """Volume inside a closed surface, negative when it is inside out, in the solid's units."""
    a, b, c = (solid.vertices[solid.triangles[:, k]] - solid.vertices[0] for k in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6.0


def _contains(outer: Solid, inner: Solid) -> bool:
    """Whether a vertex of one lies inside the other: its box first, then the solid angle that surrounds it.

    Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, IEEE Trans. Biomed. Eng. 30, 1983, eq. 8.
    """
    low, high = outer.vertices.min(axis=0), outer.vertices.max(axis=0)
    if (inner.vertices.min(axis=0) < low).any() or (inner.vertices.max(axis=0) > high).any():
        return False
    a, b, c = (outer.vertices[outer.triangles[:, k]] - inner.vertices[0] for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = (np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (a, c), (b, c)))
    ab, ac, bc = dots
    angle = 2.0 * np.arctan2(numerator, la * lb * lc + ab * lc + ac * lb + bc * la).sum()
    return abs(angle) > 2.0 * np.pi
