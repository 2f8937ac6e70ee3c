"""Whether a pickled copy says the same as what was pickled."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

from sheldrake.common.test_utilities import numpy_compare

__all__ = ["assert_pickle"]


def assert_pickle(
    test: Any, obj: Any, value_to_compare: Callable = lambda x: x.__dict__, T: type | None = None
) -> None:
    """Asserts that `value_to_compare` of a copy made by pickle is that of the object itself.

    Args:
        test: The `unittest.TestCase`.
        obj: What is pickled.
        value_to_compare: What of it is compared.
        T: Its scalar type, when it has one; taken as in pydrake, where expressions were not pickled before 1.52.

    Raises:
        AssertionError: the copy differs.
    """
    copy = pickle.loads(pickle.dumps(obj))
    test.assertIs(type(copy), type(obj))
    numpy_compare.assert_equal(value_to_compare(copy), value_to_compare(obj))
