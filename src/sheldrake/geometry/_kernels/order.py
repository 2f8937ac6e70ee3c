"""Contacts in the order of their pairs, whatever families found them: the solver's sums must not depend on families.

Each family finds its contacts in order already, so a natural merge sort is done after a merge or two.
"""

from __future__ import annotations

import numpy as np

from sheldrake.common.kernel import kernel

from .model import ContactTable

OTHER = np.int64(1)  # order has two columns: 0 and 1


@kernel
def follows(table, m, n):
    """Whether contact m belongs behind contact n: a later pair, or a later point of the same."""
    if table.pair[m, 0] != table.pair[n, 0]:
        return table.pair[m, 0] > table.pair[n, 0]
    if table.pair[m, 1] != table.pair[n, 1]:
        return table.pair[m, 1] > table.pair[n, 1]
    return m > n


@kernel
def end_of_run(table, source, begin, end):
    """Where the contacts, in the order of this column, cease to be sorted."""
    k = begin + 1
    while k < end and not follows(table, table.order[k - 1, source], table.order[k, source]):
        k += 1
    return k


@kernel
def merge(table, source, begin, middle, end):
    """Merges two sorted runs into the other column."""
    target = OTHER - source
    i = begin
    j = middle
    for k in range(begin, end):
        if j >= end or (i < middle and follows(table, table.order[j, source], table.order[i, source])):
            table.order[k, target] = table.order[i, source]
            i += 1
        else:
            table.order[k, target] = table.order[j, source]
            j += 1


@kernel
def swap_contacts(table, m, n):
    for c in range(table.pair.shape[1]):
        number = table.pair[m, c]
        table.pair[m, c] = table.pair[n, c]
        table.pair[n, c] = number
    for c in range(table.point.shape[1]):
        value = table.point[m, c]
        table.point[m, c] = table.point[n, c]
        table.point[n, c] = value


@kernel
def move_contacts(table, source, count):
    """Puts the contact that this column names k-th at place k; one that has gone elsewhere is followed there."""
    for k in range(count):
        m = table.order[k, source]
        while m < k:
            m = table.order[m, source]
        if m != k:
            swap_contacts(table, m, k)


@kernel(top=True)
def sort_contacts(table: ContactTable) -> None:
    """Orders contacts by pair; those of one pair stay as they were found."""
    count = table.count[0]
    for k in range(count):
        table.order[k, 0] = k
    source = np.int64(0)
    sorted_to = end_of_run(table, source, np.int64(0), count)
    while sorted_to < count:
        begin = np.int64(0)
        while begin < count:
            middle = end_of_run(table, source, begin, count)
            end = count
            if middle < count:
                end = end_of_run(table, source, middle, count)
            merge(table, source, begin, middle, end)
            begin = end
        source = OTHER - source
        sorted_to = end_of_run(table, source, np.int64(0), count)
    move_contacts(table, source, count)
