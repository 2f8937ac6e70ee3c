"""The nearest neighbours of points, found in a tree that divides them at medians.

J. L. Bentley, "Multidimensional binary search trees used for associative searching", Communications of the ACM, 1975.
The tree is an order of the points: the middle of a range of them divides the rest of it, along the axis in which they
are spread most.
"""

from __future__ import annotations

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel

LEAF = 8
"""Ranges of so many points are not divided."""
DEPTH = 128
"""Ranges that wait: two for each level of a tree of 2^63 points."""


@kernel
def widest_axis(points, order, low, high):
    """The axis along which a range of points is spread most."""
    axis, most = 0, -1.0
    for k in range(3):
        least = points[order[low], k]
        greatest = least
        for i in range(low + 1, high):
            x = points[order[i], k]
            least = x if x < least else least
            greatest = x if x > greatest else greatest
        if greatest - least > most:
            axis, most = k, greatest - least
    return axis


@kernel
def put_in_place(points, order, low, high, place, axis):
    """Orders a range of points until those before a place lie before it along the axis, and others behind it.

    C. A. R. Hoare, "Algorithm 65: Find", Communications of the ACM 4, 1961.
    """
    left, right = low, high - 1
    while left < right:
        pivot = points[order[(left + right) // 2], axis]
        i, j = left, right
        while i <= j:
            while points[order[i], axis] < pivot:
                i += 1
            while points[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                moved = order[i]
                order[i] = order[j]
                order[j] = moved
                i += 1
                j -= 1
        if place <= j:
            right = j
        elif place >= i:
            left = i
        else:
            right = left


@kernel(top=True)
def divide_points(points: Matrix, order: IntVector, axes: IntVector, waiting: IntMatrix) -> None:
    """Makes the tree.

    Args:
        points: Shape (n, 3) [m].
        order: All their numbers, put in the tree's order.
        axes: Filled with the axis that each point divides others along, shape (n,).
        waiting: Room for ranges, shape (DEPTH, 2).
    """
    waiting[0, 0] = 0
    waiting[0, 1] = len(order)
    count = 1
    while count > 0:
        count -= 1
        low, high = waiting[count, 0], waiting[count, 1]
        if high - low > LEAF:
            axis, middle = widest_axis(points, order, low, high), (low + high) // 2
            put_in_place(points, order, low, high, middle, axis)
            axes[middle] = axis
            waiting[count, 0] = low
            waiting[count, 1] = middle
            waiting[count + 1, 0] = middle + 1
            waiting[count + 1, 1] = high
            count += 2


@kernel
def keep_near(points, p, other, least, count, near, row, distances):
    """Puts a point among the nearest ones of p, in order, if it is nearer than `least`; how many there are then."""
    dx, dy, dz = points[other, 0] - p[0], points[other, 1] - p[1], points[other, 2] - p[2]
    square = dx * dx + dy * dy + dz * dz
    if square < least:
        at = count if count < len(distances) else count - 1
        while at > 0 and distances[at - 1] > square:
            distances[at] = distances[at - 1]
            near[row, at] = near[row, at - 1]
            at -= 1
        distances[at] = square
        near[row, at] = other
        count = count + 1 if count < len(distances) else count
    return count


@kernel(top=True)
def find_nearest(
    points: Matrix,
    order: IntVector,
    axes: IntVector,
    radius: float,
    waiting: IntMatrix,
    gaps: Vector,
    distances: Vector,
    near: IntMatrix,
) -> None:
    """The nearest neighbours of each point, itself among them.

    Args:
        points, order, axes: The tree.
        radius: How far they are less than [m].
        waiting: Room for ranges, shape (DEPTH, 2).
        gaps: Room for how far these are away at least, squared, shape (DEPTH,).
        distances: Room for the squared distances of one point's neighbours, shape (k,).
        near: Filled with their numbers, the nearest first, shape (n, k); n where there are fewer.
    """
    n, most = len(order), len(distances)
    for place in range(n):
        row = order[place]  # those that lie together one after the other
        p = (points[row, 0], points[row, 1], points[row, 2])
        found, waits = 0, 1
        waiting[0, 0] = 0
        waiting[0, 1] = n
        gaps[0] = 0.0
        while waits > 0:
            waits -= 1
            low, high, gap = waiting[waits, 0], waiting[waits, 1], gaps[waits]
            limit = radius * radius if found < most else distances[found - 1]
            if gap < limit:
                if high - low <= LEAF:
                    for i in range(low, high):
                        found = keep_near(points, p, order[i], limit, found, near, row, distances)
                        limit = radius * radius if found < most else distances[found - 1]
                else:
                    middle = (low + high) // 2
                    found = keep_near(points, p, order[middle], limit, found, near, row, distances)
                    axis = axes[middle]
                    apart = points[row, axis] - points[order[middle], axis]
                    is_before = apart < 0.0
                    waiting[waits, 0] = middle + 1 if is_before else low
                    waiting[waits, 1] = high if is_before else middle
                    gaps[waits] = apart * apart if apart * apart > gap else gap
                    waiting[waits + 1, 0] = low if is_before else middle + 1
                    waiting[waits + 1, 1] = middle if is_before else high
                    gaps[waits + 1] = gap
                    waits += 2
        for i in range(found, most):
            near[row, i] = n
