"""What ports report of contact and joints balances what moves; the kernels behind them are seen to be wrong."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from sheldrake.geometry import Box, Sphere
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.math import SpatialInertia, UnitInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.plant._kernels import contact_report, reactions
from sheldrake.multibody.plant._step import reactions as reports_of_joints
from sheldrake.multibody.plant._step import results
from sheldrake.multibody.tree import FixedOffsetFrame, JacobianWrtVariable, RevoluteJoint
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

MASS, DT = (2.0, 1.0), 1e-3
COM = np.array([0.2, 0.01, -0.02])


class Flail:
    """Two links that swing from the world; the tip of the outer one drags along the ground."""

    def __init__(self):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, DT)
        friction, parent = CoulombFriction(0.4, 0.4), self.plant.world_frame()
        for i, mass in enumerate(MASS):
            inertia = SpatialInertia(mass, COM, UnitInertia.SolidBox(0.4, 0.1, 0.1).ShiftFromCenterOfMass(-COM))
            body = self.plant.AddRigidBody(f"link{i}", inertia)
            at = RigidTransform(RotationMatrix.MakeXRotation(0.2 * (i + 1)), [0.4 * i, 0.0, 0.5 * (1 - i)])
            frame = self.plant.AddFrame(FixedOffsetFrame(f"at{i}", parent, at))
            self.plant.AddJoint(RevoluteJoint(f"joint{i}", frame, body.body_frame(), [0.0, 1.0, 0.1]))
            parent = body.body_frame()
        self.plant.RegisterCollisionGeometry(body, RigidTransform([0.4, 0.0, 0.0]), Sphere(0.05), "tip", friction)
        below = RigidTransform([0.0, 0.0, -1.0])
        self.plant.RegisterCollisionGeometry(self.plant.world_body(), below, Box(9.0, 9.0, 2.0), "ground", friction)
        self.plant.Finalize()
        self.simulator = Simulator(builder.Build())
        self.context = self.plant.GetMyContextFromRoot(self.simulator.get_mutable_context())
        self.plant.SetPositions(self.context, [0.75, -0.5])

    def contacts(self):
        """Force on the outer link and where, of all contacts."""
        found = self.plant.get_contact_results_output_port().Eval(self.context)
        infos = [found.point_pair_contact_info(i) for i in range(found.num_point_pair_contacts())]
        links = [int(self.plant.GetBodyByName("link1").index()) == int(info.bodyB_index()) for info in infos]
        return [(info.contact_force() * (1 if B else -1), info.contact_point()) for info, B in zip(infos, links)]

    def check_contacts(self):
        """J^T f of the contact reported is the generalized contact force reported."""
        plant, context = self.plant, self.context
        link = plant.GetBodyByName("link1")
        tau = np.zeros(2)
        for force, p_WC in self.contacts():
            p_BC = link.EvalPoseInWorld(context).inverse() @ p_WC
            tau += self.jacobian(link, p_BC).T @ force
        instance = link.model_instance()
        given = plant.get_generalized_contact_forces_output_port(instance).Eval(context)
        assert np.abs(given).max() > 0.1
        np.testing.assert_allclose(tau, given, rtol=1e-2)  # the poses are those of the step's end

    def jacobian(self, link, p_BC):
        plant = self.plant
        kind = JacobianWrtVariable.kV
        world = plant.world_frame()
        return plant.CalcJacobianTranslationalVelocity(self.context, kind, link.body_frame(), p_BC, world, world)

    def check_reactions(self):
        """Of both links together: what the first joint and contact give, less their weight, is what they gain."""
        plant, context = self.plant, self.context
        A_WB = plant.get_body_spatial_accelerations_output_port().Eval(context)
        gained, weight = np.zeros(3), np.array([0.0, 0.0, -9.81 * sum(MASS)])
        for i, mass in enumerate(MASS):
            body = plant.GetBodyByName(f"link{i}")
            A, w = A_WB[int(body.index())], body.EvalSpatialVelocityInWorld(context).rotational()
            r = body.EvalPoseInWorld(context).rotation() @ COM
            gained += mass * (A.translational() + np.cross(A.rotational(), r) + np.cross(w, np.cross(w, r)))
        joint = plant.GetJointByName("joint0")
        R_WM = joint.frame_on_child().CalcPoseInWorld(context).rotation()
        given = R_WM @ plant.get_reaction_forces_output_port().Eval(context)[int(joint.index())].translational()
        touch = sum(force for force, _ in self.contacts())
        np.testing.assert_allclose(given + touch + weight, gained, rtol=1e-2, atol=0.05)

    def run(self):
        """To where the tip drags along the ground."""
        self.simulator.AdvanceTo(0.02)
        while not self.contacts():
            self.simulator.AdvanceTo(self.context.get_time() + DT)
            assert self.context.get_time() < 1.0
        self.simulator.AdvanceTo(self.context.get_time() + 20 * DT)
        return self


def test_forces_of_contact_are_those_that_move():
    Flail().run().check_contacts()


def test_reactions_hold_what_contact_and_weight_do_not():
    Flail().run().check_reactions()


class Interpreted:
    """A kernel that is run as Python, so that what it calls can be replaced."""

    def __init__(self, kernel):
        self.kernel = kernel

    def bind(self, *given):
        return partial(lambda: self.kernel(*given) or 0)


FAULTS = {
    "the wrong frame": ("check_contacts", contact_report, "neg3", lambda a: a),
    "a force that is too small": ("check_contacts", contact_report, "scale3", lambda a, s: (0.9 * a[0] * s, *a[1:])),
    "contact pushes both ways alike": ("check_reactions", reactions, "load3", lambda A, i: (0.0, 0.0, 0.0)),
    "joints that pull where they push": ("check_reactions", reactions, "scale6", lambda F, s: (F[0], F[0])),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_seen(monkeypatch, name):
    check, module, helper, wrong = FAULTS[name]
    monkeypatch.setattr(results, "report_points", Interpreted(contact_report.report_points))
    monkeypatch.setattr(reports_of_joints, "calc_reactions", Interpreted(reactions.calc_reactions))
    flail = Flail().run()
    getattr(flail, check)()
    monkeypatch.setattr(module, helper, wrong)
    flail.simulator.AdvanceTo(flail.context.get_time() + DT)
    with pytest.raises(AssertionError):
        getattr(flail, check)()
