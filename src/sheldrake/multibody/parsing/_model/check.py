"""Checks of a whole description that need more than one element: names and topology."""

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

_WORLD = ((), "world")


def check_model(model: ModelDescription, policy: DiagnosticPolicy, may_loop: bool = False) -> None:
    """Checks that names are unique, references exist and joints form trees.

    Args:
        model: The description.
        policy: Hears of problems.
        may_loop: Whether loops of joints are cut (see `loops`), rather than refused.

    Raises:
        ParseError: At the first problem.
    """
    bodies: dict[tuple[tuple[str, ...], str], BodyDescription] = {}
    frame_body: dict[tuple[tuple[str, ...], str], tuple] = {}
    _check_names(model, (), bodies, frame_body, policy)
    _check_topology(model, (), bodies if may_loop else None, frame_body, policy, {})
    _check_frame_names(model, (), frame_body, {}, policy)
    groups: set[tuple[tuple[str, ...], str]] = set()
    _collect_groups(model, (), groups, policy)
    _check_groups(model, (), bodies, groups, policy)


def _check_names(model, scope, bodies, frame_body, policy) -> None:
    """Uniqueness within each model, and the body behind every frame name (filled into `frame_body`)."""
    for nested in model.nested:
        _check_names(nested, (*scope, nested.name), bodies, frame_body, policy)
    taken: dict[tuple[str, str], object] = {}
    for body in model.bodies:
        if body.is_world:
            continue
        _claim(taken, "link", body.name, body, model, policy)
        bodies[scope, body.name] = body
        frame_body[scope, body.name] = (scope, body.name)
    for element in model.elements:
        if isinstance(element, JointDescription):
            _claim(taken, "joint", element.name, element, model, policy)
        elif isinstance(element, ActuatorDescription):
            _claim(taken, "actuator", element.name, element, model, policy)
        elif isinstance(element, FrameDescription):
            _claim(taken, "frame", element.name, element, model, policy)
            base = _find(element.base, scope, frame_body)
            if base is None:
                known = _known_names(scope, frame_body)
                policy.Error(element, f"Frame '{element.name}' is attached to '{element.base}', unknown here; {known}.")
            frame_body[scope, element.name] = base


def _claim(taken, what: str, name: str, description, model, policy) -> None:
    earlier = taken.get((what, name))
    if earlier is not None:
        policy.Error(
            description,
            f"Model '{model.name}' already contains a {what} named '{name}' (line {earlier.where.line}); names must be "
            "unique within a model.",
        )
    taken[what, name] = description


def _find(reference: FrameReference, scope, frame_body):
    if reference.is_world:
        return _WORLD
    return frame_body.get(((*scope, *reference.scope), reference.name))


def _known_names(scope, frame_body) -> str:
    names = ["::".join((*where[len(scope) :], name)) for where, name in frame_body if where[: len(scope)] == scope]
    if not names:
        return "the model has no links"
    shown = ", ".join(sorted(names)[:20]) + (" ..." if len(names) > 20 else "")
    return f"known are {shown}"


def _check_topology(model, scope, bodies, frame_body, policy, parents: dict) -> None:
    """Every joint connects two known bodies; one that closes a loop is cut, or refused if `bodies` is None.

    `parents` is a union-find forest.
    """

    def root(body):
        while body in parents:
            above = parents[body]
            parents[body] = parents.get(above, above)  # halves the path, so that long chains stay cheap
            body = above
        return body

    for nested in model.nested:
        _check_topology(nested, (*scope, nested.name), bodies, frame_body, policy, parents)
    # Only reversible joints may lead inwards in a tree; loops are cut at the others, whose cut ends lead outwards.
    for joint in sorted(model.joints(), key=lambda joint: not joint.type.reversible):
        ends = []
        for role, reference in (("parent", joint.parent), ("child", joint.child)):
            body = _find(reference, scope, frame_body)
            if body is None:
                known = _known_names(scope, frame_body)
                policy.Error(joint, f"Joint '{joint.name}': there is no {role} link '{reference}'; {known}.")
            ends.append(body)
        if ends[0] == ends[1]:
            policy.Error(joint, f"Joint '{joint.name}' would connect link '{joint.parent}' to itself.")
        one, other = root(ends[0]), root(ends[1])
        if one == other:
            if bodies is None:
                _refuse_loop(joint, policy)
            _close_loop(model, joint, scope, ends[1], bodies, frame_body, policy)
            continue
        # The world stays the root of what it is part of, and union by order is enough at these sizes.
        if other == _WORLD:
            one, other = other, one
        parents[other] = one


