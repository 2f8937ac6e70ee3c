"""By how much cubics have other slopes in the middle of segments than the dynamics, with first and second derivatives.

A segment is a row (h, x0, x1, u0, u1) of `z`; a sample is (x, u). The dynamics f, their Jacobian J by (x, u) and second
derivatives are given at samples and at middles, row by row; matrices of a segment or of a sample are rows too, one row
of the matrix after the other.
"""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common.kernel import Matrix, kernel


class Segments(NamedTuple):
    """Memory for segments.

    Attributes:
        z: The segments, shape (segments, 1 + 2 nx + 2 nu).
        samples: (x, u) where segments begin, then where they end; of the ends only the last where each segment begins
            where the one before it ends; shape (samples, nx + nu).
        middles: (x, u) in their middles.
        f: At samples.
        J: Likewise.
        fm: In the middles.
        Jm: Likewise.
        defects: Shape (segments, nx).
        slopes: Derivatives of the defects by the segments.
        weights: Of the defects in what `curvature` is the second derivative of, shape (segments, nx).
        point_weights: Of the dynamics in that, at samples, then in the middles.
        point_curvature: Second derivatives of these dynamics.
        curvature: Second derivatives, shape (segments, (1 + 2 nx + 2 nu)**2).
        T: Derivatives of (x, u) in one middle by the segment.
        HT: Scratch, as large.
    """

    z: Matrix
    samples: Matrix
    middles: Matrix
    f: Matrix
    J: Matrix
    fm: Matrix
    Jm: Matrix
    defects: Matrix
    slopes: Matrix
    weights: Matrix
    point_weights: Matrix
    point_curvature: Matrix
    curvature: Matrix
    T: Matrix
    HT: Matrix


@kernel
def column(k, nx, nu, is_end):
    """Of (x, u) at the beginning or end of a segment: where its element k is in the segment."""
    if k < nx:
        return 1 + k + is_end * nx
    return 1 + nx + k + is_end * nu


@kernel
def end_of(work, s):
    """The row of the sample at the end of a segment."""
    count = work.z.shape[0]
    if work.samples.shape[0] == 2 * count:
        return s + count
    return s + 1


@kernel
def take_samples(work, nx, nu):
    """Samples of the segments."""
    z, samples = work.z, work.samples
    for s in range(z.shape[0]):
        e = end_of(work, s)
        for k in range(nx + nu):
            samples[s, k] = z[s, column(k, nx, nu, 0)]
        for k in range(nx + nu):
            samples[e, k] = z[s, column(k, nx, nu, 1)]


@kernel
def take_middles(work, nx, nu):
    """States and inputs in the middles."""
    z, f = work.z, work.f
    for s in range(z.shape[0]):
        a, b = s, end_of(work, s)
        for k in range(nx + nu):
            work.middles[s, k] = 0.5 * (work.samples[a, k] + work.samples[b, k])
        for k in range(nx):
            work.middles[s, k] += z[s, 0] / 8.0 * (f[a, k] - f[b, k])


@kernel
def take_defects(work, nx):
    """The defects."""
    z, f = work.z, work.f
    for s in range(z.shape[0]):
        a, b = s, end_of(work, s)
        for i in range(nx):
            slope = 1.5 * (z[s, 1 + nx + i] - z[s, 1 + i]) / z[s, 0] - 0.25 * (f[a, i] + f[b, i])
            work.defects[s, i] = slope - work.fm[s, i]


@kernel
def take_slopes(work, nx, nu):
    """Derivatives of the defects."""
    z, f, J, Jm = work.z, work.f, work.J, work.Jm
    n, width = nx + nu, z.shape[1]
    for s in range(z.shape[0]):
        a, b, h = s, end_of(work, s), z[s, 0]
        part = h / 8.0
        for i in range(nx):
            row, by_step = i * width, 0.0
            for k in range(nx):
                by_step -= Jm[s, i * n + k] * (f[a, k] - f[b, k]) / 8.0
            work.slopes[s, row] = by_step - 1.5 * (z[s, 1 + nx + i] - z[s, 1 + i]) / (h * h)
            for k in range(n):
                first, second = 0.0, 0.0
                for j in range(nx):
                    first += Jm[s, i * n + j] * J[a, j * n + k]
                    second += Jm[s, i * n + j] * J[b, j * n + k]
                both = -0.5 * Jm[s, i * n + k]
                work.slopes[s, row + column(k, nx, nu, 0)] = both - part * first - 0.25 * J[a, i * n + k]
                work.slopes[s, row + column(k, nx, nu, 1)] = both + part * second - 0.25 * J[b, i * n + k]
            work.slopes[s, row + 1 + i] -= 1.5 / h
            work.slopes[s, row + 1 + nx + i] += 1.5 / h


@kernel
def by_middle(work, s, j, n, nx):
    """How a segment's weighted defects change with element j of the state in its middle."""
    total = 0.0
    for i in range(nx):
        total -= work.weights[s, i] * work.Jm[s, i * n + j]
    return total


