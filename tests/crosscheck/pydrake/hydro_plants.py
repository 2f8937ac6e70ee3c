"""The same plants with hydroelastic contact in sheldrake and in pydrake."""

from __future__ import annotations

import numpy as np
from tests.libraries import names_of
from tests.unit.geometry import hydro_properties

MODULES = ("geometry", "math", "multibody.plant", "multibody.tree", "multibody.math", "systems.framework",
           "systems.analysis")  # fmt: skip


def library(name):
    """All public names of a library's modules that plants need."""
    return names_of(name, *MODULES)


def properties(lib, rigid=None, soft=None, slab=None, modulus=1e6, dissipation=10.0, mu=0.5, margin=None, tau=None):
    p = hydro_properties.properties(lib, rigid, soft, slab, modulus, margin)
    if tau is not None:
        p.AddProperty("material", "relaxation_time", tau)
    lib.AddContactMaterial(dissipation=dissipation, friction=lib.CoulombFriction(mu + 0.1, mu), properties=p)
    return p


class Scene:
    """Bodies with one geometry each, free or on a slide along x, and something fixed to the world.

    Args:
        lib: `library(name)`.
        bodies: (shape, its arguments, properties, (roll, pitch, yaw, x, y, z), velocity); six velocities of a free
            body, or the one of a slide.
        ground: (shape, its arguments, properties), or None.
        options: approximation, contact_model, representation, time_step, sampled, gravity.
    """

    def __init__(self, lib, bodies, ground, **options):
        o = {
            "approximation": "kLagged", "contact_model": "kHydroelastic", "representation": "kPolygon",
            "time_step": 1e-3, "sampled": True, "defaults": {}, **options,
        }  # fmt: skip
        self.lib, self.dt = lib, o["time_step"]
        builder = lib.DiagramBuilder()
        plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, self.dt)
        config = lib.SceneGraphConfig()
        for name, value in o["defaults"].items():
            setattr(config.default_proximity_properties, name, value)
        scene_graph.set_config(config)
        plant.SetUseSampledOutputPorts(o["sampled"]) if self.dt else None
        if self.dt:
            plant.set_discrete_contact_approximation(getattr(lib.DiscreteContactApproximation, o["approximation"]))
        plant.set_contact_model(getattr(lib.ContactModel, o["contact_model"]))
        plant.set_contact_surface_representation(getattr(lib.HydroelasticContactRepresentation, o["representation"]))
        if ground is not None:
            self._geometry(plant, plant.world_body(), "ground", *ground)
        slides = []
        for i, (shape, arguments, what, pose, velocity) in enumerate(bodies):
            body = plant.AddRigidBody(f"body{i}", lib.SpatialInertia.SolidBoxWithMass(1.0 + i, 0.2, 0.3, 0.25))
            self._geometry(plant, body, "geometry", shape, arguments, what)
            if len(velocity) == 1:
                X = self._pose(pose)
                slides.append(
                    plant.AddJoint(lib.PrismaticJoint(f"slide{i}", plant.world_frame(), body.body_frame(), [1, 0, 0]))
                    if X.IsExactlyIdentity()
                    else plant.AddJoint(
                        lib.PrismaticJoint(
                            f"slide{i}",
                            plant.AddFrame(lib.FixedOffsetFrame(f"rail{i}", plant.world_frame(), X)),
                            body.body_frame(),
                            [1, 0, 0],
                        )
                    )
                )
        for joint in slides:
            plant.AddJointActuator(f"{joint.name()}_motor", joint)
        plant.Finalize()
        self.plant, self.scene_graph, self.diagram = plant, scene_graph, builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = plant.GetMyMutableContextFromRoot(self.root)
        for i, (*_, pose, velocity) in enumerate(bodies):
            body = plant.GetBodyByName(f"body{i}")
            if len(velocity) == 1:
                plant.GetJointByName(f"slide{i}").set_translation_rate(self.context, velocity[0])
                continue
            plant.SetFreeBodyPose(self.context, body, self._pose(pose))
            plant.SetFreeBodySpatialVelocity(self.context, body, lib.SpatialVelocity(np.array(velocity, float)))

    def _pose(self, pose):
        return self.lib.RigidTransform(self.lib.RollPitchYaw(*pose[:3]), list(pose[3:]))

    def _geometry(self, plant, body, name, shape, arguments, what):
        made = getattr(self.lib, shape)(*arguments)
        plant.RegisterCollisionGeometry(body, self.lib.RigidTransform(), made, name, properties(self.lib, **what))

    def actuate(self, *efforts):
        self.plant.get_actuation_input_port().FixValue(self.context, list(efforts))

    def run(self, steps):
        """Takes steps and gives the state."""
        simulator = self.lib.Simulator(self.diagram, self.root)
        simulator.Initialize()
        simulator.AdvanceTo(self.dt * (steps - 1))
        return self.state()

    def state(self):
        return self.plant.GetPositionsAndVelocities(self.context)

    def results(self):
        return self.plant.get_contact_results_output_port().Eval(self.context)

    def forces(self):
        """F_Ac_W and the centroids of all contact surfaces."""
        r = self.results()
        infos = [r.hydroelastic_contact_info(i) for i in range(r.num_hydroelastic_contacts())]
        return np.array([[*i.F_Ac_W().get_coeffs(), *i.contact_surface().centroid()] for i in infos])


