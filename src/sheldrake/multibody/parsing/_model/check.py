"""Checks of a whole description that need more than one element: names and topology."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any, NoReturn

from .._files.diagnostics import DiagnosticPolicy
from .description import (
    ActuatorDescription,
    BodyDescription,
    FrameDescription,
    FrameReference,
    JointDescription,
    ModelDescription,
)
from .loops import cut_loop

Place = tuple[tuple[str, ...], str]
"""Names of the models that something is in, outermost first, and its own name."""
_WORLD: Place = ((), "world")


def check_model(model: ModelDescription, policy: DiagnosticPolicy, may_loop: bool = False) -> None:
    """Checks that names are unique, references exist and joints form trees.

    Args:
        model: The description.
        policy: Hears of problems.
        may_loop: Whether loops of joints are cut (see `loops`), rather than refused.

    Raises:
        ParseError: At the first problem.
    """
    check = _Check(policy, may_loop)
    check.names(model, ())
    check.topology(model, ())
    check.frame_names(model, ())
    check.collect_groups(model, ())
    check.groups(model, ())


class _Check:
    """What is known of a model and those nested in it. Each check takes a model and its scope, outermost name first."""

    def __init__(self, policy: DiagnosticPolicy, may_loop: bool):
        self._policy = policy
        self._may_loop = may_loop
        self._bodies: dict[Place, BodyDescription] = {}
        self._frame_body: dict[Place, Place] = {}  # the body behind every frame
        self._parents: dict[Place, Place] = {}  # a union-find forest of bodies that joints connect
        self._frame_names: dict[Place, Any] = {}  # who has a name
        self._groups: set[Place] = set()

    def names(self, model: ModelDescription, scope: tuple[str, ...]) -> None:
        """Uniqueness within each model, and the body behind every frame name."""
        for nested in model.nested:
            self.names(nested, (*scope, nested.name))
        taken: dict[tuple[str, str], Any] = {}

        def claim(what: str, description: Any) -> None:
            name = description.name
            earlier = taken.get((what, name))
            if earlier is not None:
                self._policy.Error(
                    description,
                    f"Model '{model.name}' already contains a {what} named '{name}' (line {earlier.where.line}); names "
                    "must be unique within a model.",
                )
            taken[what, name] = description

        for body in model.bodies:
            if body.is_world:
                continue
            claim("link", body)
            self._bodies[scope, body.name] = body
            self._frame_body[scope, body.name] = (scope, body.name)
        for element in model.elements:
            if isinstance(element, JointDescription):
                claim("joint", element)
            elif isinstance(element, ActuatorDescription):
                claim("actuator", element)
            elif isinstance(element, FrameDescription):
                claim("frame", element)
                base = self._find(element.base, scope)
                if base is None:
                    known = self._known_names(scope)
                    text = f"Frame '{element.name}' is attached to '{element.base}', unknown here; {known}."
                    self._policy.Error(element, text)
                self._frame_body[scope, element.name] = base

    def _find(self, reference: FrameReference, scope: tuple[str, ...]) -> Place | None:
        if reference.is_world:
            return _WORLD
        return self._frame_body.get(((*scope, *reference.scope), reference.name))

    def _known_names(self, scope: tuple[str, ...]) -> str:
        inside = [(where, name) for where, name in self._frame_body if where[: len(scope)] == scope]
        names = ["::".join((*where[len(scope) :], name)) for where, name in inside]
        if not names:
            return "the model has no links"
        shown = ", ".join(sorted(names)[:20]) + (" ..." if len(names) > 20 else "")
        return f"known are {shown}"

    def _root(self, body: Place) -> Place:
        parents = self._parents
        while body in parents:
            above = parents[body]
            parents[body] = parents.get(above, above)  # halves the path, so that long chains stay cheap
            body = above
        return body

    def topology(self, model: ModelDescription, scope: tuple[str, ...]) -> None:
        """Every joint connects two known bodies; one that closes a loop is cut, or refused."""
        for nested in model.nested:
            self.topology(nested, (*scope, nested.name))
        # Only reversible joints may lead inwards in a tree; loops are cut at the others, whose cut ends lead outwards.
        for joint in sorted(model.joints(), key=lambda joint: not joint.type.reversible):
            ends = []
            for role, reference in (("parent", joint.parent), ("child", joint.child)):
                body = self._find(reference, scope)
                if body is None:
                    known = self._known_names(scope)
                    text = f"Joint '{joint.name}': there is no {role} link '{reference}'; {known}."
                    self._policy.Error(joint, text)
                ends.append(body)
            if ends[0] == ends[1]:
                self._policy.Error(joint, f"Joint '{joint.name}' would connect link '{joint.parent}' to itself.")
            one, other = self._root(ends[0]), self._root(ends[1])
            if one == other:
                if not self._may_loop:
                    self._refuse_loop(joint)
                self._close_loop(model, joint, scope, ends[1])
                continue
            # The world stays the root of what it is part of, and union by order is enough at these sizes.
            if other == _WORLD:
                one, other = other, one
            self._parents[other] = one

    def _close_loop(
        self, model: ModelDescription, joint: JointDescription, scope: tuple[str, ...], child: Place
    ) -> None:
        """Cuts a loop at a joint, if its child is a link with mass."""
        if model.is_world:
            self._refuse_loop(joint, ", and a world has no links at which it could be cut")
        body = self._bodies.get(child)
        is_link = child == ((*scope, *joint.child.scope), joint.child.name)
        if body is None or not is_link or body.M_BBo_B is None or not body.M_BBo_B.get_mass() > 0.0:
            self._refuse_loop(joint, ", and the loop cannot be cut at its child, which is not a link with mass")
        name = f"{joint.name}_{joint.child.name}"
        while (scope, name) in self._frame_body:
            name = f"_{name}"
        cut_loop(model, joint, body, name, self._policy)
        self._frame_body[scope, name] = (scope, name)
        self._bodies[scope, name] = model.bodies[-1]

    def _refuse_loop(self, joint: JointDescription, reason: str = "") -> NoReturn:
        self._policy.Error(
            joint,
            f"Joint '{joint.name}' closes a kinematic loop: '{joint.parent}' and '{joint.child}' are already connected "
            f"by other joints{reason}. Close the loop with a constraint (drake:ball_constraint, AddWeldConstraint) or "
            "a drake:linear_bushing_rpy.",
        )

    def frame_names(self, model: ModelDescription, scope: tuple[str, ...]) -> None:
        """No two of links, frames and the frames that joints add share a name in one model instance."""

        def claim(owner: tuple[str, ...], name: str, description: Any) -> None:
            earlier = self._frame_names.get((owner, name))
            if earlier is not None:
                full_name = "::".join((model.name, *owner[len(scope) :]))
                self._policy.Error(
                    description,
                    f"Model '{full_name}' would have two frames named '{name}' (see line {earlier.where.line}); "
                    "a joint adds frames with its own name and '_parent' or '_child'.",
                )
            self._frame_names[owner, name] = description

        for nested in model.nested:
            self.frame_names(nested, (*scope, nested.name))
        for body in model.bodies:
            if not body.is_world:
                claim(scope, body.name, body)
        for element in model.elements:
            if isinstance(element, FrameDescription) and not element.base.is_world:
                base = scope if element.is_of_model else (*scope, *element.base.scope)
                claim(base, element.name, element)
            elif isinstance(element, JointDescription):
                owner = (*scope, *element.child.scope)
                for X, suffix in ((element.X_PF, "parent"), (element.X_CM, "child")):
                    if X is not None and not element.child.is_world:
                        claim(owner, f"{element.name}_{suffix}", element)

    def collect_groups(self, model: ModelDescription, scope: tuple[str, ...]) -> None:
        """Names of all collision filter groups, unique within each model."""
        for nested in model.nested:
            self.collect_groups(nested, (*scope, nested.name))
        for group in model.filter_groups:
            if "::" in group.name:
                text = f"The name of collision filter group '{group.name}' must not be a scoped name."
                self._policy.Error(group, text)
            if (scope, group.name) in self._groups:
                self._policy.Error(group, f"Collision filter group '{group.name}' is already defined.")
            self._groups.add((scope, group.name))

    def groups(self, model: ModelDescription, scope: tuple[str, ...]) -> None:
        """Every group has members, and everything it names exists."""
        for nested in model.nested:
            self.groups(nested, (*scope, nested.name))
        for group in model.filter_groups:
            if not group.members and not group.member_groups:
                self._policy.Error(group, f"Collision filter group '{group.name}' has no members.")
            named: tuple[tuple[Iterable[str], Collection[Place], str], ...] = (
                (group.members, self._bodies, "body"),
                ((*group.member_groups, *group.ignored), self._groups, "group"),
            )
            for names, known, what in named:
                for name in names:
                    *path, local = name.split("::")
                    if ((*scope, *path), local) in known:
                        continue
                    inside = [key for key in known if key[0][: len(scope)] == scope]
                    listed = ", ".join(sorted("::".join((*path[len(scope) :], local)) for path, local in inside)[:20])
                    self._policy.Error(
                        group,
                        f"Collision filter group '{group.name}': there is no {what} '{name}'; known are "
                        f"{listed or '(none)'}.",
                    )
