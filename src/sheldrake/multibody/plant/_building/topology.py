"""Which bodies are welded together, fixed to the world, or moved by a joint."""

from __future__ import annotations

from sheldrake.common._checked import checked
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.tree import BodyIndex, JointIndex, RigidBody


class Topology:
    """Questions about the graph of bodies and joints.

    Args:
        elements: Bodies and joints.
    """

    def __init__(self, elements: Elements) -> None:
        self._elements = elements
        self._kept: list[list[RigidBody]] | None = None  # once nothing changes any more
        self._group_of: dict[int, list[RigidBody]] = {}

    def welded_groups(self) -> list[list[RigidBody]]:
        """Bodies that are welded together, group by group, the world's first."""
        if not self._elements.is_finalized():
            return self._groups()
        if self._kept is None:
            self._kept = self._groups()
        return self._kept

    def _group(self, call: str, body: RigidBody) -> list[RigidBody]:
        self._elements.require_mine(call, body)
        groups, number = self.welded_groups(), int(body.index())
        if not self._group_of:
            of = {int(member.index()): group for group in groups for member in group}
            if groups is not self._kept:
                return of[number]
            self._group_of = of
        return self._group_of[number]

    def _groups(self) -> list[list[RigidBody]]:
        leader = {int(b.index()): int(b.index()) for b in self._elements.bodies}

        def find(i: int) -> int:
            while leader[i] != i:
                leader[i] = i = leader[leader[i]]
            return i

        for joint in self._elements.joints:
            if joint.type_name() == "weld":
                a, b = find(int(joint.parent_body().index())), find(int(joint.child_body().index()))
                leader[max(a, b)] = min(a, b)
        groups: dict[int, list[RigidBody]] = {}
        for body in self._elements.bodies:
            groups.setdefault(find(int(body.index())), []).append(body)
        return list(groups.values())

    @checked
    def GetBodiesWeldedTo(self, body: RigidBody) -> list[RigidBody]:
        """The bodies that move with a body because of welds, itself included."""
        return list(self._group("GetBodiesWeldedTo", body))

    @checked
    def IsAnchored(self, body: RigidBody) -> bool:
        """Whether a body is the world or welded to it."""
        return self._group("IsAnchored", body)[0] is self._elements.world

    @checked
    def GetBodiesKinematicallyAffectedBy(self, joint_indexes: list[JointIndex]) -> list[BodyIndex]:
        """The bodies that move when some of the joints do, in order of their numbers.

        Raises:
            RuntimeError: a joint has no velocities.
        """
        call = "GetBodiesKinematicallyAffectedBy"
        model = self._elements.model(call)
        joints = [self._elements.joints.get(i, call) for i in joint_indexes]
        for joint in joints:
            if joint.num_velocities() == 0:
                raise RuntimeError(f"{call}(): joint with index {int(joint.index())} is welded.")
        moved: set[int] = set()
        for step in model.steps:
            if step.joint in joints or int(step.parent.index()) in moved:
                moved.add(int(step.body.index()))
        return [BodyIndex(i) for i in sorted(moved)]

    def graphviz(self, title: str) -> str:
        """The bodies, grouped by model instance, and their joints, as a Graphviz string."""
        lines = ["digraph MultibodyPlant {", f'label="{title}";', "rankdir=BT;", "labelloc=t;"]
        for i, instance in enumerate(self._elements.instances):
            lines += [f"subgraph cluster{i} {{", f' label="{instance.name()}";']
            lines += [
                f' body{int(b.index())} [label="{b.name()}"];'
                for b in self._elements.bodies
                if int(b.model_instance()) == i
            ]
            lines.append("}")
        for joint in self._elements.joints:
            child, parent = int(joint.child_body().index()), int(joint.parent_body().index())
            lines.append(f'body{child} -> body{parent} [label="{joint.name()} [{joint.type_name()}]"];')
        return "\n".join([*lines, "}"]) + "\n"
