"""What tests of robotics code use again and again: comparison of arrays of any scalar, of pickles, of warnings.

Import the modules by name: `from sheldrake.common.test_utilities import numpy_compare`.
"""

from __future__ import annotations

__all__: list[str] = []
