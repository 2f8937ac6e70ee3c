"""Random numbers in kernels: the sequence of `RandomGenerator`, which goes on from where a kernel leaves it.

The 32-bit Mersenne twister (M. Matsumoto, T. Nishimura, ACM TOMACS 8, 1998) and C++'s distributions on it. A generator
is its key, shape (624,), and a place: the position of its next integer in the key, and how often the key was twisted.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import log, sqrt
from sheldrake.common.kernel import kernel

SIZE, MIDDLE = 624, 397
TWO_32, TWO_64, BELOW_ONE = 2.0**32, 2.0**64, 1.0 - 2.0**-53


@kernel
def twisted(this, following, far):
    y = (this & 0x80000000) | (following & 0x7FFFFFFF)
    return far ^ (y >> 1) ^ ((y & 1) * 0x9908B0DF)


@kernel(outline=True)
def twist(key):
    """The next key."""
    for k in range(SIZE - MIDDLE):
        key[k] = twisted(key[k], key[k + 1], key[k + MIDDLE])
    for k in range(SIZE - MIDDLE, SIZE - 1):
        key[k] = twisted(key[k], key[k + 1], key[k + MIDDLE - SIZE])
    key[SIZE - 1] = twisted(key[SIZE - 1], key[0], key[MIDDLE - 1])


@kernel
def next_integer(key, place):
    """Below 2^32."""
    if place[0] == SIZE:
        twist(key)
        place[0] = 0
        place[1] += 1
    y = key[place[0]]
    place[0] += 1
    y ^= y >> 11
    y ^= (y << 7) & 0x9D2C5680
    y ^= (y << 15) & 0xEFC60000
    return y ^ (y >> 18)


@kernel
def next_uniform(key, place):
    """In [0, 1), as C++'s generate_canonical makes it: low half first."""
    low = next_integer(key, place)
    high = next_integer(key, place)
    return min((low + high * TWO_32) / TWO_64, BELOW_ONE)


@kernel(strict=True)
def next_gaussians(key, place):
    """Two normal numbers, in the order in which one C++ distribution gives them (Marsaglia's polar method)."""
    x, y, r2 = 0.0, 0.0, 0.0
    while r2 == 0.0 or r2 > 1.0:
        x = 2.0 * next_uniform(key, place) - 1.0
        y = 2.0 * next_uniform(key, place) - 1.0
        r2 = x * x + y * y
    factor = sqrt(-2.0 * log(r2) / r2)
    return (y * factor, x * factor)
