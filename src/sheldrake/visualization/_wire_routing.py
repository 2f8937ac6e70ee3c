"""Vertical pieces of wires between two layers of a drawing, and lanes for wires that go back below it."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

Net = Any  # what all wires of one output port have in common: that port


class Channel:
    """The space between two layers, with one vertical piece for each net that changes its height there."""

    def __init__(self) -> None:
        self.left: dict[Hashable, set[float]] = {}
        self.right: dict[Hashable, set[float]] = {}
        self.x: dict[Hashable, float] = {}

    def add(self, net: Net, y_left: float | None, y_right: float | None) -> None:
        """Notes that a net comes at a height from the left, or leaves at one to the right."""
        left, right = self.left.setdefault(net, set()), self.right.setdefault(net, set())
        if y_left is not None:
            left.add(round(y_left, 6))
        if y_right is not None:
            right.add(round(y_right, 6))

    def nets(self) -> list[Net]:
        """Returns the nets."""
        return list(self.left)

    def span(self, net: Net) -> tuple[float, float]:
        """Returns the ends of a net's vertical piece."""
        heights = self.left[net] | self.right[net]
        return min(heights), max(heights)

    def branches(self) -> list[tuple[float, float]]:
        """Returns where a net's piece is met by more than turns it: dots in a drawing."""
        dots = []
        for net in self.nets():
            low, high = self.span(net)
            for y in self.left[net] | self.right[net]:
                sides = (y in self.left[net]) + (y in self.right[net])
                ways = sides + (low < y) + (y < high)
                if ways > 2:
                    dots.append((self.x[net], y))
        return dots


def _cost(channel: Channel, a: Net, b: Net) -> int:
    """Returns how many crossings there are between two nets when a's piece is left of b's."""
    low_a, high_a = channel.span(a)
    low_b, high_b = channel.span(b)
    from_left = sum(low_a < y < high_a for y in channel.left[b])
    to_right = sum(low_b < y < high_b for y in channel.right[a])
    # Where pieces end at each other's wires they would lie on one another.
    touching = sum(y in (low_a, high_a) for y in channel.left[b]) + sum(y in (low_b, high_b) for y in channel.right[a])
    return from_left + to_right + touching


def order_tracks(channel: Channel) -> dict[Net, int]:
    """Returns a track for each net, counted from the left, so that few wires cross and none lie on one another."""
    order = sorted(channel.nets(), key=channel.span)
    improved = True
    while improved:
        improved = False
        for k in range(len(order) - 1):
            a, b = order[k], order[k + 1]
            if _cost(channel, b, a) < _cost(channel, a, b):
                order[k], order[k + 1] = b, a
                improved = True
    tracks: dict[Net, int] = {}
    for k, net in enumerate(order):
        low, high = channel.span(net)
        if low == high:
            tracks[net] = 0  # straight on: no vertical piece
            continue
        track = 0
        for other in order[:k]:
            other_low, other_high = channel.span(other)
            if other_low < other_high and low <= other_high + 1e-9 and other_low <= high + 1e-9:
                track = max(track, tracks[other] + 1)
        tracks[net] = track
    return tracks


def lanes_below(bottoms: list[float], spans: list[tuple[Net, int, int]], spacing: float) -> dict[Net, float]:
    """Returns the height of a lane below all boxes on its way for each net; short ways above long ones.

    Args:
        bottoms: Lowest point of each layer.
        spans: Net, first and last layer on its way; a net may come several times.
        spacing: Between two lanes, and between a lane and a box.
    """
    ways: dict[Net, tuple[int, int]] = {}
    for net, first, last in spans:
        known = ways.get(net, (first, last))
        ways[net] = min(known[0], first), max(known[1], last)
    below, lanes = list(bottoms), {}
    for net, (first, last) in sorted(ways.items(), key=lambda item: item[1][1] - item[1][0]):
        lanes[net] = max(below[first : last + 1]) + spacing
        for layer in range(first, last + 1):
            below[layer] = lanes[net]
    return lanes


def simplified(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Returns a path of horizontal and vertical pieces without the points that are no corners."""
    corners: list[tuple[float, float]] = []
    for point in points:
        if corners and abs(corners[-1][0] - point[0]) + abs(corners[-1][1] - point[1]) < 1e-9:
            continue
        if len(corners) > 1 and any(
            abs(corners[-2][k] - point[k]) < 1e-9 and abs(corners[-1][k] - point[k]) < 1e-9 for k in (0, 1)
        ):
            corners.pop()
        corners.append(point)
    return corners
