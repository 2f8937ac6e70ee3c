"""Normal noise around the default state of a linear or affine system."""

from __future__ import annotations

from itertools import islice

import numpy as np

from sheldrake.common import RandomGenerator
from sheldrake.common._distributions import gaussian_pairs
from sheldrake.systems.framework import Context


def add_normal_noise(context: Context, covariance: np.ndarray, generator: RandomGenerator) -> None:
    """Adds the symmetric root of the covariance, shape (n, n), times normal numbers to the state: Drake's numbers."""
    continuous = context.num_continuous_states() > 0
    x = context.get_continuous_state_vector() if continuous else context.get_discrete_state_vector()
    values, vectors = np.linalg.eigh(covariance)
    normal = np.array([*islice(gaussian_pairs(generator), len(values))])
    x.SetFromVector(x.CopyToVector() + vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T @ normal)
