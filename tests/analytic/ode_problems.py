"""The test set of Hull, Enright, Fellen and Sedgwick ("Comparing numerical methods for ordinary differential
equations", SIAM J. Numer. Anal. 9, 1972): 25 initial value problems in five classes, all from x = 0 to 20."""

from __future__ import annotations

import numpy as np

END = 20.0


def _chain(n, rates):
    """Decay from one element of a chain to the next, at these rates; the last one keeps all."""

    def f(x, y):
        flow = rates(np.arange(1, n)) * y[:-1]
        return np.concatenate([[0.0], flow]) - np.concatenate([flow, [0.0]])

    return f, np.eye(n)[0]


def _heat(n):
    """Second differences, zero at both ends."""
    A = np.diag(np.full(n, -2.0)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)
    return (lambda x, y: A @ y), np.eye(n)[0]


def _orbit(eccentricity):
    """A body on an ellipse."""

    def f(x, y):
        r = np.hypot(y[0], y[1])
        return np.array([y[2], y[3], -y[0] / r**3, -y[1] / r**3])

    return f, np.array([1 - eccentricity, 0.0, 0.0, np.sqrt((1 + eccentricity) / (1 - eccentricity))])


def _planets():
    """Five outer planets (C5): lengths in astronomical units, time in 100 days."""
    k, sun = 2.95912208286, 1.00000597682
    m = np.array([0.000954786104043, 0.000285583733151, 0.0000437273164546, 0.0000517759138449, 0.00000277777777778])
    p = [3.42947415189, 3.35386959711, 1.35494901715, 6.64145542550, 5.97156957878, 2.18231499728]
    p += [11.2630437207, 14.6952576794, 6.27960525067, -30.1552268759, 1.65699966404, 1.43785752721]
    p += [-21.1238353380, 28.4465098142, 15.3882659679]
    v = [-0.557160570446, 0.505696783289, 0.230578543901, -0.415570776342, 0.365682722812, 0.169143213293]
    v += [-0.325325669158, 0.189706021964, 0.0877265322780, -0.0240476254170, -0.287659532608, -0.117219543175]
    v += [-0.176860753121, -0.216393453025, -0.0148647893090]

    def f(x, y):
        q = y[:15].reshape(5, 3)
        r3 = np.linalg.norm(q, axis=1) ** 3
        d = q[:, None] - q[None]
        d3 = np.linalg.norm(d, axis=2) ** 3 + np.eye(5)
        pull = -(sun + m)[:, None] * q / r3[:, None]
        among = -(m[None, :, None] * (d / d3[:, :, None] + (q / r3[:, None])[None] * (1 - np.eye(5))[:, :, None])).sum(
            1
        )
        return np.concatenate([y[15:], (k * (pull + among)).ravel()])

    return f, np.array(p + v)


def _ring(x, y):
    r = np.hypot(y[0], y[1])
    return np.array([-y[1] - y[0] * y[2] / r, y[0] - y[1] * y[2] / r, y[0] / r])


def _vec(f, *start):
    return (lambda x, y: np.array(f(x, *y))), np.array(start, float)


PROBLEMS = {
    "A1": _vec(lambda x, y: [-y], 1),
    "A2": _vec(lambda x, y: [-(y**3) / 2], 1),
    "A3": _vec(lambda x, y: [y * np.cos(x)], 1),
    "A4": _vec(lambda x, y: [y / 4 * (1 - y / 20)], 1),
    "A5": _vec(lambda x, y: [(y - x) / (y + x)], 4),
    "B1": _vec(lambda x, a, b: [2 * (a - a * b), -(b - a * b)], 1, 3),
    "B2": _vec(lambda x, a, b, c: [-a + b, a - 2 * b + c, b - c], 2, 0, 1),
    "B3": _vec(lambda x, a, b, c: [-a, a - b * b, b * b], 1, 0, 0),
    "B4": (_ring, np.array([3.0, 0.0, 0.0])),
    "B5": _vec(lambda x, a, b, c: [b * c, -a * c, -0.51 * a * b], 0, 1, 1),
    "C1": _chain(10, lambda i: np.ones(len(i))),
    "C2": _chain(10, lambda i: i),
    "C3": _heat(10),
    "C4": _heat(51),
    "C5": _planets(),
    **{f"D{k + 1}": _orbit(e) for k, e in enumerate((0.1, 0.3, 0.5, 0.7, 0.9))},
    "E1": _vec(
        lambda x, a, b: [b, -(b / (x + 1) + (1 - 0.25 / (x + 1) ** 2) * a)], 0.6713967071418030, 0.09540051444747446
    ),
    "E2": _vec(lambda x, a, b: [b, (1 - a * a) * b - a], 2, 0),
    "E3": _vec(lambda x, a, b: [b, a**3 / 6 - a + 2 * np.sin(2.78535 * x)], 0, 0),
    "E4": _vec(lambda x, a, b: [b, 0.032 - 0.4 * b * b], 30, 0),
    "E5": _vec(lambda x, a, b: [b, np.sqrt(1 + b * b) / (25 - x)], 0, 0),
}
