"""A contact problem written from what pydrake knows about a state: M, bias, contacts, materials."""

from __future__ import annotations

import numpy as np

from sheldrake.multibody.contact_solvers import _arrays
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS


def approximation(name):
    from pydrake.multibody.plant import DiscreteContactApproximation

    kinds = DiscreteContactApproximation
    return {"lagged": kinds.kLagged, "similar": kinds.kSimilar, "sap": kinds.kSap, "tamsi": kinds.kTamsi}[name]


def one_step(diagram, plant, context):
    """The plant's next state by Drake itself."""
    from pydrake.systems.analysis import Simulator

    simulator = Simulator(diagram, context.Clone())
    simulator.Initialize()
    simulator.AdvanceTo(plant.time_step())
    return plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context())).copy()


def trees_of(plant):
    """Dofs of each kinematic tree: bodies connected without going through the world."""
    owner = {}
    anchored = {int(b.index()) for b in plant.GetBodiesWeldedTo(plant.world_body())}
    for j in plant.GetJointIndices():
        joint = plant.get_joint(j)
        parent, child = int(joint.parent_body().index()), int(joint.child_body().index())
        tree = len(owner) if parent in anchored else owner[parent]
        owner[child] = tree
    trees = {}
    for j in plant.GetJointIndices():
        joint = plant.get_joint(j)
        dofs = range(joint.velocity_start(), joint.velocity_start() + joint.num_velocities())
        trees.setdefault(owner[int(joint.child_body().index())], []).extend(dofs)
    return [sorted(t) for t in trees.values() if t]


def packed_rows(trees, nv):
    """Every tree as one chain of dofs: packed rows that can hold any matrix that is block diagonal by tree."""
    dof = np.zeros((nv, 3), np.int64)
    spans = np.zeros((len(trees), 2), np.int64)
    for t, dofs in enumerate(trees):
        assert dofs == list(range(dofs[0], dofs[0] + len(dofs)))
        spans[t] = dofs[0], len(dofs)
        for k in dofs:
            dof[k] = (k - 1 if k > dofs[0] else -1), k - dofs[0], 0
    sizes = dof[:, 1] + 1
    dof[:, 2] = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    return spans, dof


