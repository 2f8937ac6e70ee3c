"""Contacts in the order of their pairs, whatever families found them: the solver's sums must not depend on families.

Each family finds its contacts in order already, so a natural merge sort is done after a merge or two.
"""

from __future__ import annotations

from sheldrake.common.kernel import kernel

from .model import ContactTable

OTHER = 1  # order has two columns: 0 and 1


@kernel
def follows(table, m, n):
    """Whether contact m belongs behind contact n: a later pair, or a later point of the same."""
    if table[m].geometry_A != table[n].geometry_A:
        return table[m].geometry_A > table[n].geometry_A
    if table[m].geometry_B != table[n].geometry_B:
        return table[m].geometry_B > table[n].geometry_B
    return m > n


@kernel
def end_of_run(table, source, begin, end):
    """Where the contacts, in the order of this column, cease to be sorted."""
    k = min(begin + 1, end)
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
def move_contacts(table, source, count):
    """Puts the contact that this column names k-th at place k; one that has gone elsewhere is followed there."""
    for k in range(count):
        m = table.order[k, source]
        while m < k:
            m = table.order[m, source]
        if m != k:
            table[m].who, table[k].who = table[k].who, table[m].who
            table[m].where, table[k].where = table[k].where, table[m].where


@kernel(top=True)
def sort_contacts(table: ContactTable) -> None:
    """Orders contacts by pair; those of one pair stay as they were found."""
    count = table.num_contacts
    for k in range(count):
        table.order[k, 0] = k
    source = 0
    sorted_to = end_of_run(table, source, 0, count)
    while sorted_to < count:
        begin = 0
        while begin < count:
            middle = end_of_run(table, source, begin, count)
            end = end_of_run(table, source, middle, count)
            merge(table, source, begin, middle, end)
            begin = end
        source = OTHER - source
        sorted_to = end_of_run(table, source, 0, count)
    move_contacts(table, source, count)
