"""Which bodies are welded together, fixed to the world, or moved by a joint."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from sheldrake.multibody.tree import BodyIndex, JointIndex, RigidBody


class Topology:
    """Questions about the graph of bodies and joints."""

    _picture: ClassVar[Callable[[Any], str] | None] = None
    """Draws a finalized plant's bodies and joints as SVG; sheldrake.visualization, above this floor, sets it."""

    def _repr_svg_(self) -> str | None:
        """A picture for notebooks, once the plant is finalized and sheldrake.visualization imported."""
        draw = Topology._picture
        return draw(self) if draw is not None and self.is_finalized() else None

    def _welded_groups(self) -> list[list[RigidBody]]:
        """Bodies that are welded together, group by group, the world's first."""
        leader = {int(b.index()): int(b.index()) for b in self._bodies}

        def find(i: int) -> int:
            while leader[i] != i:
                leader[i] = i = leader[leader[i]]
            return i

        for joint in self._joints:
            if joint.type_name() == "weld":
                a, b = find(int(joint.parent_body().index())), find(int(joint.child_body().index()))
                leader[max(a, b)] = min(a, b)
        groups: dict[int, list[RigidBody]] = {}
        for body in self._bodies:
            groups.setdefault(find(int(body.index())), []).append(body)
        return list(groups.values())

    def GetBodiesWeldedTo(self, body: RigidBody) -> list[RigidBody]:
        """The bodies that move with a body because of welds, itself included."""
        self._require_mine("GetBodiesWeldedTo", body)
        return next(list(g) for g in self._welded_groups() if body in g)

    def IsAnchored(self, body: RigidBody) -> bool:
        """Whether a body is the world or welded to it."""
        self._require_mine("IsAnchored", body)
        return body in self._welded_groups()[0]

    def GetBodiesKinematicallyAffectedBy(self, joint_indexes: list[JointIndex]) -> list[BodyIndex]:
        """The bodies that move when some of the joints do, in order of their numbers.

        Raises:
            RuntimeError: a joint has no velocities.
        """
        self._require_finalized("GetBodiesKinematicallyAffectedBy")
        joints = [self.get_joint(i) for i in joint_indexes]
        for joint in joints:
            if joint.num_velocities() == 0:
                raise RuntimeError(
                    f"GetBodiesKinematicallyAffectedBy(): joint with index {int(joint.index())} is welded."
                )
        moved: set[int] = set()
        for step in self._steps:
            if step.joint in joints or int(step.parent.index()) in moved:
                moved.add(int(step.body.index()))
        return [BodyIndex(i) for i in sorted(moved)]

    def GetTopologyGraphvizString(self) -> str:
        """The bodies, grouped by model instance, and their joints, as a Graphviz string."""
        lines = ["digraph MultibodyPlant {", f'label="{self.get_name()}";', "rankdir=BT;", "labelloc=t;"]
        for i, instance in enumerate(self._instances):
            lines += [f"subgraph cluster{i} {{", f' label="{instance.name()}";']
            lines += [
                f' body{int(b.index())} [label="{b.name()}"];' for b in self._bodies if int(b.model_instance()) == i
            ]
            lines.append("}")
        for joint in self._joints:
            child, parent = int(joint.child_body().index()), int(joint.parent_body().index())
            lines.append(f'body{child} -> body{parent} [label="{joint.name()} [{joint.type_name()}]"];')
        return "\n".join([*lines, "}"]) + "\n"

    def _inboard_of(self, body: RigidBody) -> Any:
        """How a body hangs in the forest; None for the world."""
        return self._inboard.get(int(body.index()))
