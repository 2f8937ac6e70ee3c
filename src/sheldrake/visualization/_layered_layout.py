"""Layered drawings of directed graphs with ports: boxes in columns, wires from left to right, feedback below.

After Sugiyama, Tagawa and Toda (1981): take cycles out, put boxes into layers, order each layer for few crossings,
place the boxes, route the wires. Nothing here knows what is drawn.
"""

from __future__ import annotations

import collections
import dataclasses
import itertools
import math

from ._wire_routing import Channel, lanes_below, order_tracks, simplified

GAP = 26.0  # between boxes of one layer
LANE = 12.0  # between wires that pass
MARGIN = 18.0  # between boxes and the nearest vertical piece of a wire
SWEEPS = 24


@dataclasses.dataclass
class Box:
    """Something to place: its size, and how far below its top each port is.

    Attributes:
        width: Width.
        height: Height.
        inputs: Distance of each input port from the top; on the left side.
        outputs: Distance of each output port from the top; on the right side.
        end: -1 to be in the first layer, +1 to be in the last one, 0 for anywhere.
        x: Left side, once placed.
        y: Top, once placed.
        layer: Number of its column, once placed.
    """

    width: float
    height: float
    inputs: list[float] = dataclasses.field(default_factory=list)
    outputs: list[float] = dataclasses.field(default_factory=list)
    end: int = 0
    x: float = 0.0
    y: float = 0.0
    layer: int = 0


@dataclasses.dataclass
class Wire:
    """A connection from an output port (box, port) to an input port, and the corners of its path once routed."""

    source: tuple[int, int]
    target: tuple[int, int]
    points: list[tuple[float, float]] = dataclasses.field(default_factory=list)


@dataclasses.dataclass
class _Item:
    """One place in a layer: a box, or where a wire passes."""

    height: float
    box: int = -1
    y: float = 0.0


