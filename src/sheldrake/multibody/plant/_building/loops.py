"""Loops of bodies and joints: Finalize() divides a body of each, so that joints form trees, and welds its parts."""

from __future__ import annotations

from sheldrake.common._checked import checked
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant._building.constraints import Constraints
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.tree import FixedOffsetFrame, Frame, Joint, RigidBody
from sheldrake.multibody.tree._forest import Cut, find_cuts


class Loops:
    """Whether loops are taken care of, and the bodies divided for it.

    Args:
        elements: Bodies and joints.
        constraints: Get the welds.
        geometry: Gets frames of the new bodies.
    """

    def __init__(self, elements: Elements, constraints: Constraints, geometry: PlantGeometry) -> None:
        self._elements, self._constraints, self._geometry = elements, constraints, geometry
        self._is_enabled = False
        self.whole_of: dict[RigidBody, RigidBody] = {}
        """The bodies that the new ones are parts of."""

    @checked
    def SetEnableLoopTopology(self, enable: bool) -> None:
        """Chooses whether Finalize() takes care of joints that close loops, instead of refusing them.

        For each such joint, a body at one end of it (the one further from the world, else the joint's child) is
        divided: the joint ends at a new body "name$1", which a weld constraint holds to the rest. All parts of a body
        have the same mass and centre of mass, together that of the body.

        Raises:
            RuntimeError: the plant is finalized.
        """
        self._elements.require_not_finalized("SetEnableLoopTopology")
        self._is_enabled = enable

    def GetEnableLoopTopology(self) -> bool:
        """Whether Finalize() takes care of joints that close loops."""
        return self._is_enabled

    def num_loop_constraints(self) -> int:
        """Number of welds that Finalize() added to close loops; they are among the weld constraints."""
        return len(self.whole_of)

    def cut(self) -> None:
        """Divides bodies, where that is wanted, until joints form trees.

        Raises:
            RuntimeError: the plant's contact takes no constraints.
        """
        if not self._is_enabled:
            return
        cuts = find_cuts(list(self._elements.bodies), list(self._elements.joints))
        if cuts:
            self._constraints.require_rows("Finalize")
        parts: dict[RigidBody, list[Cut]] = {}
        for cut in cuts:
            parts.setdefault(cut.body, []).append(cut)
        share = {body: _share(body, 1 + len(mine)) for body, mine in parts.items()}
        for body in parts:
            body._M_BBo_B = share[body]
        for cut in cuts:
            number = 1 + sum(whole is cut.body for whole in self.whole_of.values())
            self._divide(cut, f"${number}", share[cut.body])

    def _divide(self, cut: Cut, suffix: str, inertia: SpatialInertia) -> None:
        body, joint = cut
        part = self._elements.add_part(body, body.name() + suffix, inertia)
        self._geometry.register_frame(part)
        is_parent = joint.parent_body() is body
        old = joint.frame_on_parent() if is_parent else joint.frame_on_child()
        frame = self._same_frame(old, part, suffix, joint)
        ends = (frame, joint.frame_on_child()) if is_parent else (joint.frame_on_parent(), frame)
        self._elements.move_joint(joint, *ends)
        self._constraints.AddWeldConstraint(body, RigidTransform(), part, RigidTransform())
        self.whole_of[part] = body

    def _same_frame(self, frame: Frame, part: RigidBody, suffix: str, joint: Joint) -> Frame:
        """A frame of a part where another one is on the whole body."""
        if frame.is_body_frame():
            return part.body_frame()
        name = frame.name() + suffix
        while self._elements.frames.find(name, joint.model_instance()):
            name = f"_{name}"
        new = self._elements.AddFrame(
            FixedOffsetFrame(name, part.body_frame(), frame._fixed_X_BF(), joint.model_instance())
        )
        new._ephemeral = True
        return new


def _share(body: RigidBody, count: int) -> SpatialInertia:
    M = body.default_spatial_inertia()
    return SpatialInertia(M.get_mass() / count, M.get_com(), M.get_unit_inertia())
