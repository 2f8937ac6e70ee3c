"""One step of a mechanism by the plant's kernel against Drake: damping, rotors, limits, effort limits, PD."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pydrake")

from drake_problem import one_step
from test_constraint_rows import INF, mechanism, put

from sheldrake.common.chain import Chain
from sheldrake.geometry._kernels.model import contact_table, empty_geometry_model
from sheldrake.multibody.plant._step.arrays import make_plant_model, make_step_work
from sheldrake.multibody.plant._step.stages import discrete_stages
from sheldrake.multibody.plant._step.tuning import solver_model_of, tamsi_limit_penalty
from sheldrake.multibody.tree._compile import Mobilizer, TreeDescription, compile_tree
from sheldrake.multibody.tree._kernels.forces import empty_force_model

pytestmark = pytest.mark.peer

AXES = ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
BOUNDS = ((-1.0, 0.5), (-INF, 0.6), (-1.0, INF), (-2.0, 2.0))


class Mechanism:
    """The mechanism of `test_constraint_rows.mechanism` as arrays of the step."""

    def __init__(
        self, m, dt, effort=(INF, INF, INF), gains=None, name="lagged", constraints=(), distance_spring=(INF, 0.0)
    ):
        d, p = TreeDescription(), []

        def store(*numbers):
            p.extend(numbers)
            return len(p) - len(numbers)

        def inertia(body):
            M = body.default_spatial_inertia()
            c, G = M.get_com(), M.get_unit_inertia().CopyToFullMatrix3()
            return store(M.get_mass(), *c, G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2])

        def add(parent, kind, body, damping, frame=-1, constants=()):
            d.mobilizers.append(Mobilizer(parent, kind, inertia(body), frame, -1, constants, damping, (0, 0, -9.81)))

        zero = store(0.0)
        for i, link in enumerate(m.links):
            frame = -1
            if i:
                d.frames.append((-1, store(*np.eye(3).ravel(), 0.0, 0.0, -0.4)))
                frame = len(d.frames) - 1
            add(i, "revolute", link, (store(0.1 * (i + 1)),), frame, (*AXES[i], 0.0))
        slider = m.joints[3].child_body()
        add(0, "prismatic", slider, (store(0.7),), constants=(1.0, 0.0, 0.0, 1.0))
        for body in (m.A, m.B, m.C):
            add(0, "quaternion_floating", body, (zero,) * 6)
        d.actuators = [(i, store(0.01 * (i + 1)), store(3.0 + i)) for i in (0, 1, 3)]
        self.dt, self.p, self.tree, self.geometry = dt, np.array(p), compile_tree(d), empty_geometry_model()
        self.solver = solver_model_of(self.tree, self.geometry, dt, name)
        actuators, limits = [], []
        for n, dof in enumerate((0, 1, 3)):
            a = {"dof": dof, "q": dof, "port": 0, "element": n, "effort_limit": effort[n]}
            if gains and gains[n]:
                a |= {"p": gains[n][0], "d": gains[n][1], "desired_port": 2, "desired_q": n, "desired_v": 3 + n}
            actuators.append(a)
        for dof, (lower, upper) in enumerate(BOUNDS):
            stiffness, damping = tamsi_limit_penalty(self.limit_inertia(m, dof), dt)
            row = {"dof": dof, "q": dof, "lower": lower, "upper": upper, "stiffness": stiffness, "damping": damping}
            limits.append(row)
        rows = self.constraint_rows(m, constraints, distance_spring, store)
        self.p = np.array(p)
        self.plant = make_plant_model(actuators, limits, [1], rows)
        springs = [(2, 2, store(4.0, 0.3)), (3, 3, store(50.0, 0.1))]
        strut = (5, 7, store(0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.3, 30.0, 2.0))
        self.forces = empty_force_model()._replace(
            spring=np.array(springs, np.int64), strut=np.array([strut], np.int64)
        )
        self.p = np.array(p)
        self.work = make_step_work(self.tree, self.solver, self.plant, contact_table(self.geometry))
        self.chain = Chain(discrete_stages(self.geometry, self.plant, name))

    @staticmethod
    def constraint_rows(m, names, distance_spring, store):
        """Body rows: links 1 to 3, slider 4, A 5, B 6, C 7."""

        def pose(X):
            return (*X.rotation().matrix().ravel(), *X.translation())

        on = store(1.0)
        off = store(0.0)
        known = {
            "coupler": {"a": 1, "b": 3, "q_a": 1, "q_b": 3, "p": store(1.7, 0.05)},
            "distance": {"a": 3, "b": 5, "p": store(0.0, 0.0, -0.4, 0.1, 0.05, 0.0, 0.25, *distance_spring)},
            "ball": {"a": 5, "b": 6, "p": store(0.0, 0.1, 0.0, 0.1, 0.0, 0.0)},
            "weld": {"a": 6, "b": 7, "p": store(*pose(m.X_BP), *pose(m.X_CQ))},
        }
        return [{"kind": kind, "active": on if kind in names else off} | row for kind, row in known.items()]

    @staticmethod
    def limit_inertia(m, dof):
        if dof == 3:
            return m.joints[3].child_body().default_mass()
        joint = m.joints[dof]
        values = []
        for body, frame in (
            (joint.parent_body(), joint.frame_on_parent()),
            (joint.child_body(), joint.frame_on_child()),
        ):
            if body.index() != m.plant.world_body().index():
                M = body.default_spatial_inertia().Shift(frame.GetFixedPoseInBodyFrame().translation())
                values.append(np.array(AXES[dof]) @ M.CalcRotationalInertia().CopyToFullMatrix3() @ AXES[dof])
        return min(values)

    def step(self, x, u, force, desired):
        out = np.zeros_like(x)
        status = self.chain.native(
            **self.work._asdict(),
            xd=x,
            p=self.p,
            u=(u, force, desired),
            tree_model=self.tree,
            geometry_model=self.geometry,
            solver_model=self.solver,
            force_model=self.forces,
            plant_model=self.plant,
            out=out,
        )
        assert status == 0
        return out


CASES = {
    "limits": {},
    "effort limits": {"effort": (2.0, 0.5, INF)},
    "soft PD": {"gains": [(100, 10), (50, 1), None]},
    "stiff PD": {"gains": [(1e7, 1e3), (0, 1e6), (1e9, 0)], "effort": (20.0, INF, 300.0)},
    "tamsi": {"name": "tamsi", "effort": (2.0, INF, INF)},
    "coupler": {"constraints": ("coupler",)},
    "distance": {"constraints": ("distance",)},
    "soft distance": {"constraints": ("distance",), "distance_spring": (200.0, 3.0)},
    "ball": {"constraints": ("ball",)},
    "weld": {"constraints": ("weld",)},
    "all": {"constraints": ("coupler", "distance", "ball", "weld"), "gains": [(100, 10), (50, 1), None]},
    "idle PD": {"gains": [(100, 10), (50, 1), None], "effort": (2.0, INF, INF), "idle": True},
}


@pytest.mark.parametrize("case", CASES)
def test_one_step(case):
    from pydrake.math import RigidTransform, RollPitchYaw

    options = dict(CASES[case])
    idle = options.pop("idle", False)
    rng = np.random.default_rng(5)
    for dt in (1e-3, 1e-2):
        m = mechanism(dt, **options)
        ours = Mechanism(m, dt, **options)
        plant = m.plant
        for trial in range(6):
            root = m.diagram.CreateDefaultContext()
            context = plant.GetMyMutableContextFromRoot(root)
            middle = (0.51, 0.61, 0.4, 2.001) if trial % 2 else (0.499, 0.1, -0.999, 0.03)
            for i, joint in enumerate(m.joints):
                value = middle[i] + 0.002 * rng.normal()
                plant.SetPositions(context, put(plant.GetPositions(context), joint.position_start(), value))
            for body, p in ((m.A, [0.3, 0, -1.1]), (m.B, [0.4, 0.1, -1.1]), (m.C, [0.5, 0, -1])):
                X_WB = RigidTransform(RollPitchYaw(rng.normal(0, 0.3, 3)), p + rng.normal(0, 0.01, 3))
                plant.SetFreeBodyPose(context, body, X_WB)
            plant.SetVelocities(context, rng.normal(0, 1.0, plant.num_velocities()))
            u, desired = rng.normal(0, 5.0, 3), rng.normal(0, 0.5, 6)
            force = rng.normal(0, 1.0, plant.num_velocities())
            plant.get_actuation_input_port().FixValue(context, u)
            plant.get_applied_generalized_force_input_port().FixValue(context, force)
            if options.get("gains") and not idle:
                plant.get_desired_state_input_port(m.instance).FixValue(context, desired)
            x = plant.GetPositionsAndVelocities(context)
            given = np.zeros(0) if idle else desired
            drakes = one_step(m.diagram, plant, root)
            result = ours.step(x, u, force, given)
            # Rigid constraints that start violated make speeds of 1e3 and rows of stiffness 1/dt^2: round-off.
            tolerance = 1e-7 if options.get("constraints") else 1e-11
            np.testing.assert_allclose(result, drakes, rtol=tolerance, atol=tolerance)
            reported = net_actuation(m, root)
            np.testing.assert_allclose(
                ours.work.step.net_actuation, reported, rtol=1e3 * tolerance, atol=1e3 * tolerance
            )


def net_actuation(m, root):
    """Drake's report of the step that starts at this state."""
    from pydrake.systems.analysis import Simulator

    simulator = Simulator(m.diagram, root.Clone())
    simulator.Initialize()
    simulator.AdvanceTo(m.plant.time_step())
    context = m.plant.GetMyContextFromRoot(simulator.get_context())
    return m.plant.get_net_actuation_output_port().Eval(context)
