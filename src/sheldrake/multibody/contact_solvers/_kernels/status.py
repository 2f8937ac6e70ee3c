"""What a solve can answer. 0 is fine; everything else leaves the state of the step's start untouched."""

import numpy as np

SOLVED = np.int64(0)
ITERATION_LIMIT = np.int64(101)
LINE_SEARCH_FAILED = np.int64(102)
HESSIAN_NOT_POSITIVE = np.int64(103)
FACTOR_CAPACITY = np.int64(104)
CONTACT_CAPACITY = np.int64(105)
ROW_CAPACITY = np.int64(106)
TAMSI_FAILED = np.int64(107)
MASS_NOT_POSITIVE = np.int64(108)
UNSUPPORTED_PAIR = np.int64(109)
MOTION_NOT_FINITE = np.int64(110)
