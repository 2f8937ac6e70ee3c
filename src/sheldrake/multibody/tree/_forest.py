"""The order in which bodies follow each other from the world outwards."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from sheldrake.multibody.tree._joint import Joint
    from sheldrake.multibody.tree._rigid_body import RigidBody


class Step(NamedTuple):
    """One body of the forest: it hangs on `parent` by `joint`."""

    body: RigidBody
    parent: RigidBody
    joint: Any
    reversed: bool
    """The joint names this body as its parent."""


def span_forest(bodies: Sequence[Any], joints: Sequence[Any], add_floating_joint: Callable[[Any], Any]) -> list[Step]:
    """Bodies depth first, each after its inboard body; Drake numbers positions and velocities in this order.

    Trees on the world come first, in the order of its joints; then every other group of joined bodies, whose floating
    base is a body that no joint names as a child: of all these, the one that most joints name as parent goes first;
    then single bodies.

    Args:
        bodies: All bodies, the world first.
        joints: All joints.
        add_floating_joint: Makes and registers the joint of a body that floats.

    Raises:
        RuntimeError: joints form a loop, or a joint would have to be reversed that cannot be.
    """
    incident = _joints_of(bodies, joints)
    steps: list[Step] = []
    seen = {id(bodies[0])}
    used: set[int] = set()

    def grow(root: RigidBody) -> None:
        stack = [(root, iter(incident[id(root)]))]
        while stack:
            body, rest = stack[-1]
            for joint in rest:
                if id(joint) not in used:
                    break
            else:
                stack.pop()
                continue
            used.add(id(joint))
            backwards = joint.child_body() is body
            other = joint.parent_body() if backwards else joint.child_body()
            if id(other) in seen:
                raise _closes_a_loop(joint)
            if backwards and not joint._type.reversible:
                raise _is_not_reversible(joint)
            steps.append(Step(other, body, joint, backwards))
            seen.add(id(other))
            stack.append((other, iter(incident[id(other)])))

    def float_body(body: RigidBody) -> None:
        joint = add_floating_joint(body)
        used.add(id(joint))
        steps.append(Step(body, bodies[0], joint, False))
        seen.add(id(body))
        grow(body)

    grow(bodies[0])
    for body in _bases(bodies, joints, incident) if len(seen) < len(bodies) else ():
        if id(body) not in seen:
            float_body(body)
    return steps


def _joints_of(bodies: Sequence[Any], joints: Sequence[Any]) -> dict[int, list[Any]]:
    """The joints at each body, by its id."""
    incident: dict[int, list[Any]] = {id(b): [] for b in bodies}
    for joint in joints:
        incident[id(joint.parent_body())].append(joint)
        incident[id(joint.child_body())].append(joint)
    return incident


class Cut(NamedTuple):
    """A joint that closes a loop, and the body at one end of it to divide."""

    body: RigidBody
    joint: Any


def find_cuts(bodies: Sequence[Any], joints: Sequence[Any]) -> list[Cut]:
    """Where loops are to be cut, so that each body is as few joints away from the world, or its base, as without.

    Breadth first, as Drake does: of the two ends of a joint that closes a loop, the one further out is divided, or else
    the joint's child.

    Args:
        bodies: All bodies, the world first.
        joints: All joints.

    Raises:
        RuntimeError: a joint would have to be reversed that cannot be.
    """
    incident = _joints_of(bodies, joints)
    cuts: list[Cut] = []
    depth: dict[int, int] = {}
    used: set[int] = set()
    for base in (bodies[0], *_bases(bodies, joints, incident)):
        if id(base) in depth:
            continue
        depth[id(base)], row = 0, [base]
        for body in row:  # grows meanwhile
            for joint in incident[id(body)]:
                if id(joint) in used:
                    continue
                used.add(id(joint))
                is_parent = joint.parent_body() is body
                other = joint.child_body() if is_parent else joint.parent_body()
                if id(other) not in depth:
                    outer = other
                    depth[id(other)] = depth[id(body)] + 1
                    row.append(other)
                else:
                    ahead = depth[id(other)] - depth[id(body)]
                    outer = other if ahead > 0 or (ahead == 0 and is_parent) else body
                    cuts.append(Cut(outer, joint))
                if joint.child_body() is not outer and not joint._type.reversible:
                    raise _is_not_reversible(joint)
    return cuts


def _bases(bodies: Sequence[Any], joints: Sequence[Any], incident: dict[int, list[Any]]) -> list[Any]:
    """The bodies from which groups that do not hang on the world are grown, if no earlier one reaches them."""
    children = {id(j.child_body()) for j in joints}
    joined = [b for b in bodies if incident[id(b)]]
    only_parents = sorted((b for b in joined if id(b) not in children), key=lambda b: -len(incident[id(b)]))
    return [*only_parents, *joined, *bodies]


def _closes_a_loop(joint: Joint) -> RuntimeError:
    return RuntimeError(
        f"MultibodyPlant.Finalize(): the bodies and joints form a loop, closed by joint {joint.name()!r} "
        f"between bodies {joint.parent_body().name()!r} and {joint.child_body().name()!r}. Loops in the "
        "system graph are not supported as joints: call SetEnableLoopTopology(True), which divides a body and welds "
        "it by a constraint, or remove that joint and close the loop with a constraint or a stiff "
        "LinearBushingRollPitchYaw."
    )


def _is_not_reversible(joint: Joint) -> RuntimeError:
    return RuntimeError(
        f"MultibodyPlant::Finalize(): parent/child ordering for {joint.type_name()} joint {joint.name()} "
        f"(body {joint.parent_body().name()!r} to body {joint.child_body().name()!r}) would have to be "
        "reversed to make a tree-structured model for this system. Joints that can be reversed are: "
        "prismatic, revolute, weld. Swap the parent and child of this joint."
    )
