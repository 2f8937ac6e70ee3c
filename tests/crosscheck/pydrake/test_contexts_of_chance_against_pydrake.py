"""Values that are kept are those of pydrake, whatever was written to contexts and copied between them before."""

import pytest

pytest.importorskip("pydrake")

from tests.crosscheck.pydrake.random_contexts import run

pytestmark = pytest.mark.peer


@pytest.mark.parametrize("block", range(8))
def test_values_after_writes_and_copies(block):
    for seed in range(25 * block, 25 * block + 25):
        assert run("sheldrake", seed) == run("pydrake", seed), seed
