"""Free bodies of given shapes over a ground, stepped by the plant's kernel without a plant."""

from __future__ import annotations

import numpy as np

from sheldrake import geometry as g
from sheldrake.common.chain import Chain
from sheldrake.geometry._compiled.points import compile_proximity
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.geometry._state.records import WORLD_FRAME_ID
from sheldrake.geometry._state.state import GeometryState
from sheldrake.math import RigidTransform
from sheldrake.multibody.math._coulomb_friction import CoulombFriction
from sheldrake.multibody.plant._step.arrays import make_plant_model, make_step_work
from sheldrake.multibody.plant._step.stages import discrete_stages
from sheldrake.multibody.plant._step.tuning import set_margin, solver_model_of
from sheldrake.multibody.tree._compile import Mobilizer, TreeDescription, compile_tree
from sheldrake.multibody.tree._kernels.forces import empty_force_model


def box_inertia(mass, size):
    x, y, z = np.square(size) * mass / 12.0
    return np.diag([y + z, x + z, x + y])


class FreeBodies:
    """Bodies numbered from 0; each is (shape, mass [kg], centre of mass in B [m], inertia about it in B [kg m²])."""

    def __init__(self, bodies, *, dt=1e-3, approximation="lagged", algorithm="multi_point", ground=True, mu=0.5,
                 ground_mu=0.5, capacity=None, **options):  # fmt: skip
        description, p = TreeDescription(), [0.0]
        state = GeometryState()
        source = state.register_source("test")
        frames = {WORLD_FRAME_ID: 0}
        for i, (shape, mass, c, I_BBcm) in enumerate(bodies):
            c = np.asarray(c, float)
            G = np.asarray(I_BBcm) / mass + c @ c * np.eye(3) - np.outer(c, c)
            numbers = [mass, *c, G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2]]
            description.mobilizers.append(
                Mobilizer(0, "quaternion_floating", len(p), damping=(0,) * 6, gravity=(0.0, 0.0, -9.81))
            )
            p.extend(numbers)
            frame = state.register_frame(source, WORLD_FRAME_ID, g.GeometryFrame(f"body{i}"))
            frames[frame] = i + 1
            self._add(state, source, frame, shape, RigidTransform(), f"shape{i}", mu, algorithm)
        if ground:
            self._add(state, source, WORLD_FRAME_ID, g.HalfSpace(), RigidTransform(), "ground", ground_mu, algorithm)
        state.apply_proximity_defaults(g.DefaultProximityProperties())
        self.dt, self.p = dt, np.array(p)
        self.tree = compile_tree(description)
        self.geometry, _ = compile_proximity(state, frames)
        set_margin(self.geometry, approximation, dt)
        self.solver = solver_model_of(self.tree, self.geometry, dt, approximation, **options)
        self.forces = empty_force_model()
        self.plant = make_plant_model()
        self.table = contact_table(self.geometry, capacity)
        self.chain = Chain(discrete_stages(self.geometry, self.plant, approximation))
        self.work = make_step_work(self.tree, self.solver, self.plant, self.table)
        n = len(bodies)
        self.x, self.next = np.zeros(13 * n), np.zeros(13 * n)
        self.q, self.v = self.x[: 7 * n].reshape(n, 7), self.x[7 * n :].reshape(n, 6)
        self.q[:, 0] = 1.0
        self._bound = None

    @staticmethod
    def _add(state, source, frame, shape, X_BG, name, mu, algorithm):
        properties = g.ProximityProperties()
        g.AddContactMaterial(properties=properties, friction=CoulombFriction(mu, mu))
        properties.AddProperty("material", "point_contact_algorithm", algorithm)
        instance = g.GeometryInstance(X_BG, shape, name)
        instance.set_proximity_properties(properties)
        state.register_geometry(source, frame, instance)

    def arguments(self):
        return {
            **self.work._asdict(),
            "xd": self.x,
            "p": self.p,
            "u": (),
            "tree_model": self.tree,
            "geometry_model": self.geometry,
            "solver_model": self.solver,
            "force_model": self.forces,
            "plant_model": self.plant,
            "out": self.next,
        }

    def step(self, n=1):
        """Takes n steps by native code; the state after each, shape (n, 13 bodies)."""
        if self._bound is None:
            self._bound = self.chain.bind(**self.arguments())
        states = np.empty((n, len(self.x)))
        for i in range(n):
            status = self._bound()
            assert status == 0, f"status {status} in step {i}"
            self.x[:] = self.next
            states[i] = self.next
        return states


def random_quaternion(rng):
    """A rotation, all alike likely."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)