def _close_loop(model, joint, scope, child, bodies, frame_body, policy) -> None:
    """Cuts a loop at a joint, if its child is a link with mass."""
    if model.is_world:
        _refuse_loop(joint, policy, ", and a world has no links at which it could be cut")
    body = bodies.get(child)
    is_link = child == ((*scope, *joint.child.scope), joint.child.name)
    if body is None or not is_link or body.M_BBo_B is None or not body.M_BBo_B.get_mass() > 0.0:
        _refuse_loop(joint, policy, ", and the loop cannot be cut at its child, which is not a link with mass")
    name = f"{joint.name}_{joint.child.name}"
    while (scope, name) in frame_body:
        name = f"_{name}"
    cut_loop(model, joint, body, name, policy)
    frame_body[scope, name] = (scope, name)
    bodies[scope, name] = model.bodies[-1]


def _refuse_loop(joint, policy, reason: str = "") -> None:
    policy.Error(
        joint,
        f"Joint '{joint.name}' closes a kinematic loop: '{joint.parent}' and '{joint.child}' are already connected by "
        f"other joints{reason}. Close the loop with a constraint (drake:ball_constraint, AddWeldConstraint) or a "
        "drake:linear_bushing_rpy.",
    )


def _check_frame_names(model, scope, frame_body, taken: dict, policy) -> None:
    """No two of links, frames and the frames that joints add share a name in one model instance."""

    def claim(owner, name: str, description) -> None:
        earlier = taken.get((owner, name))
        if earlier is not None:
            full_name = "::".join((model.name, *owner[len(scope) :]))
            policy.Error(
                description,
                f"Model '{full_name}' would have two frames named '{name}' (see line {earlier.where.line}); "
                "a joint adds frames with its own name and '_parent' or '_child'.",
            )
        taken[owner, name] = description

    for nested in model.nested:
        _check_frame_names(nested, (*scope, nested.name), frame_body, taken, policy)
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


def _collect_groups(model, scope, groups, policy) -> None:
    """Names of all collision filter groups, unique within each model."""
    for nested in model.nested:
        _collect_groups(nested, (*scope, nested.name), groups, policy)
    for group in model.filter_groups:
        if "::" in group.name:
            policy.Error(group, f"The name of collision filter group '{group.name}' must not be a scoped name.")
        if (scope, group.name) in groups:
            policy.Error(group, f"Collision filter group '{group.name}' is already defined.")
        groups.add((scope, group.name))


def _check_groups(model, scope, bodies, groups, policy) -> None:
    """Every group has members, and everything it names exists."""
    for nested in model.nested:
        _check_groups(nested, (*scope, nested.name), bodies, groups, policy)
    for group in model.filter_groups:
        if not group.members and not group.member_groups:
            policy.Error(group, f"Collision filter group '{group.name}' has no members.")
        named = ((group.members, bodies, "body"), ((*group.member_groups, *group.ignored), groups, "group"))
        for names, known, what in named:
            for name in names:
                *path, local = name.split("::")
                if ((*scope, *path), local) not in known:
                    inside = [key for key in known if key[0][: len(scope)] == scope]
                    listed = ", ".join(sorted("::".join((*path[len(scope) :], local)) for path, local in inside)[:20])
                    policy.Error(
                        group,
                        f"Collision filter group '{group.name}': there is no {what} '{name}'; known are "
                        f"{listed or '(none)'}.",
                    )
