"""Linear rows of programs: entries of their blocks, rows of a conic form, and columns of a sparse matrix."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Vector, kernel

EQUATION, BELOW, ABOVE, NEVER = 1, 2, 4, 8  # bits of what a row says
_INFINITY = float("inf")


@kernel(top=True)
def entries_of_blocks(
    blocks: int,
    heights: IntVector,
    widths: IntVector,
    numbers: Vector,
    rows: IntVector,
    cols: IntVector,
    values: Vector,
) -> int:
    """Finds what is not zero in blocks that have rows and columns of their own each; gives how many entries there are.

    Args:
        blocks: How many there are.
        heights: Numbers of their rows.
        widths: Numbers of their columns; -1 for identities, which have no numbers; -2 and less, n columns being -2 - n,
            for blocks that are left out.
        numbers: Those of all blocks, row by row.
        rows: Filled with the rows of the entries.
        cols: Filled with their columns.
        values: Filled with the entries.
    """
    row, col, at, count = 0, 0, 0, 0
    for k in range(blocks):
        height, width = heights[k], widths[k]
        if width < -1:
            width = -2 - width
        elif width < 0:
            width = height
            for i in range(height):
                rows[count] = row + i
                cols[count] = col + i
                values[count] = 1.0
                count += 1
        else:
            for i in range(height):
                for j in range(width):
                    value = numbers[at]
                    at += 1
                    if value != 0.0:
                        rows[count] = row + i
                        cols[count] = col + j
                        values[count] = value
                        count += 1
        row += height
        col += width
    return count


@kernel
def bits(low, high):
    """What a row between these bounds says."""
    bits = NEVER if low == _INFINITY or high == -_INFINITY else 0
    if low == high:
        return bits | EQUATION
    if -_INFINITY < high and high < _INFINITY:
        bits = bits | BELOW
    if -_INFINITY < low and low < _INFINITY:
        bits = bits | ABOVE
    return bits


@kernel
def _sort(count, keys, order, first, size, out):
    """Puts numbers of entries in the order of their keys, which are below size; equal ones stay in order."""
    for k in range(size + 1):
        first[k] = 0
    for e in range(count):
        first[keys[e] + 1] += 1
    for k in range(size):
        first[k + 1] += first[k]
    for i in range(count):
        e = order[i]
        out[first[keys[e]]] = e
        first[keys[e]] += 1
    return 0


@kernel(outline=True)
def _columns(entries, height, width, rows, cols, values, by_row, order, first, starts, new_rows, new_values):
    """Does what `sorted_columns` says."""
    for e in range(entries):
        order[e] = e
    _sort(entries, rows, order, first, height, by_row)
    _sort(entries, cols, by_row, first, width, order)
    filled, col, last = 0, -1, -1
    for i in range(entries):
        e = order[i]
        if cols[e] == col and rows[e] == last:
            new_values[filled - 1] += values[e]
            continue
        while col < cols[e]:
            col += 1
            starts[col] = filled
        last = rows[e]
        new_rows[filled] = last
        new_values[filled] = values[e]
        filled += 1
    for k in range(col + 1, width + 1):
        starts[k] = filled
    return filled


@kernel
def _signed_rows(
    count, entries, lower, upper, rows, cols, values, says, sizes, number, chosen, b, new_rows, new_cols, new_values
):
    """Fills sizes, the rows that new ones are made of, their right sides and entries; gives how many entries."""
    row, filled = 0, 0
    for part in range(3):
        bit, sign, begin = 1 << part, -1.0 if part == 2 else 1.0, row
        for i in range(count):
            number[i] = -1
            if says[i] & bit:
                number[i] = row
                chosen[row] = i
                b[row] = -lower[i] if part == 2 else upper[i]
                row += 1
        sizes[part] = row - begin
        if row > begin:
            for e in range(entries):
                if number[rows[e]] >= 0:
                    new_rows[filled] = number[rows[e]]
                    new_cols[filled] = cols[e]
                    new_values[filled] = sign * values[e]
                    filled += 1
    return filled


@kernel(top=True)
def conic_rows(
    count: int,
    entries: int,
    width: int,
    lower: Vector,
    upper: Vector,
    rows: IntVector,
    cols: IntVector,
    values: Vector,
    says: IntVector,
    sizes: IntVector,
    number: IntVector,
    chosen: IntVector,
    b: Vector,
    signed_rows: IntVector,
    signed_cols: IntVector,
    signed_values: Vector,
    by_row: IntVector,
    order: IntVector,
    first: IntVector,
    starts: IntVector,
    new_rows: IntVector,
    new_values: Vector,
) -> int:
    """Rows lower <= A x <= upper as equations, A x <= upper, and -A x <= -lower, by columns; gives their entries.

    Args:
        count: How many rows there are.
        entries: How many entries A has; of none, the new rows are not asked for.
        width: How many columns.
        lower: Lower bounds.
        upper: Upper bounds.
        rows: Row of each entry.
        cols: Its column.
        values: The entries.
        says: Filled with the bits of each row.
        sizes: Filled with the numbers of equations, of upper and of lower bounds, and of rows that no x satisfies.
        number: Scratch, as long as rows are many.
        chosen: Filled with the row that each new row is made of; at most twice as many as rows.
        b: Filled with their right sides.
        signed_rows: Scratch for twice as many entries, as all that follows but `first` and `starts`.
        signed_cols: Scratch.
        signed_values: Scratch.
        by_row: Scratch.
        order: Scratch.
        first: Scratch, one longer than the new rows and than the columns are many.
        starts: Filled with where each column begins, and where the last one ends.
        new_rows: Filled with the rows of the entries.
        new_values: Filled with the entries.
    """
    sizes[3] = 0
    for i in range(count):
        says[i] = bits(lower[i], upper[i])
        if says[i] & NEVER:
            sizes[3] += 1
    # fmt: off
    filled = _signed_rows(
        count, entries, lower, upper, rows, cols, values, says, sizes, number, chosen, b,
        signed_rows, signed_cols, signed_values,
    )
    return _columns(
        filled, sizes[0] + sizes[1] + sizes[2], width, signed_rows, signed_cols, signed_values,
        by_row, order, first, starts, new_rows, new_values,
    )
    # fmt: on


@kernel(top=True)
def sorted_columns(
    entries: int,
    height: int,
    width: int,
    rows: IntVector,
    cols: IntVector,
    values: Vector,
    by_row: IntVector,
    order: IntVector,
    first: IntVector,
    starts: IntVector,
    new_rows: IntVector,
    new_values: Vector,
) -> int:
    """A sparse matrix by columns, in each by rows; entries at one place add up. Gives how many are left.

    Args:
        entries: How many entries are given, in any order.
        height: The number of rows.
        width: The number of columns.
        rows: Row of each entry.
        cols: Its column.
        values: The entries.
        by_row: Scratch, as long as entries are many.
        order: Scratch of that length.
        first: Scratch, one longer than the rows and than the columns are many.
        starts: Filled with where each column begins, and where the last one ends.
        new_rows: Filled with the rows of the entries.
        new_values: Filled with the entries.
    """
    return _columns(entries, height, width, rows, cols, values, by_row, order, first, starts, new_rows, new_values)


@kernel(top=True)
def upper_columns(
    entries: int,
    size: int,
    places: IntVector,
    rows: IntVector,
    cols: IntVector,
    values: Vector,
    by_row: IntVector,
    order: IntVector,
    first: IntVector,
    starts: IntVector,
    new_rows: IntVector,
    new_values: Vector,
) -> int:
    """`sorted_columns` of the upper triangle of a square matrix, given by what `places` says of rows and of columns."""
    count = 0
    for e in range(entries):
        row, col = places[rows[e]], places[cols[e]]
        if row <= col:
            rows[count], cols[count], values[count] = row, col, values[e]
            count += 1
    return _columns(count, size, size, rows, cols, values, by_row, order, first, starts, new_rows, new_values)
