"""Contacts in the order of their pairs, whatever families found them: the solver's sums must not depend on families.

Each family finds its contacts in order already, so a natural merge sort is done after a merge or two. What is sorted
are single integers: of a contact its two geometries, and behind them its place.
"""

from __future__ import annotations

from sheldrake.common.kernel import kernel

from .model import MOST_NUMBERED, ContactTable
from .table import contacts_in_lanes

OTHER = 1  # order has two columns: 0 and 1


@kernel
def key_of(table, k):
    """What contact k is sorted by."""
    contact = table[k]
    return (contact.geometry_A * MOST_NUMBERED + contact.geometry_B) * MOST_NUMBERED + k


@kernel
def end_of_run(table, source, begin, end):
    """Where the contacts, in the order of this column, cease to be sorted."""
    k = min(begin + 1, end)
    while k < end and table.order[k - 1, source] < table.order[k, source]:
        k += 1
    return k


@kernel
def merge(table, source, begin, middle, end):
    """Merges two sorted runs into the other column."""
    target = OTHER - source
    i = begin
    j = middle
    for k in range(begin, end):
        if j >= end or (i < middle and table.order[i, source] < table.order[j, source]):
            table.order[k, target] = table.order[i, source]
            i += 1
        else:
            table.order[k, target] = table.order[j, source]
            j += 1


@kernel
def move_contacts(table, source, count):
    """Puts the contact that this column names k-th at place k, one ring of changed places after the other."""
    for k in range(count):
        m = table.order[k, source] % MOST_NUMBERED
        if m != k:
            who, where = table[k].who, table[k].where
            free = k
            while m != k:
                table[free].who, table[free].where = table[m].who, table[m].where
                table.order[free, source] = free
                free = m
                m = table.order[free, source] % MOST_NUMBERED
            table[free].who, table[free].where = who, where
            table.order[free, source] = free


@kernel(top=True, lanes=contacts_in_lanes)
def sort_contacts(table: ContactTable) -> None:
    """Orders contacts by pair; those of one pair stay as they were found."""
    count = table.num_contacts
    for k in range(count):
        table.order[k, 0] = key_of(table, k)
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
