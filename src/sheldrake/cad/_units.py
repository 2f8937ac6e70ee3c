"""Which unit of length a mesh file means: a belief with its reasons, never a silent guess.

Files rarely say. What speaks for a unit: a statement in the file, the habits of its format and of the program that
wrote it, the size the part would have, the density it would have if the mass is known, and whether its lengths are the
round numbers that people design with. Each is a likelihood; Bayes' rule makes one belief of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ._solids import MeshFile

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
_WORDS = {"mm": "millimetres", "cm": "centimetres", "m": "metres", "in": "inches"}
SURE = 0.85  # belief from which no question is asked

# Units people export in, by format: CAD writes STL in millimetres; OBJ is as often modelled in metres.
_HABITS = {
    ".stl": {"mm": 0.70, "cm": 0.04, "m": 0.14, "in": 0.12},
    ".obj": {"mm": 0.52, "cm": 0.06, "m": 0.32, "in": 0.10},
    ".ply": {"mm": 0.45, "cm": 0.05, "m": 0.45, "in": 0.05},
    ".dae": {"mm": 0.20, "cm": 0.08, "m": 0.67, "in": 0.05},
    ".gltf": {"mm": 0.15, "cm": 0.05, "m": 0.77, "in": 0.03},
    ".glb": {"mm": 0.15, "cm": 0.05, "m": 0.77, "in": 0.03},
    ".3mf": {"mm": 0.90, "cm": 0.02, "m": 0.03, "in": 0.05},
}
# Programs that write one unit, or nearly always do: name in the header, unit, how many times likelier that makes it.
_PROGRAMS = [
    ("OpenSCAD", "mm", 20.0),
    ("FreeCAD", "mm", 20.0),
    ("Open CASCADE", "mm", 10.0),
    ("SolidWorks", "mm", 3.0),
    ("Autodesk ATF", "mm", 3.0),
    ("Onshape", "mm", 2.0),
    ("Blender", "m", 3.0),
]
_USUAL_SIZE = 0.12  # [m] largest side of a part of a robot, median
_SIZE_SPREAD = math.log(4.0)
_USUAL_DENSITY = 1900.0  # [kg/m^3] between plastics and steel
_DENSITY_SPREAD = math.log(2.2)
_STATED = 100.0  # how many times likelier a stated unit is
_DEFAULTED = 20.0  # the same for the unit that the format prescribes while the file is silent
_ROUND, _ROUND_BY_CHANCE = 0.6, 0.03  # share of a part's lengths that are round in the unit it was drawn in, or not


class Reason(NamedTuple):
    """Something that speaks for or against units.

    Attributes:
        text: For people.
        weights: Likelihood by unit, up to a common factor.
    """

    text: str
    weights: dict[str, float]


@dataclass
class UnitBelief:
    """The unit a file is taken to be in.

    Attributes:
        unit: "mm", "cm", "m" or "in".
        confidence: Probability that this is so; 1 when the caller said it.
        probabilities: By unit.
        reasons: Texts, the weightiest first.
        size: Extents of the file's content, in its own numbers, shape (3,).
    """

    unit: str
    confidence: float
    probabilities: dict[str, float]
    reasons: list[str]
    size: np.ndarray

    @property
    def metres(self) -> float:
        """Metres per unit."""
        return METRES[self.unit]

    @property
    def is_sure(self) -> bool:
        """Whether one may go on without asking."""
        return self.confidence >= SURE

    def Describe(self) -> str:
        """One line: unit, confidence, size of the part and why."""
        sure = "" if self.confidence == 1.0 else f" ({_percent(self.confidence)} sure)"
        return f"{_WORDS[self.unit]}{sure}, so the part is {self._size_in(self.unit)}: " + "; ".join(self.reasons)

    def Question(self, name: str) -> str:
        """What to ask somebody who knows the part."""
        ranked = sorted(self.probabilities, key=lambda unit: -self.probabilities[unit])
        choices = "\n".join(
            f"  --units {unit:<2}  the part is {self._size_in(unit)} ({_percent(self.probabilities[unit])})"
            for unit in ranked
            if self.probabilities[unit] > 0.005
        )
        return f"Which unit is '{name}' in? The file does not settle it:\n{choices}"

    def _size_in(self, unit: str) -> str:
        return size_text(self.size * METRES[unit])


def size_text(size: np.ndarray) -> str:
    """Extents [m] for people."""
    largest = float(np.max(size))
    factor, unit = (1e6, "µm") if largest < 1e-3 else (1e3, "mm") if largest < 1.0 else (1.0, "m")
    return " x ".join(f"{value * factor:.4g}" for value in size) + f" {unit}"


def _percent(probability: float) -> str:
    if 0.9995 <= probability < 1.0:
        return "over 99.9 %"
    return f"{100.0 * probability:.1f} %" if 0.99 <= probability < 0.9995 else f"{100.0 * probability:.0f} %"


def stated_units(unit: str, size: np.ndarray) -> UnitBelief:
    """The belief of one who was told.

    Raises:
        ValueError: No such unit.
    """
    if unit not in METRES:
        raise ValueError(f"There is no unit '{unit}'; known are auto, {', '.join(METRES)}.")
    return UnitBelief(unit, 1.0, {unit: 1.0}, ["as you said"], np.asarray(size))


def guess_units(mesh: MeshFile, volume: float = 0.0, mass: float | None = None) -> UnitBelief:
    """The unit that a file most probably is in.

    Args:
        mesh: The file.
        volume: Of its solids, in the file's numbers; 0 when it is not known.
        mass: Of all of it [kg], when it is known.
    """
    points = np.concatenate([solid.vertices[np.unique(solid.triangles)] for solid in mesh.solids])
    size = np.ptp(points, axis=0)
    reasons = [Reason(f"{mesh.path.suffix} files usually are", _HABITS[mesh.path.suffix.lower()])]
    reasons += [r for r in (_by_statement(mesh), _by_program(mesh), _by_size(size)) if r is not None]
    if mass is not None and volume > 0.0:
        reasons.append(_by_density(volume, mass))
    roundness = _by_round_numbers(mesh)
    if roundness is not None:
        reasons.append(roundness)
    logs = {unit: sum(math.log(max(r.weights[unit], 1e-30)) for r in reasons) for unit in METRES}
    top = max(logs.values())
    weights = {unit: math.exp(value - top) for unit, value in logs.items()}
    total = sum(weights.values())
    probabilities = {unit: weight / total for unit, weight in weights.items()}
    best = max(probabilities, key=lambda unit: probabilities[unit])
    confidence = probabilities[best]
    texts = _tell(reasons, best)
    if mesh.declared is not None and not math.isclose(mesh.declared, METRES[best], rel_tol=1e-6):
        confidence = min(confidence, 0.5)  # the file says otherwise: somebody must look
        texts.insert(0, f"but the file says otherwise ({mesh.declared_by})")
    return UnitBelief(best, confidence, probabilities, texts, size)


def _tell(reasons: list[Reason], best: str) -> list[str]:
    """Texts of the reasons that speak for the unit, the weightiest first."""

    def weight(reason: Reason) -> float:
        others = [w for unit, w in reason.weights.items() if unit != best]
        return reason.weights[best] / max(max(others), 1e-30)

    for_it = sorted((r for r in reasons if weight(r) > 1.0), key=weight, reverse=True)
    against = [r for r in reasons if weight(r) < 0.5]
    return [r.text.format(unit=_WORDS[best]) for r in for_it] + [
        "against it: " + r.text.format(unit=_WORDS[max(r.weights, key=lambda u: r.weights[u])]) for r in against
    ]


def _by_statement(mesh: MeshFile) -> Reason | None:
    if mesh.declared is None:
        return None
    strength = _DEFAULTED if mesh.is_default else _STATED
    weights = {unit: strength if math.isclose(f, mesh.declared, rel_tol=1e-6) else 1.0 for unit, f in METRES.items()}
    return Reason(f"the file says so ({mesh.declared_by})" if not mesh.is_default else mesh.declared_by, weights)


def _by_program(mesh: MeshFile) -> Reason | None:
    header = mesh.header.lower()
    for name, unit, strength in _PROGRAMS:
        if name.lower() in header:
            return Reason(f"{name} mostly writes {_WORDS[unit]}", {u: strength if u == unit else 1.0 for u in METRES})
    return None


def _heavy_tailed(value: float, usual: float, spread: float) -> float:
    """Student's t with five degrees of freedom of a ratio's logarithm: outliers are rare, not impossible."""
    z = math.log(value / usual) / spread
    return (1.0 + z * z / 5.0) ** -3.0


def _by_size(size: np.ndarray) -> Reason | None:
    largest = float(np.max(size))
    if largest <= 0.0:
        return None
    weights = {unit: _heavy_tailed(largest * f, _USUAL_SIZE, _SIZE_SPREAD) for unit, f in METRES.items()}
    return Reason(f"{largest:.4g} {{unit}} is a size that parts have", weights)


def _by_density(volume: float, mass: float) -> Reason:
    weights = {u: _heavy_tailed(mass / (volume * f**3), _USUAL_DENSITY, _DENSITY_SPREAD) for u, f in METRES.items()}
    best = max(weights, key=lambda unit: weights[unit])
    density = mass / (volume * METRES[best] ** 3)
    return Reason(f"{mass:g} kg then is {density:.0f} kg/m^3", weights)


def _by_round_numbers(mesh: MeshFile) -> Reason | None:
    """Compares metric units with inches: lengths that are round after a factor of 25.4 tell which the file has.

    A drawing in millimetres exported in inches has lengths that are round only when taken as inches and turned into
    millimetres; metric units among themselves can not be told apart so.
    """
    lengths = _lengths(mesh)
    if not len(lengths):
        return None
    as_metric = [_is_round(x) or _is_inch_fraction(x / 25.4) for x in lengths]
    as_inches = [_is_round(x * 25.4) or _is_inch_fraction(x) for x in lengths]
    ratio = 1.0
    for metric, inches in zip(as_metric, as_inches):
        if metric != inches:
            ratio *= _ROUND / _ROUND_BY_CHANCE if inches else _ROUND_BY_CHANCE / _ROUND
    ratio = min(max(ratio, 1.0 / 200.0), 200.0)  # lengths of one part repeat each other
    if ratio == 1.0:
        return None
    weights = {unit: ratio if unit == "in" else 1.0 for unit in METRES}
    if ratio > 1.0:
        weights = {unit: weight / ratio for unit, weight in weights.items()}
    return Reason("its lengths are round numbers in inches" if ratio > 1.0 else "its lengths are round metric numbers",
                  weights)  # fmt: skip


def _lengths(mesh: MeshFile) -> np.ndarray:
    """Extents along the axes and distances of the planes with most vertices from the lowest one, different ones."""
    found: list[float] = []
    for solid in mesh.solids[:20]:
        points = solid.vertices[np.unique(solid.triangles)]
        for axis in range(3):
            values, counts = np.unique(points[:, axis], return_counts=True)
            planes = values[np.sort(np.argsort(-counts, kind="stable")[:4])]
            found += [values[-1] - values[0], *(planes - values[0])]
    lengths = np.array([x for x in found if x > 0.0])
    kept: list[float] = []
    for length in sorted(lengths.tolist()):
        if not kept or length > kept[-1] * (1.0 + 1e-5):
            kept.append(length)
    return np.array(kept[-12:])


_PRECISION = 2e-6  # relative: a little more than single precision, and six decimals


def _is_round(x: float) -> bool:
    """Whether three decimal digits say the number."""
    step = 10.0 ** (math.floor(math.log10(x)) - 2)
    return abs(x / step - round(x / step)) * step <= _PRECISION * x


def _is_inch_fraction(x: float) -> bool:
    """Whether a number of inches is a small count of sixteenths, or of 32nds."""
    return x * 32.0 < 512.0 and abs(x * 32.0 - round(x * 32.0)) <= _PRECISION * x * 32.0 and round(x * 32.0) > 0
