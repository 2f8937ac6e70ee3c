"""Faults of a URDF that show in its text: names, references, limits, missing files. All of them, not the first."""

from __future__ import annotations

import difflib
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._findings import Finding
from ._xml_edit import XmlSource

if TYPE_CHECKING:
    from sheldrake.multibody.parsing._files.xml import Element

_LIMITED = ("revolute", "prismatic")
_DEGREES = 4.0 * math.pi  # [rad] limits beyond this are meant in degrees


class UrdfText:
    """Looks through the elements of a URDF.

    Args:
        source: The file.
        path: Where it is.
        resolve: Gives the path of a file name in it, or raises RuntimeError.
    """

    def __init__(self, source: XmlSource, path: Path, resolve: Any):
        self._source, self._path, self._resolve = source, path, resolve
        self.findings: list[Finding] = []

    def check(self) -> list[Finding]:
        """All findings."""
        root = self._source.root
        self._names(root)
        self._references(root)
        for joint in root.find_all("joint", "drake:joint"):
            self._limits(joint)
            self._axis(joint)
        self._meshes(root)
        return self.findings

    def add(
        self, severity: str, code: str, subject: str, message: str, element: Element, fix: str = "", edits=()
    ) -> None:
        """Reports a finding at an element."""
        where = element.where
        self.findings.append(
            Finding(severity, code, subject, message, where.source, where.line, where.column, fix, list(edits))
        )

    def _names(self, root: Element) -> None:
        for what, tags in (("link", ("link",)), ("joint", ("joint", "drake:joint"))):
            seen: dict[str, Any] = {}
            taken = {e.get("name") for e in root.find_all(*tags)}
            for element in root.find_all(*tags):
                name = element.get("name")
                if not (name or "").strip():
                    self.add("error", "name-missing", what, f"a <{element.tag}> has no name", element)
                    continue
                if name in seen:
                    message = f"{what} '{name}' is there twice; the first is on line {seen[name].line}"
                    if what == "joint":  # nothing refers to the second one
                        other = next(f"{name}_{i}" for i in range(2, 10**6) if f"{name}_{i}" not in taken)
                        taken.add(other)
                        edit = self._source.set_attribute(element, "name", other)
                        self.add("error", "name-twice", name, message, element, f"call it '{other}'", [edit])
                    else:
                        self.add("error", "name-twice", name, message, element, "give one of them another name")
                    continue
                seen[name] = element
                if name != name.strip() or any(c in name for c in " \t\n/") or "::" in name:
                    self.add(
                        "note", "name-odd", name, f"the name '{name}' has blanks or signs other programs stumble over",
                        element,
                    )  # fmt: skip

    def _references(self, root: Element) -> None:
        links = [e.get("name") for e in root.find_all("link") if e.get("name")]
        known = {*links, "world"}
        children: dict[str, Any] = {}
        for joint in root.find_all("joint", "drake:joint"):
            name = joint.get("name") or "?"
            for role in ("parent", "child"):
                end = joint.find(role)
                link = None if end is None else end.get("link")
                if end is None or link is None:
                    self.add("error", "link-missing", name, f"joint '{name}' has no {role} link", joint)
                elif link not in known:
                    self._unknown(end, "link", link, sorted(known), f"the {role} of joint '{name}'")
                elif role == "child" and link in children:
                    self.add(
                        "error", "two-parents", link,
                        f"link '{link}' is the child of joint '{name}' and of '{children[link].get('name')}'; links "
                        "make a tree", joint, "cut the loop, and close it with a <drake:ball_constraint>",
                    )  # fmt: skip
                elif role == "child":
                    children[link] = joint
            mimic = joint.find("mimic")
            joints = [j.get("name") for j in root.find_all("joint", "drake:joint")]
            if mimic is not None and mimic.get("joint") not in joints:
                self._unknown(mimic, "joint", mimic.get("joint") or "", joints, f"the <mimic> of joint '{name}'")
        roots = [e for e in root.find_all("link") if e.get("name") not in children and e.get("name") != "world"]
        if len(roots) > 1:
            names = ", ".join(f"'{e.get('name')}'" for e in roots[:6])
            self.add(
                "warning", "several-roots", names, f"{len(roots)} links have no parent ({names}): each is a free body",
                roots[1], "join them with fixed joints, if they are one robot",
            )  # fmt: skip

    def _unknown(self, element: Element, attribute: str, name: str, known: list, what: str) -> None:
        close = difflib.get_close_matches(name, [k for k in known if k], 1, 0.8)
        fix = f"'{close[0]}' may be meant" if close else ""
        edits = [self._source.set_attribute(element, attribute, close[0])] if close else []
        self.add("error", "name-unknown", name, f"{what} is '{name}', which does not exist", element, fix, edits)

    def _limits(self, joint: Element) -> None:
        kind, name = joint.get("type"), joint.get("name") or "?"
        if kind not in _LIMITED:
            return
        limit = joint.find("limit")
        if limit is None:
            self.add(
                "warning", "limits-absent", name, f"{kind} joint '{name}' has no <limit>: it moves without end", joint,
                "add a <limit> with all four numbers" + (", or make it continuous" if kind == "revolute" else ""),
            )  # fmt: skip
            return
        numbers = {key: _number(limit.get(key)) for key in ("lower", "upper", "effort", "velocity")}
        lower, upper = numbers["lower"], numbers["upper"]
        for key, value in numbers.items():
            if limit.get(key) is not None and value is None:
                self.add("error", "number-wrong", name, f"{key} of joint '{name}' is '{limit.get(key)}'", limit)
        if limit.get("lower") is None and limit.get("upper") is None:
            self.add(
                "warning", "limits-absent", name, f"the <limit> of {kind} joint '{name}' has neither lower nor upper: "
                "it moves without end", limit, "add lower and upper",
            )  # fmt: skip
        elif lower is not None and upper is not None:
            self._range(joint, limit, kind, name, lower, upper)
        for key in ("effort", "velocity"):
            if numbers[key] == 0.0:
                self.add(
                    "warning", f"{key}-zero", name, f"joint '{name}' has an {key} limit of 0: it can not be driven",
                    limit, f"say what {key} it has",
                )  # fmt: skip
            elif (numbers[key] or 0.0) < 0.0:
                edit = self._source.set_attribute(limit, key, repr(-numbers[key]))  # type: ignore[operator]
                self.add("error", f"{key}-negative", name, f"the {key} limit of joint '{name}' is negative", limit,
                         "drop the sign", [edit])  # fmt: skip

    def _range(self, joint: Element, limit: Element, kind: str, name: str, lower: float, upper: float) -> None:
        unit = "rad" if kind == "revolute" else "m"
        if lower > upper:
            edits = [
                self._source.set_attribute(limit, "lower", limit.get("upper")),
                self._source.set_attribute(limit, "upper", limit.get("lower")),
            ]
            self.add(
                "error", "limits-reversed", name, f"joint '{name}' has its lower limit {lower:g} {unit} above the "
                f"upper {upper:g} {unit}", limit, "exchange them", edits,
            )  # fmt: skip
        elif lower == upper:
            self.add(
                "warning", "limits-equal", name, f"joint '{name}' has both limits at {lower:g} {unit}: it can not move",
                limit, "give it a range, or make it fixed",
            )  # fmt: skip
        if kind == "revolute" and math.isfinite(lower) and math.isfinite(upper) and max(-lower, upper) > _DEGREES:
            edits = [self._source.set_attribute(limit, k, repr(math.radians(v)))
                     for k, v in (("lower", min(lower, upper)), ("upper", max(lower, upper)))]  # fmt: skip
            self.add(
                "warning", "limits-in-degrees", name, f"the limits of joint '{name}', {lower:g} and {upper:g} rad, are "
                "more than two turns: they may be degrees", limit, "turn them into radians", edits,
            )  # fmt: skip
        elif kind == "prismatic" and math.isfinite(upper - lower) and abs(upper - lower) > 100.0:
            self.add(
                "warning", "limits-in-millimetres", name, f"prismatic joint '{name}' travels {upper - lower:g} m: "
                "that may be millimetres", limit, "turn its limits into metres",
            )  # fmt: skip

    def _axis(self, joint: Element) -> None:
        axis = joint.find("axis")
        if axis is None or joint.get("type") in ("fixed", "floating"):
            return
        words = (axis.get("xyz") or "1 0 0").split()
        numbers = [x for x in map(_number, words) if x is not None]
        name = joint.get("name") or "?"
        if len(words) != 3 or len(numbers) != 3:
            self.add("error", "number-wrong", name, f"the axis of joint '{name}' is '{axis.get('xyz')}'", axis)
            return
        length = math.sqrt(sum(x * x for x in numbers))
        if length == 0.0:
            self.add("error", "axis-zero", name, f"the axis of joint '{name}' has no direction", axis)
        elif abs(length - 1.0) > 1e-3:
            self.add("note", "axis-length", name, f"the axis of joint '{name}' has length {length:.4g}; it is taken "
                     "as a direction", axis)  # fmt: skip

    def _meshes(self, root: Element) -> None:
        for link in root.find_all("link"):
            for role in link.find_all("visual", "collision"):
                meshes = [m for geometry in role.find_all("geometry") for m in geometry.find_all("mesh")]
                mesh = meshes[0] if meshes else None
                if mesh is None or not mesh.get("filename"):
                    continue
                name = mesh.get("filename")
                try:
                    self._resolve(name, mesh.where)
                except RuntimeError as error:
                    self._missing(link.get("name") or "?", role, mesh, name, str(error))

    def _missing(self, link: str, role: Element, mesh: Element, name: str, why: str) -> None:
        found = _look_for(self._path.resolve().parent, name)
        edits, fix = [self._source.replace(role, "")], f"remove this <{role.tag}>"
        if found is not None:
            is_same = Path(found).stem.lower() == Path(name.partition("://")[2] or name).stem.lower()
            fix = f"'{found}' is there" if is_same else f"did you mean '{found}'?"
            edits = [self._source.set_attribute(mesh, "filename", found)]
        message = f"the mesh '{name}' of link '{link}' is missing ({why.partition('error: ')[2] or why})"
        self.add("error", "mesh-missing", link, message, mesh, fix, edits)


def _number(text: str | None) -> float | None:
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


_MESHES = (".obj", ".stl", ".dae", ".gltf", ".glb", ".ply", ".vtk")
_LIKE = 0.8  # names less alike are not taken for each other
_LOOKED_AT = 5000  # files; a home folder is not searched to its end


def _look_for(folder: Path, name: str) -> str | None:
    """The relative name of a file below the model's folder that may be the one meant: of the same stem or nearly."""
    wanted = Path(name.partition("://")[2] or name).name.lower()
    stem, suffix = os.path.splitext(wanted)
    best, rank = None, 0.0
    count = 0
    for place, folders, files in os.walk(folder):
        folders.sort()
        for file in sorted(files):
            count += 1
            other, other_suffix = os.path.splitext(file.lower())
            likeness = difflib.SequenceMatcher(None, stem, other).ratio() if other_suffix in _MESHES else 0.0
            if likeness >= _LIKE:
                score = 2.0 * (likeness == 1.0) + (other_suffix == suffix) + likeness
                if score > rank:
                    best, rank = Path(place, file), score
        if count > _LOOKED_AT:
            break
    return None if best is None else best.relative_to(folder).as_posix()