class Layout:
    """Places boxes and routes wires; `width` and `height` say how large the drawing is, `dots` where wires branch."""

    def __init__(self, boxes: list[Box], wires: list[Wire]):
        self.boxes, self.wires = boxes, wires
        self.dots: list[tuple[float, float]] = []
        self._forward = self._acyclic()
        self._assign_layers()
        self._make_items()
        self._order_layers()
        self._place_vertically()
        self._route()

    # ---- cycles

    def _acyclic(self) -> list[bool]:
        """Returns for each wire whether it points forward, such that those which do make no cycle.

        The greedy sequence of Eades, Lin and Smyth (1993): few wires point backward.
        """
        n = len(self.boxes)
        after: list[collections.Counter[int]] = [collections.Counter() for _ in range(n)]
        before: list[collections.Counter[int]] = [collections.Counter() for _ in range(n)]
        for wire in self.wires:
            u, v = wire.source[0], wire.target[0]
            if u != v:
                after[u][v] += 1
                before[v][u] += 1
        left, right = [], []
        rest = dict.fromkeys(range(n))

        def take(u: int) -> None:
            del rest[u]
            for v in after[u]:
                before[v].pop(u, None)
            for v in before[u]:
                after[v].pop(u, None)

        while rest:
            sink = next((u for u in rest if not after[u]), None)
            source = next((u for u in rest if not before[u]), None)
            if sink is not None and before[sink]:
                right.append(sink)
                take(sink)
            elif source is not None:
                left.append(source)
                take(source)
            else:
                best = max(rest, key=lambda u: sum(after[u].values()) - sum(before[u].values()))
                left.append(best)
                take(best)
        place = {u: k for k, u in enumerate(left + right[::-1])}
        return [place[wire.source[0]] < place[wire.target[0]] for wire in self.wires]

    # ---- layers

    def _assign_layers(self) -> None:
        """Longest path from the left; then boxes that feed more than they are fed move right, to what they feed."""
        boxes = self.boxes
        ahead: list[set[int]] = [set() for _ in boxes]
        behind: list[set[int]] = [set() for _ in boxes]
        for wire, forward in zip(self.wires, self._forward):
            if forward:
                ahead[wire.source[0]].add(wire.target[0])
                behind[wire.target[0]].add(wire.source[0])
        order = _topological(ahead, behind)
        for u in order:
            boxes[u].layer = max((boxes[v].layer + 1 for v in behind[u]), default=0)
        for u in reversed(order):
            if ahead[u] and len(ahead[u]) > len(behind[u]) and boxes[u].end == 0:
                boxes[u].layer = min(boxes[v].layer for v in ahead[u]) - 1
        last = max((box.layer for box in boxes), default=0)
        # Inputs of the whole stand in a column of their own, outputs likewise.
        if any(box.end < 0 for box in boxes) and any(b.layer == 0 and b.end == 0 for b in boxes):
            for box in boxes:
                box.layer += box.end >= 0
            last += 1
        if any(box.end > 0 for box in boxes):
            inner = max((box.layer for box in boxes if box.end <= 0), default=-1)
            last = max(inner + 1, 0)
            for box in boxes:
                box.layer = last if box.end > 0 else box.layer
        lonely = [u for u in range(len(boxes)) if not ahead[u] and not behind[u] and boxes[u].end == 0]
        self._spread(lonely, last)
        self._num_layers = 1 + max((box.layer for box in boxes), default=0)

    def _spread(self, lonely: list[int], last: int) -> None:
        """Puts boxes without forward wires where columns are short."""
        inner = [c for c in range(last + 1) if not any(b.layer == c and b.end for b in self.boxes)] or [0]
        others = [box for u, box in enumerate(self.boxes) if u not in lonely]
        height = {c: sum(box.height + GAP for box in others if box.layer == c) for c in inner}
        for u in lonely:
            column = min(inner, key=lambda c: height[c])
            self.boxes[u].layer = column
            height[column] += self.boxes[u].height + GAP

    # ---- order

    def _make_items(self) -> None:
        """Makes what stands in each layer, and the links between neighbouring layers."""
        self._layers: list[list[_Item]] = [[] for _ in range(self._num_layers)]
        self._item_of = []
        for u, box in enumerate(self.boxes):
            item = _Item(box.height, u)
            self._item_of.append(item)
            self._layers[box.layer].append(item)
        self._passing: dict[tuple[tuple[int, int], int], _Item] = {}  # wires of one port pass as one
        # (left item, its port's offset, right item, its port's offset), by the layer on the left
        self._links: list[dict[tuple, None]] = [{} for _ in range(self._num_layers)]
        self._items = {id(item): item for item in self._item_of}
        for wire, forward in zip(self.wires, self._forward):
            if not forward:
                continue
            (u, i), (v, j) = wire.source, wire.target
            at, offset = self._item_of[u], self.boxes[u].outputs[i]
            for layer in range(self.boxes[u].layer + 1, self.boxes[v].layer):
                passing = self._passing.get((wire.source, layer))
                item = passing or _Item(0.0)
                if passing is None:
                    self._passing[wire.source, layer] = item
                    self._items[id(item)] = item
                    self._layers[layer].append(item)
                self._links[layer - 1][id(at), offset, id(item), 0.0] = None
                at, offset = item, 0.0
            layer = self.boxes[v].layer
            self._links[layer - 1][id(at), offset, id(self._item_of[v]), self.boxes[v].inputs[j]] = None

    def _neighbours(self) -> tuple[dict, dict]:
        """Returns for each item its links (own offset, item, its offset) to the left and to the right."""
        left, right = collections.defaultdict(list), collections.defaultdict(list)
        for links in self._links:
            for a, p, b, q in links:
                right[a].append((p, self._items[b], q))
                left[b].append((q, self._items[a], p))
        return left, right

    def _order_layers(self) -> None:
        """Orders each layer by the mean of its neighbours' places, back and forth; keeps the best order found."""
        left, right = self._neighbours()
        for layer in self._layers:
            self._stack(layer)
        best, fewest = [list(layer) for layer in self._layers], self._crossings()
        for sweep in range(SWEEPS):
            if fewest == 0:
                break
            sides, order = (left, self._layers[1:]) if sweep % 2 == 0 else (right, self._layers[-2::-1])
            for layer in order:
                wanted = {
                    id(item): _mean([other.y + q - p for p, other, q in sides[id(item)]], item.y) for item in layer
                }
                layer.sort(key=lambda item: wanted[id(item)])
                self._stack(layer)
            crossings = self._crossings()
            if crossings < fewest:
                best, fewest = [list(layer) for layer in self._layers], crossings
        self._layers = best
        for layer in self._layers:
            self._stack(layer)

    @staticmethod
    def _stack(layer: list[_Item]) -> None:
        """Places a layer's items one below the other around zero."""
        heights = [item.height + (GAP if item.box >= 0 else LANE) for item in layer]
        top = -sum(heights) / 2
        for item, height in zip(layer, heights):
            item.y = top
            top += height

    def _crossings(self) -> int:
        """Returns how many pairs of links between neighbouring layers cross."""
        count = 0
        for links in self._links:
            ends = sorted((self._items[a].y + p, self._items[b].y + q) for a, p, b, q in links)
            count += sum(x[1] > y[1] and x[0] < y[0] for x, y in itertools.combinations(ends, 2))
        return count

    # ---- places

    def _place_vertically(self) -> None:
        """Moves items towards what they are linked to, as near as order and gaps allow."""
        left, right = self._neighbours()
        for sweep in range(SWEEPS):
            to_right = sweep % 2 == 0
            for layer in self._layers if to_right else self._layers[::-1]:
                wanted, weights = [], []
                for item in layer:
                    if sweep >= SWEEPS - 4:
                        links = left[id(item)] + right[id(item)]
                    else:
                        links = (left if to_right else right)[id(item)]
                    wanted.append(_mean([other.y + q - p for p, other, q in links], item.y))
                    weights.append(0.1 + sum(8.0 if item.box < 0 and other.box < 0 else 1.0 for _, other, _ in links))
                gaps = [
                    a.height + (GAP if a.box >= 0 and b.box >= 0 else LANE if a.box < 0 and b.box < 0 else GAP / 2)
                    for a, b in itertools.pairwise(layer)
                ]
                for item, y in zip(layer, nearest_with_gaps(wanted, weights, gaps)):
                    item.y = y
        self._straighten(left, right)
        top = min((item.y for layer in self._layers for item in layer), default=0.0)
        for item in self._items.values():
            item.y -= top
            if item.box >= 0:
                self.boxes[item.box].y = item.y

    def _straighten(self, left: dict, right: dict) -> None:
        """Moves boxes with a single link to its height, where there is room."""
        for layer in self._layers:
            for k, item in enumerate(layer):
                links = left[id(item)] + right[id(item)]
                if len(links) != 1 or item.box < 0:
                    continue
                ((p, other, q),) = links
                above = layer[k - 1].y + layer[k - 1].height + GAP if k else -math.inf
                below = layer[k + 1].y - item.height - GAP if k + 1 < len(layer) else math.inf
                if above <= other.y + q - p <= below:
                    item.y = other.y + q - p

    # ---- wires

    def _route(self) -> None:
        """Gives every wire its corners, in vertical tracks between the layers and, backward, in lanes below."""
        boxes = self.boxes
        bottoms = [max((i.y + i.height for i in layer), default=0.0) for layer in self._layers]
        backward = [
            (wire.source, boxes[wire.target[0]].layer, boxes[wire.source[0]].layer)
            for wire, forward in zip(self.wires, self._forward)
            if not forward
        ]
        lanes = lanes_below(bottoms, backward, LANE)
        # Channel c lies to the left of layer c; the last one to the right of everything.
        channels = [Channel() for _ in range(self._num_layers + 1)]
        for wire, forward in zip(self.wires, self._forward):
            for c, y_left, y_right in self._pieces(wire, forward, lanes):
                channels[c].add(wire.source, y_left, y_right)
        widths = [max((boxes[i.box].width for i in layer if i.box >= 0), default=0.0) for layer in self._layers]
        x, lefts = 0.0, []
        for c, channel in enumerate(channels):
            tracks = order_tracks(channel)
            used = LANE * max(tracks.values(), default=0)
            before = 0.0 if c == 0 else MARGIN
            after = 0.0 if c == self._num_layers else MARGIN
            channel.x = {net: x + before + LANE * track for net, track in tracks.items()}
            if tracks or (before and after):
                x += before + used + after
            if c < self._num_layers:
                lefts.append(x)
                x += widths[c]
        for box in boxes:
            box.x = lefts[box.layer] + (widths[box.layer] - box.width) / 2
        self._draw_wires(channels, lanes)
        self.width = x
        self.height = max([*bottoms, *lanes.values()], default=0.0)
        self.dots = [dot for channel in channels for dot in channel.branches()]

    def _ends(self, wire: Wire) -> tuple[float, float]:
        """Returns the heights of a wire's two ports."""
        (u, i), (v, j) = wire.source, wire.target
        return self.boxes[u].y + self.boxes[u].outputs[i], self.boxes[v].y + self.boxes[v].inputs[j]

    def _pieces(self, wire: Wire, forward: bool, lanes: dict) -> list[tuple[int, float | None, float | None]]:
        """Returns a wire's vertical pieces: channel and heights, those that come from the left and from the right.

        Backward, both ends of a piece lie on the same side: it comes as two, each with one end.
        """
        y_source, y_target = self._ends(wire)
        first, last = self.boxes[wire.source[0]].layer, self.boxes[wire.target[0]].layer
        if forward:
            heights = [self._passing[wire.source, layer].y for layer in range(first + 1, last)]
            steps = [y_source, *heights, y_target]
            return [(first + 1 + k, a, b) for k, (a, b) in enumerate(itertools.pairwise(steps))]
        lane = lanes[wire.source]
        return [(first + 1, y_source, None), (first + 1, lane, None), (last, None, lane), (last, None, y_target)]

    def _draw_wires(self, channels: list[Channel], lanes: dict) -> None:
        for wire, forward in zip(self.wires, self._forward):
            y_source, y_target = self._ends(wire)
            source, target = self.boxes[wire.source[0]], self.boxes[wire.target[0]]
            points = [(source.x + source.width, y_source)]
            if forward:
                for c, y_left, y_right in self._pieces(wire, True, lanes):
                    x = channels[c].x[wire.source]
                    points += [(x, y_left), (x, y_right)]  # type: ignore[list-item]
            else:
                out, back = channels[source.layer + 1].x[wire.source], channels[target.layer].x[wire.source]
                lane = lanes[wire.source]
                points += [(out, y_source), (out, lane), (back, lane), (back, y_target)]
            wire.points = simplified([*points, (target.x, y_target)])


