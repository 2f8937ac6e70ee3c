"""What an FMU says of itself: its variables with their units, as modelDescription.xml of FMI 2.0 and 3.0."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from sheldrake import __version__

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_BASE_UNITS = {
    "1": {},
    "rad": {"rad": 1},
    "m": {"m": 1},
    "s": {"s": 1},
    "kg": {"kg": 1},
    "A": {"A": 1},
    "K": {"K": 1},
    "m/s": {"m": 1, "s": -1},
    "rad/s": {"rad": 1, "s": -1},
    "m/s²": {"m": 1, "s": -2},
    "m/s^2": {"m": 1, "s": -2},
    "rad/s²": {"rad": 1, "s": -2},
    "rad/s^2": {"rad": 1, "s": -2},
    "m^2": {"m": 2},
    "kg m^2": {"kg": 1, "m": 2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "N·m": {"kg": 1, "m": 2, "s": -2},
    "Nm": {"kg": 1, "m": 2, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Hz": {"s": -1},
}
"""What units are in those of the international system; others are named without."""


class Variable(NamedTuple):
    """A variable of an FMU.

    Attributes:
        name: By port and element.
        kind: One letter: t time, i input, o output, p parameter, s state.
        at: Where it is in the slab.
        unit: "" when it is not known.
        start: What it begins with; outputs are computed.
        continuous: Whether it may change at any time, or at events alone.
    """

    name: str
    kind: str
    at: int
    unit: str
    start: float
    continuous: bool
    about: str


def variables_of(about: dict[str, Any], slab: np.ndarray) -> list[Variable]:
    """All variables of a frozen diagram; the number of a variable is its value reference.

    Args:
        about: Its description.
        slab: With what it begins.
    """
    found = [Variable("time", "t", 0, "s", float(slab[0]), True, "simulated time")]
    taken = {"time"}
    for kind in ("inputs", "outputs", "parameters", "states"):
        for vector in about[kind]:
            base = _plain(f"{vector['name']}/x" if kind == "states" else vector["name"])
            for k, (element, unit) in enumerate(zip(vector["elements"], vector["units"])):
                generic = re.fullmatch(r"[xyup]\d+", element)
                title = f"{base}[{k}]" if generic else f"{base}.{_plain(element)}"
                while title in taken:
                    title += "'"
                taken.add(title)
                continuous = kind in ("inputs", "outputs") or vector.get("kind") == "continuous"
                text = f"element {k} of {vector['name']} ({kind.removesuffix('s')})"
                at = vector["at"] + k
                found.append(Variable(title, kind[0], at, _plain(unit), float(slab[at]), continuous, _plain(text)))
    return found


def _plain(text: str) -> str:
    """Text that XML can have, on one line."""
    return re.sub(r"[^ -~\u00a0-\ud7ff\ue000-\ufffd]", " ", text)


def model_description(
    variables: list[Variable], name: str, identifier: str, token: str, version: str, begin: float, step: float | None
) -> str:
    """modelDescription.xml.

    Args:
        variables: In the order of their value references.
        name: Of the model.
        identifier: Of its library.
        token: That the library knows.
        version: Of FMI, "2.0" or "3.0".
        begin: Where it begins [s].
        step: Between communication points, as a proposal [s].
    """
    two = version == "2.0"
    root = ElementTree.Element("fmiModelDescription", fmiVersion=version, modelName=_plain(name))
    root.set("guid" if two else "instantiationToken", token)
    root.set("generationTool", f"sheldrake {__version__}")
    root.set("variableNamingConvention", "flat")
    state = "FMUstate" if two else "FMUState"
    abilities = {"canHandleVariableCommunicationStepSize": "true"}
    abilities.update({f"canGetAndSet{state}": "true", f"canSerialize{state}": "true"})
    if two:
        abilities["canNotUseMemoryManagementFunctions"] = "true"
    ElementTree.SubElement(root, "CoSimulation", {"modelIdentifier": identifier, **abilities})
    _add_units(root, variables)
    experiment = {"startTime": _number(begin), **({} if step is None else {"stepSize": _number(step)})}
    ElementTree.SubElement(root, "DefaultExperiment", experiment)
    group = ElementTree.SubElement(root, "ModelVariables")
    for k, variable in enumerate(variables):
        (_add_variable2 if two else _add_variable3)(group, k, variable)
    _add_structure(root, variables, two)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_units(root: Element, variables: list[Variable]) -> None:
    group = ElementTree.SubElement(root, "UnitDefinitions")
    for unit in sorted({v.unit for v in variables if v.unit}):
        added = ElementTree.SubElement(group, "Unit", name=unit)
        if unit in _BASE_UNITS:
            ElementTree.SubElement(added, "BaseUnit", {k: str(n) for k, n in _BASE_UNITS[unit].items()})


def _role(variable: Variable) -> dict[str, str]:
    """How others may use a variable."""
    role = {
        "t": {"causality": "independent"},
        "i": {"causality": "input"},
        "o": {"causality": "output", "initial": "calculated"},
        "p": {"causality": "parameter", "initial": "exact"},
        "s": {"causality": "local", "initial": "exact"},
    }[variable.kind]
    changes = "tunable" if variable.kind == "p" else "continuous" if variable.continuous else "discrete"
    return {**role, "variability": changes}


def _value(variable: Variable) -> dict[str, str]:
    """Its unit, and its start if it has one."""
    unit = {"unit": variable.unit} if variable.unit else {}
    return {**unit, **({"start": _number(variable.start)} if variable.kind in "ips" else {})}


def _add_variable2(group: Element, reference: int, variable: Variable) -> None:
    head = {"name": variable.name, "valueReference": str(reference), "description": variable.about}
    added = ElementTree.SubElement(group, "ScalarVariable", {**head, **_role(variable)})
    ElementTree.SubElement(added, "Real", _value(variable))


def _add_variable3(group: Element, reference: int, variable: Variable) -> None:
    head = {"name": variable.name, "valueReference": str(reference), "description": variable.about}
    ElementTree.SubElement(group, "Float64", {**head, **_role(variable), **_value(variable)})


def _add_structure(root: Element, variables: list[Variable], two: bool) -> None:
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = [k for k, v in enumerate(variables) if v.kind == "o"]
    if not two:
        for title in ("Output", "InitialUnknown"):
            for k in outputs:
                ElementTree.SubElement(structure, title, valueReference=str(k))
        return
    for title in ("Outputs", "InitialUnknowns") if outputs else ():
        group = ElementTree.SubElement(structure, title)
        for k in outputs:
            ElementTree.SubElement(group, "Unknown", index=str(k + 1))


def _number(value: float) -> str:
    """As XML has numbers, to the last bit."""
    if math.isfinite(value):
        return repr(float(value))
    return "NaN" if math.isnan(value) else "INF" if value > 0 else "-INF"
