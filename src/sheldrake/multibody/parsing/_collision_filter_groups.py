"""Collision filter groups: what parsed files say, and its application to a scene graph."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ._files.diagnostics import DiagnosticPolicy
from ._model.description import FilterGroupDescription

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant


class CollisionFilterGroups:
    """Named groups of bodies and the pairs of groups whose bodies do not collide; all names are scoped names."""

    def __init__(self):
        self._groups: dict[str, set[str]] = {}
        self._pairs: set[tuple[str, str]] = set()

    def AddGroup(self, name: str, members: Iterable[str]) -> None:
        """Adds a group of bodies.

        Raises:
            RuntimeError: When the name is taken.
        """
        if name in self._groups:
            raise RuntimeError(f"CollisionFilterGroups.AddGroup(): group '{name}' is already defined.")
        self._groups[name] = set(members)

    def AddExclusionPair(self, pair: tuple[str, str]) -> None:
        """Adds a pair of groups whose bodies do not collide; a group paired with itself has no inner collisions."""
        first, second = pair
        self._pairs.add((min(first, second), max(first, second)))

    def empty(self) -> bool:
        """True when there are neither groups nor pairs."""
        return not self._groups and not self._pairs

    def groups(self) -> dict[str, set[str]]:
        """The members of every group."""
        return {name: set(members) for name, members in self._groups.items()}

    def exclusion_pairs(self) -> set[tuple[str, str]]:
        """The pairs, each in alphabetical order."""
        return set(self._pairs)

    def __str__(self) -> str:
        lines = ["", "Collision filter groups:"]
        for name, members in sorted(self._groups.items()):
            lines += [f"    {name}", *(f"        {member}" for member in sorted(members))]
        lines += ["Collision filter exclusion pairs:", *(f"    {a}, {b}" for a, b in sorted(self._pairs)), ""]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<CollisionFilterGroups with {len(self._groups)} groups and {len(self._pairs)} pairs>"


class FilterGroupCollector:
    """Collects the groups of one parse, resolves names at its end, and declares the filters.

    Groups and bodies are kept as (model instance, local name), so that reported names follow a renamed instance.
    """

    def __init__(self, plant: MultibodyPlant):
        self._plant = plant
        self._members: dict[tuple, set] = {}
        self._pairs: set[frozenset] = set()
        self._open: list[tuple[FilterGroupDescription, str]] = []
        self._open_bodies: list[tuple] = []

    def add(self, group: FilterGroupDescription, namespace: str, policy: DiagnosticPolicy) -> None:
        """Adds a group whose names are relative to the model (or namespace) of that full name.

        Raises:
            ParseError: When the group is malformed or one of its bodies does not exist.
        """
        full_name = _join(namespace, group.name)
        if "::" in group.name:
            policy.Error(group, f"The name of collision filter group '{full_name}' must not be a scoped name.")
        if not group.members and not group.member_groups:
            policy.Error(group, f"Collision filter group '{full_name}' has no members.")
        key = self._split(full_name)
        if key in self._members:
            policy.Error(group, f"Collision filter group '{full_name}' is already defined.")
        self._members[key] = {self._find_body(member, namespace, group, policy) for member in group.members}
        self._open.append((group, namespace))

    def exclude_bodies(self, one, other) -> None:
        """Excludes collisions between two bodies; takes effect in `finish`."""
        self._open_bodies.append((one, other))

    def finish(self, scene_graph, policy: DiagnosticPolicy) -> None:
        """Resolves references between groups and excludes collisions of everything added since the last call.

        Raises:
            ParseError: When a group is named that nobody defined.
        """
        opened, self._open = self._open, []
        self._unite_member_groups(opened, policy)
        new_pairs = []
        for group, namespace in opened:
            this = self._split(_join(namespace, group.name))
            for ignored in group.ignored:
                pair = frozenset((this, self._find_group(ignored, namespace, group, policy)))
                if pair not in self._pairs:
                    self._pairs.add(pair)
                    new_pairs.append(pair)
        if scene_graph is not None:
            for pair in new_pairs:
                self._exclude([self._geometries(key) for key in pair], scene_graph)
            for bodies in self._open_bodies:
                self._exclude([self._plant.CollectRegisteredGeometries([body]) for body in bodies], scene_graph)
        self._open_bodies = []

    def _unite_member_groups(self, opened, policy) -> None:
        """Adds the members of member groups until nothing changes (groups may name each other in circles)."""
        edges = [
            (self._split(_join(namespace, group.name)), self._find_group(member, namespace, group, policy))
            for group, namespace in opened
            for member in group.member_groups
        ]
        changed = True
        while changed:
            changed = False
            for group, member in edges:
                missing = self._members[member] - self._members[group]
                self._members[group] |= missing
                changed |= bool(missing)

    def report(self) -> CollisionFilterGroups:
        """All groups and pairs so far, under today's model instance names."""
        result = CollisionFilterGroups()
        for key, members in self._members.items():
            result.AddGroup(self._full_name(key), {self._full_name(member) for member in members})
        for pair in self._pairs:
            keys = list(pair)
            result.AddExclusionPair((self._full_name(keys[0]), self._full_name(keys[-1])))
        return result

    def _split(self, full_name: str) -> tuple:
        """(model instance or None, local name); a namespace that is no model instance stays in the local name."""
        scope, separator, local = full_name.rpartition("::")
        if separator and self._plant.HasModelInstanceNamed(scope):
            return self._plant.GetModelInstanceByName(scope), local
        return None, full_name

    def _full_name(self, key: tuple) -> str:
        instance, local = key
        return local if instance is None else _join(self._plant.GetModelInstanceName(instance), local)

    def _find_body(self, name: str, namespace: str, group, policy) -> tuple:
        full_name = _join(namespace, name)
        instance, local = self._split(full_name)
        if instance is None or not self._plant.HasBodyNamed(local, instance):
            known = ""
            if instance is not None:
                bodies = [self._plant.get_body(index).name() for index in self._plant.GetBodyIndices(instance)]
                known = f"; the model has {', '.join(bodies[:20])}"
            policy.Error(group, f"Collision filter group '{group.name}': there is no body '{full_name}'{known}.")
        return instance, local

    def _find_group(self, name: str, namespace: str, group, policy) -> tuple:
        key = self._split(_join(namespace, name))
        if key not in self._members:
            known = ", ".join(sorted(self._full_name(other) for other in self._members))
            wanted = _join(namespace, name)
            policy.Error(group, f"Collision filter group '{wanted}' is not defined; the defined groups are {known}.")
        return key

    def _exclude(self, sets: list, scene_graph) -> None:
        """Excludes collisions within one set of geometries, or between two."""
        from sheldrake.geometry import CollisionFilterDeclaration

        declaration = CollisionFilterDeclaration()
        if len(sets) == 1:
            declaration.ExcludeWithin(sets[0])
        else:
            declaration.ExcludeBetween(sets[0], sets[1])
        scene_graph.collision_filter_manager().Apply(declaration)

    def _geometries(self, key: tuple):
        bodies = [self._plant.GetBodyByName(local, instance) for instance, local in sorted(self._members[key])]
        return self._plant.CollectRegisteredGeometries(bodies)


def _join(scope: str, name: str) -> str:
    return f"{scope}::{name}" if scope else name