FREE = (0.1, 0.2, 0.3, 0.1, 0.05, -0.1)
GROUND = {"mu": 0.8, "dissipation": 20.0}
SCENES = {
    "soft sphere on rigid ground": (
        [("Sphere", (0.1,), {"soft": 0.03}, (0.1, 0.2, 0.3, 0, 0, 0.098), FREE)],
        ("HalfSpace", (), {"rigid": 1.0, **GROUND}),
    ),
    "soft box on rigid ground": (
        [("Box", (0.2, 0.3, 0.2), {"soft": 0.03}, (0.01, 0.02, 0.3, 0, 0, 0.098), FREE)],
        ("HalfSpace", (), {"rigid": 1.0, **GROUND}),
    ),
    "rigid box on soft ground": (
        [("Box", (0.2, 0.3, 0.2), {"rigid": 0.03}, (0.01, 0.02, 0.3, 0, 0, 0.098), FREE)],
        ("HalfSpace", (), {"slab": 0.1, **GROUND}),
    ),
    "soft cylinder on a rigid table": (
        [("Cylinder", (0.1, 0.2), {"soft": 0.03, "tau": 0.05}, (0.01, 0.02, 0.3, 0, 0, 0.108), FREE)],
        ("Box", (3.0, 3.0, 0.02), {"rigid": 1.0, **GROUND}),
    ),
    "two soft spheres": (
        [
            ("Sphere", (0.1,), {"soft": 0.03}, (0.1, 0.2, 0.3, 0, 0, 0.2), FREE),
            ("Sphere", (0.12,), {"soft": 0.03, "modulus": 3e6, "dissipation": 5.0}, (0.1, 0.2, 0.3, 0.01, 0.02, 0.41),
             (0, 0, 0, 0, 0, -0.3)),
        ],
        None,
    ),
    "box between two pads": (
        [
            ("Box", (0.1, 0.1, 0.1), {"rigid": 1.0}, (0.001, 0.002, 0.003, 0, 0, 0.2), (0, 0, 0, 0, 0, 0)),
            ("Box", (0.02, 0.2, 0.2), {"soft": 1.0, "modulus": 1e5}, (0.1, 0.01, 0.02, -0.058, 0.02, 0.21), (0.1,)),
            ("Box", (0.02, 0.2, 0.2), {"soft": 1.0, "modulus": 1e5}, (0.1, 0.01, 0.02, 0.059, 0.02, 0.2), (-0.1,)),
        ],
        None,
    ),
}  # fmt: skip