class DrakeProblem:
    """Problem, contacts and rows of one pydrake state; rows are added by the caller."""

    def __init__(self, plant, context, name, *, vs=1e-4, near_rigid=1.0, tau=0.0, tolerance=1e-6, rows=64):
        self.plant, self.context = plant, context
        nv, dt = plant.num_velocities(), plant.time_step()
        self.trees = trees_of(plant)
        self.tree_of_dof = {k: t for t, dofs in enumerate(self.trees) for k in dofs}
        spans, dof = packed_rows(self.trees, nv)
        self.model = _arrays.make_solver_model(
            spans, dof, dt, name, stiction_tolerance=vs, near_rigid_threshold=near_rigid, relative_tolerance=tolerance
        )
        self.work = _arrays.make_solver_work(self.model, 64, rows)
        self.stages = APPROXIMATIONS[name].as_drake
        self.A, force = self.dynamics(tau, implicit_damping=name != "tamsi")
        problem = self.work.problem
        self.v0 = plant.GetVelocities(context)
        problem.v0[:] = self.v0
        problem.p_star[:] = dt * force
        problem.v_star[:] = self.v0 + dt * np.linalg.solve(self.A, force)
        self.v_star = problem.v_star.copy()
        for k in range(nv):
            for j in self.trees[self.tree_of_dof[k]]:
                if j <= k:
                    problem.A[dof[k, 2] + dof[j, 1]] = self.A[k, j]

    def dynamics(self, tau, implicit_damping):
        from pydrake.multibody.tree import MultibodyForces

        plant, context = self.plant, self.context
        nv = plant.num_velocities()
        damping = np.zeros(nv)
        for j in plant.GetJointIndices():
            joint = plant.get_joint(j)
            first, n = joint.velocity_start(), joint.num_velocities()
            if n:
                damping[first : first + n] = joint.GetDampingVector(context)
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)  # gravity, springs, and joint damping at v0
        force = -plant.CalcInverseDynamics(context, np.zeros(nv), forces) + tau
        A = plant.CalcMassMatrix(context)
        if implicit_damping:
            A = A + plant.time_step() * np.diag(damping)
        return A, force

    def add_contacts(self, scene_graph, root_context):
        from pydrake.multibody.tree import JacobianWrtVariable

        plant, context = self.plant, self.context
        query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(root_context))
        inspector = query.inspector()

        def material(geometry, name):
            return inspector.GetProximityProperties(geometry).GetProperty("material", name)

        pairs = query.ComputePointPairPenetration()
        world = plant.world_frame()
        for c, pair in enumerate(pairs):
            ids = pair.id_A, pair.id_B
            kA, kB = (material(g, "point_contact_stiffness") for g in ids)
            dA, dB = (material(g, "hunt_crossley_dissipation") for g in ids)
            tA, tB = (material(g, "relaxation_time") for g in ids)
            mA, mB = (material(g, "coulomb_friction").dynamic_friction() for g in ids)
            p_WC = (kA * pair.p_WCa + kB * pair.p_WCb) / (kA + kB)
            J = np.zeros((3, plant.num_velocities()))
            for g, sign in zip(ids, (-1, 1)):
                body = plant.GetBodyFromFrameId(inspector.GetFrameId(g))
                p_BC = plant.EvalBodyPoseInWorld(context, body).inverse() @ p_WC
                J += sign * plant.CalcJacobianTranslationalVelocity(
                    context, JacobianWrtVariable.kV, body.body_frame(), p_BC, world, world
                )
            J = contact_frame(-pair.nhat_BA_W).T @ J
            contact = self.work.contacts[c]
            contact.stiffness = kA * kB / (kA + kB)
            contact.dissipation = (kB * dA + kA * dB) / (kA + kB)
            contact.relaxation = tA + tB
            contact.friction = 2 * mA * mB / (mA + mB) if mA + mB > 0 else 0.0
            contact.depth = pair.depth
            dofs = self.put_index(contact, J)
            contact.J[:, : len(dofs)] = J[:, dofs]
        self.work.problem.num_contacts = len(pairs)
        return len(pairs)

    def add_rows(self, J, kind, **numbers):
        """Rows that share their dofs; numbers by the names of `RowLaw`, scalars or one a row."""
        J = np.atleast_2d(J)
        for i in range(len(J)):
            r = self.work.problem.num_rows
            row = self.work.rows[r]
            dofs = self.put_index(row, J)
            row.kind, row.group = kind, len(J) if i == 0 else 0
            row.J[: len(dofs)] = J[i, dofs]
            self.work.rows.law[r] = 0.0
            for name, value in numbers.items():
                setattr(row, name, np.broadcast_to(value, len(J))[i])
            self.work.problem.num_rows += 1

    def put_index(self, constraint, J):
        trees = sorted({self.tree_of_dof[k] for k in np.flatnonzero(np.abs(J).max(axis=0))})
        assert len(trees) <= 2
        dofs = [k for t in trees for k in self.trees[t]]
        constraint.width = len(dofs)
        constraint.tree_a = trees[0] if trees else -1
        constraint.tree_b = trees[1] if len(trees) > 1 else -1
        constraint.dofs[: len(dofs)] = dofs
        return dofs

    def next_state(self, native=True):
        """Solves, as machine code or as Python, and steps the positions as Drake does."""
        prepare, solve = (stage.native if native else stage for stage in self.stages)
        prepare(self.model, *self.work[:3])
        status = solve(self.model, *self.work)
        assert status == 0, status
        v = self.work.problem.v.copy()
        qdot = self.plant.MapVelocityToQDot(self.context, v)
        return np.concatenate([self.plant.GetPositions(self.context) + self.plant.time_step() * qdot, v])


def contact_frame(z):
    """R_WC with the given z axis (facts of Drake's frame: smallest component gives the x axis' zero)."""
    i = int(np.argmin(np.abs(z)))
    j, k = (i + 1) % 3, (i + 2) % 3
    length = np.sqrt(1 - z[i] ** 2)
    x, y = np.zeros(3), np.zeros(3)
    x[j], x[k] = -z[k] / length, z[j] / length
    y[i], y[j], y[k] = length, -z[i] * z[j] / length, -z[i] * z[k] / length
    return np.column_stack([x, y, z])