def _mean(values: list[float], otherwise: float) -> float:
    return sum(values) / len(values) if values else otherwise


def _topological(ahead: list[set[int]], behind: list[set[int]]) -> list[int]:
    """Returns the vertices of a graph without cycles, each after all behind it."""
    missing = [len(b) for b in behind]
    ready = collections.deque(u for u, count in enumerate(missing) if count == 0)
    order = []
    while ready:
        u = ready.popleft()
        order.append(u)
        for v in ahead[u]:
            missing[v] -= 1
            if missing[v] == 0:
                ready.append(v)
    return order


def nearest_with_gaps(wanted: list[float], weights: list[float], gaps: list[float]) -> list[float]:
    """Returns y with y[k+1] >= y[k] + gaps[k] and the least weighted sum of squares of y - wanted.

    Without the gaps this is isotonic regression, by pooling adjacent violators (Ayer et al. 1955).
    """
    shifts = [0.0, *itertools.accumulate(gaps)]
    blocks: list[list[float]] = []  # mean, weight, count
    for value, weight, shift in zip(wanted, weights, shifts):
        blocks.append([value - shift, weight, 1])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            mean, w, count = blocks.pop()
            last = blocks[-1]
            last[0] = (last[0] * last[1] + mean * w) / (last[1] + w)
            last[1], last[2] = last[1] + w, last[2] + count
    flat = [mean for mean, _, count in blocks for _ in range(int(count))]
    return [y + shift for y, shift in zip(flat, shifts)]