@kernel
def weigh_points(work, nx, nu):
    """Which sum of the dynamics bends weighted defects, at samples and in middles."""
    samples = work.samples.shape[0]
    for p in range(work.point_weights.shape[0]):
        for j in range(nx):
            work.point_weights[p, j] = 0.0
    for s in range(work.z.shape[0]):
        a, b = s, end_of(work, s)
        for j in range(nx):
            bent = work.z[s, 0] / 8.0 * by_middle(work, s, j, nx + nu, nx)
            work.point_weights[a, j] += bent - 0.25 * work.weights[s, j]
            work.point_weights[b, j] += -bent - 0.25 * work.weights[s, j]
            work.point_weights[samples + s, j] = -work.weights[s, j]


@kernel
def differentiate_middle(work, s, nx, nu):
    """Fills T."""
    f, J, T = work.f, work.J, work.T
    a, b, n = s, end_of(work, s), nx + nu
    part = work.z[s, 0] / 8.0
    for k in range(n):
        for c in range(T.shape[1]):
            T[k, c] = 0.0
    for k in range(nx):
        T[k, 0] = (f[a, k] - f[b, k]) / 8.0
        for j in range(n):
            T[k, column(j, nx, nu, 0)] = part * J[a, k * n + j]
            T[k, column(j, nx, nu, 1)] = -part * J[b, k * n + j]
    for k in range(n):
        T[k, column(k, nx, nu, 0)] += 0.5
        T[k, column(k, nx, nu, 1)] += 0.5


@kernel
def add_sample(work, s, p, is_end, nx, nu):
    """Adds the second derivatives of the dynamics at a sample to those of a segment that begins or ends there."""
    n, width = nx + nu, work.z.shape[1]
    for k in range(n):
        row = column(k, nx, nu, is_end) * width
        for j in range(n):
            work.curvature[s, row + column(j, nx, nu, is_end)] += work.point_curvature[p, k * n + j]


@kernel
def bend_with_middle(work, s, n):
    """Second derivatives T' H T of the dynamics in the middle of a segment."""
    T, HT, H = work.T, work.HT, work.point_curvature
    p, width = work.samples.shape[0] + s, work.z.shape[1]
    for k in range(n):
        for c in range(width):
            HT[k, c] = 0.0
        for j in range(n):
            for c in range(width):
                HT[k, c] += H[p, k * n + j] * T[j, c]
    for r in range(width):
        for c in range(width):
            work.curvature[s, r * width + c] = 0.0
        for k in range(n):
            if T[k, r] != 0.0:
                for c in range(width):
                    work.curvature[s, r * width + c] += T[k, r] * HT[k, c]


@kernel
def add_mixed(work, s, r, value):
    """Adds a derivative by the step and by another element of a segment."""
    work.curvature[s, r] += value
    work.curvature[s, r * work.z.shape[1]] += value


@kernel
def bend_with_step(work, s, nx, nu):
    """Adds what the step does in a segment: it goes with the slopes in the middle, and divides differences."""
    z, J, weights = work.z, work.J, work.weights
    a, b, n, h = s, end_of(work, s), nx + nu, z[s, 0]
    for i in range(nx):
        bent = by_middle(work, s, i, n, nx) / 8.0
        for k in range(n):
            add_mixed(work, s, column(k, nx, nu, 0), bent * J[a, i * n + k])
            add_mixed(work, s, column(k, nx, nu, 1), -bent * J[b, i * n + k])
        add_mixed(work, s, 1 + i, 1.5 / (h * h) * weights[s, i])
        add_mixed(work, s, 1 + nx + i, -1.5 / (h * h) * weights[s, i])
        work.curvature[s, 0] += 3.0 * weights[s, i] * (z[s, 1 + nx + i] - z[s, 1 + i]) / (h * h * h)


@kernel
def take_curvature(work, nx, nu):
    """Second derivatives of weighted defects; those of samples in the segments that begin there, if there are any."""
    count = work.z.shape[0]
    for s in range(count):
        differentiate_middle(work, s, nx, nu)
        bend_with_middle(work, s, nx + nu)
        bend_with_step(work, s, nx, nu)
        add_sample(work, s, s, 0, nx, nu)
        if end_of(work, s) >= count:
            add_sample(work, s, end_of(work, s), 1, nx, nu)


SAMPLES, MIDDLES, DEFECTS, SLOPES, WEIGHTS, CURVATURE = range(6)


@kernel(top=True)
def collocate(work: Segments, nx: int, nu: int, what: int) -> None:
    """One of the above.

    Args:
        work: The segments.
        nx: How many states there are.
        nu: How many inputs.
        what: SAMPLES, MIDDLES (which need f), DEFECTS (fm), SLOPES (J and Jm), WEIGHTS or CURVATURE.
    """
    if what == SAMPLES:
        take_samples(work, nx, nu)
    elif what == MIDDLES:
        take_middles(work, nx, nu)
    elif what == DEFECTS:
        take_defects(work, nx)
    elif what == SLOPES:
        take_slopes(work, nx, nu)
    elif what == WEIGHTS:
        weigh_points(work, nx, nu)
    else:
        take_curvature(work, nx, nu)
