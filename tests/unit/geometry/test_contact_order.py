"""Contacts sorted by pair: whatever the runs they come in, those of one pair stay as they were found."""

import numpy as np
import pytest

from sheldrake.geometry._kernels.model import contact_table, empty_geometry_model
from sheldrake.geometry._kernels.order import sort_contacts


def table_in_runs(n, runs, seed):
    """A table of n contacts in sorted runs, numbered in `pair[:, 2]` as they were found."""
    rng = np.random.default_rng(seed)
    pair = np.sort(rng.integers(0, 20, (n, 4)), axis=1)
    cuts = np.sort(rng.integers(0, n + 1, runs - 1))
    for run in np.split(np.arange(n), cuts):
        pair[run] = pair[run][np.lexsort((pair[run, 1], pair[run, 0]))]
    pair[:, 2] = np.arange(n)
    table = contact_table(empty_geometry_model(), n)
    return table._replace(pair=pair, point=rng.normal(size=(n, 10)), count=np.array([n, 0]))


@pytest.mark.parametrize("native", [True, False], ids=["native", "twin"])
@pytest.mark.parametrize("runs", [1, 2, 3, 40])
@pytest.mark.parametrize("n", [0, 1, 2, 7, 300])
def test_sorted_and_stable(n, runs, native):
    table = table_in_runs(n, runs, seed=n + runs)
    pair, point = table.pair.copy(), table.point.copy()
    expected = np.lexsort((pair[:, 2], pair[:, 1], pair[:, 0]))
    if native:
        sort_contacts.bind(table)()
    else:
        sort_contacts(table)
    np.testing.assert_array_equal(table.pair, pair[expected])
    np.testing.assert_array_equal(table.point, point[expected])
