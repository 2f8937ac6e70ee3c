"""An order of elimination that keeps the factors of a sparse symmetric matrix sparse.

After P. R. Amestoy, T. A. Davis and I. S. Duff, "An approximate minimum degree ordering algorithm" (SIAM Journal on
Matrix Analysis and Applications 17, 1996), without supervariables. What a row that is eliminated connects is kept as
one list, an element, instead of as entries between all of its members.
"""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common.kernel import IntVector, kernel


class Quotient(NamedTuple):
    """The graph of what is left: each row has neighbours, and elements that it is a member of.

    Attributes:
        starts: Where the part of `near` of each row begins, shape (n + 1,).
        near: Neighbours of each row from the start of its part, its elements from the end of it.
        neighbours: How many neighbours each row has.
        elements: How many elements.
        pool: Members of the elements; room for twice as many numbers as `near` has.
        begins: Where the members of the element that a row has become begin.
        sizes: How many there are; none of elements that are part of others.
        outside: How many of them the newest element has not, where `seen` says so.
        seen: When `outside` was counted.
        member: In which step a row was last found to be a member of the newest element.
        degrees: Bounds of how many rows each row is connected with.
        heads: The first row of each degree, or -1.
        following: The next row of the same degree, or -1.
        previous: The one before, or -1.
        order: Filled with the rows in the order of their elimination; the first row of each step has its element.
        made: The rows that became elements.
    """

    starts: IntVector
    near: IntVector
    neighbours: IntVector
    elements: IntVector
    pool: IntVector
    begins: IntVector
    sizes: IntVector
    outside: IntVector
    seen: IntVector
    member: IntVector
    degrees: IntVector
    heads: IntVector
    following: IntVector
    previous: IntVector
    order: IntVector
    made: IntVector


@kernel
def put_in(graph, row, degree):
    """Lets a row wait among those of its degree."""
    graph.degrees[row] = degree
    first = graph.heads[degree]
    graph.previous[row], graph.following[row] = -1, first
    if first >= 0:
        graph.previous[first] = row
    graph.heads[degree] = row


@kernel
def take_out(graph, row):
    before, after = graph.previous[row], graph.following[row]
    if before >= 0:
        graph.following[before] = after
    else:
        graph.heads[graph.degrees[row]] = after
    if after >= 0:
        graph.previous[after] = before


@kernel(outline=True)
def close_gaps(graph, count):
    """Moves the elements to the front of the pool; gives how much of it they take."""
    used = 0
    for k in range(count):
        element = graph.made[k]
        begin = graph.begins[element]
        graph.begins[element] = used
        for m in range(graph.sizes[element]):
            graph.pool[used] = graph.pool[begin + m]
            used += 1
    return used


@kernel(outline=True)
def join(graph, pivot, step, used):
    """The members of the pivot's element, written to the pool; its elements become part of it. Gives how many."""
    begin, end = graph.starts[pivot], graph.starts[pivot + 1]
    count = 0
    graph.member[pivot] = step
    for k in range(graph.neighbours[pivot]):
        row = graph.near[begin + k]
        graph.member[row] = step
        graph.pool[used + count] = row
        count += 1
    for k in range(graph.elements[pivot]):
        element = graph.near[end - 1 - k]
        for m in range(graph.sizes[element]):
            row = graph.pool[graph.begins[element] + m]
            if graph.member[row] != step:
                graph.member[row] = step
                graph.pool[used + count] = row
                count += 1
        graph.sizes[element] = 0
    return count


@kernel
def count_outside(graph, row, step):
    """Takes a member of the newest element from the counts of its other elements."""
    end = graph.starts[row + 1]
    for k in range(graph.elements[row]):
        element = graph.near[end - 1 - k]
        if graph.seen[element] != step:
            graph.seen[element] = step
            graph.outside[element] = graph.sizes[element]
        graph.outside[element] -= 1


@kernel(outline=True)
def prune(graph, row, pivot, step):
    """Leaves a member what the newest element does not say, and that element; gives a bound of its other degree."""
    begin, end = graph.starts[row], graph.starts[row + 1]
    kept = 0
    for k in range(graph.neighbours[row]):
        other = graph.near[begin + k]
        if graph.member[other] != step:
            graph.near[begin + kept] = other
            kept += 1
    graph.neighbours[row] = kept
    degree, elements = kept, 0
    for k in range(graph.elements[row]):
        element = graph.near[end - 1 - k]
        if graph.sizes[element] > 0:
            if graph.outside[element] > 0:
                degree += graph.outside[element]
                graph.near[end - 1 - elements] = element
                elements += 1
            else:
                graph.sizes[element] = 0
    graph.near[end - 1 - elements] = pivot
    graph.elements[row] = elements + 1
    return degree


@kernel(top=True)
def order_of_least_degree(graph: Quotient) -> int:
    """Fills `order`: always a row that is connected with the fewest that are left, by a bound of that number.

    Rows whose neighbours are all members of the element of the row that goes are eliminated with it, as nothing fills
    then (mass elimination: A. George and J. W. H. Liu, SIAM Review 31, 1989).
    """
    n = len(graph.order)
    for i in range(n):
        row = n - 1 - i
        graph.sizes[row], graph.elements[row] = 0, 0
        graph.seen[row], graph.member[row], graph.heads[row] = -1, -1, -1
    for i in range(n):
        row = n - 1 - i
        graph.neighbours[row] = graph.starts[row + 1] - graph.starts[row]
        put_in(graph, row, graph.neighbours[row])
    gone, used, step, least = 0, 0, 0, 0
    while gone < n:
        while graph.heads[least] < 0:
            least += 1
        pivot = graph.heads[least]
        take_out(graph, pivot)
        needed = graph.neighbours[pivot]
        for k in range(graph.elements[pivot]):
            needed += graph.sizes[graph.near[graph.starts[pivot + 1] - 1 - k]]
        if used + needed > len(graph.pool):
            used = close_gaps(graph, step)
        count = join(graph, pivot, step, used)
        graph.order[gone] = pivot
        gone += 1
        for m in range(count):
            row = graph.pool[used + m]
            take_out(graph, row)
            count_outside(graph, row, step)
        left = 0
        for m in range(count):
            row = graph.pool[used + m]
            other = prune(graph, row, pivot, step)
            if other == 0:
                graph.order[gone] = row
                gone += 1
            else:
                graph.degrees[row] = min(other, graph.degrees[row])
                graph.pool[used + left] = row
                left += 1
        for m in range(left):
            row = graph.pool[used + m]
            put_in(graph, row, min(graph.degrees[row] + left - 1, n - gone - 1))
            least = min(least, graph.degrees[row])
        graph.made[step], graph.begins[pivot], graph.sizes[pivot] = pivot, used, left
        used += left
        step += 1
    return 0
