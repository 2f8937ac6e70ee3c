"""One description of a scene, run by sheldrake, Drake and MuJoCo."""

from __future__ import annotations

import dataclasses
import importlib

import numpy as np

Triple = tuple[float, float, float]
ZERO: Triple = (0.0, 0.0, 0.0)


@dataclasses.dataclass
class Solid:
    """A body of one shape: free, sliding along an axis, or (without mass) part of the world.

    Attributes:
        shape: "half_space"; or name and sizes [m]: "box" and edges, "sphere" and radius, "cylinder" and radius, length.
        mass: [kg], of even density; 0 is fixed to the world.
        p: position [m].
        rpy: roll, pitch, yaw [rad].
        v: velocity at the start [m/s], in the world.
        w: angular velocity at the start [rad/s], in the world.
        axis: direction of the only motion it has; None for a free body.
        force: along this axis, for ever [N].
    """

    shape: tuple
    mass: float = 0.0
    p: Triple = ZERO
    rpy: Triple = ZERO
    v: Triple = ZERO
    w: Triple = ZERO
    axis: Triple | None = None
    force: float = 0.0


@dataclasses.dataclass
class Scene:
    """Solids and what they are made of.

    Attributes:
        solids: what there is.
        time_step: [s].
        friction: Coulomb's coefficient of every pair.
        gravity: [m/s²].
        stiffness: of a pair of points [N/m]; None for each engine's own default.
        dissipation: Hunt and Crossley's [s/m]; None for the default.
        relaxation_time: of kSap's damping [s], of a pair; None for the default.
        hydroelastic: elastic modulus of what moves, on rigid ground [Pa]; None for contact in points.
    """

    solids: list[Solid]
    time_step: float = 1e-3
    friction: float = 0.5
    gravity: Triple = (0.0, 0.0, -9.81)
    stiffness: float | None = None
    dissipation: float | None = None
    relaxation_time: float | None = None
    hydroelastic: float | None = None

    def moving(self) -> list[Solid]:
        return [s for s in self.solids if s.mass > 0.0]


class DrakeLike:
    """Scenes in sheldrake or pydrake.

    Args:
        package: "sheldrake" or "pydrake".
        approximation: of `MultibodyPlantConfig`.
        algorithm: "multi_point" or "single_point"; sheldrake only.
    """

    def __init__(self, package: str, approximation: str = "lagged", algorithm: str | None = None):
        self.lib = importlib.import_module(f"{package}.all")
        self.approximation, self.algorithm = approximation, algorithm

    def start(self, scene: Scene) -> None:
        """Builds a scene and goes to its beginning."""
        lib = self.lib
        builder = lib.DiagramBuilder()
        config = lib.MultibodyPlantConfig(time_step=scene.time_step, discrete_contact_approximation=self.approximation)
        plant, _ = lib.AddMultibodyPlant(config, builder)
        plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
        self.plant, self.bodies = plant, []
        pushes = [self._add(scene, solid, k) for k, solid in enumerate(scene.solids)]
        plant.Finalize()
        self.simulator = lib.Simulator(builder.Build())
        self.context = plant.GetMyContextFromRoot(self.simulator.get_context())
        if plant.num_actuators():
            plant.get_actuation_input_port().FixValue(self.context, [f for f in pushes if f is not None])
        self.reset(scene)

    def reset(self, scene: Scene) -> None:
        """Back to the beginning; free bodies with positions and velocities of this (otherwise equal) scene."""
        lib, plant, context = self.lib, self.plant, self.context
        for body, solid in zip(self.bodies, scene.moving()):
            if solid.axis is None:
                X_WB = lib.RigidTransform(lib.RollPitchYaw(*solid.rpy), solid.p)
                plant.SetFreeBodyPose(context, body, X_WB)
                plant.SetFreeBodySpatialVelocity(context, body, lib.SpatialVelocity(solid.w, solid.v))
        self.steps = 0
        self.simulator.get_mutable_context().SetTime(0.0)
        self.simulator.Initialize()

    def _add(self, scene: Scene, solid: Solid, k: int) -> float | None:
        """Adds a solid; the force along its axis, if it has one."""
        lib, plant = self.lib, self.plant
        X = lib.RigidTransform(lib.RollPitchYaw(*solid.rpy), solid.p)
        shape = _shape(lib, solid.shape)
        body = plant.world_body()
        if solid.mass > 0.0:
            body = plant.AddRigidBody(f"body{k}", _inertia(lib, solid))
            self.bodies.append(body)
        force = None
        if solid.axis is not None:
            at_rest = plant.AddFrame(lib.FixedOffsetFrame(f"at{k}", plant.world_frame(), X))
            joint = plant.AddJoint(lib.PrismaticJoint(f"slide{k}", at_rest, body.body_frame(), solid.axis))
            plant.AddJointActuator(f"push{k}", joint)
            force = solid.force
        X_BG = X if solid.mass == 0.0 else lib.RigidTransform()
        plant.RegisterCollisionGeometry(body, X_BG, shape, f"solid{k}", self._material(scene, solid.mass > 0.0))
        return force

    def _material(self, scene: Scene, moves: bool):
        lib, properties = self.lib, self.lib.ProximityProperties()
        stiffness = None if scene.stiffness is None else 2.0 * scene.stiffness
        friction = lib.CoulombFriction(scene.friction, scene.friction)
        lib.AddContactMaterial(scene.dissipation, stiffness, friction, properties)
        if scene.hydroelastic is not None:
            if moves:
                lib.AddCompliantHydroelasticProperties(0.01, scene.hydroelastic, properties)
            else:
                lib.AddRigidHydroelasticProperties(properties)
        if scene.relaxation_time is not None:
            properties.AddProperty("material", "relaxation_time", 0.5 * scene.relaxation_time)
        if self.algorithm:
            properties.AddProperty("material", "point_contact_algorithm", self.algorithm)
        return properties

    def advance(self, seconds: float) -> None:
        """Takes as many whole steps as there are in this time."""
        self.steps += round(seconds / self.plant.time_step())
        self.simulator.AdvanceTo(self.steps * self.plant.time_step())

    def positions(self) -> np.ndarray:
        """Of what moves [m], shape (n, 3)."""
        return np.array([self.plant.EvalBodyPoseInWorld(self.context, b).translation() for b in self.bodies])

    def rotations(self) -> np.ndarray:
        """Of what moves, shape (n, 3, 3)."""
        return np.array([self.plant.EvalBodyPoseInWorld(self.context, b).rotation().matrix() for b in self.bodies])

    def velocities(self) -> np.ndarray:
        """Of what moves, in the world: angular [rad/s], then translational [m/s], shape (n, 6)."""
        plant = self.plant
        return np.array([plant.EvalBodySpatialVelocityInWorld(self.context, b).get_coeffs() for b in self.bodies])

    def depth_and_contacts(self) -> tuple[float, int]:
        """Depth of the deepest contact point [m], and how many there are."""
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        n = results.num_point_pair_contacts()
        return max((results.point_pair_contact_info(k).point_pair().depth for k in range(n)), default=0.0), n


def _shape(lib, shape: tuple):
    names = {"half_space": lib.HalfSpace, "box": lib.Box, "sphere": lib.Sphere, "cylinder": lib.Cylinder}
    return names[shape[0]](*shape[1:])


def _inertia(lib, solid: Solid):
    kind, *size = solid.shape
    if kind == "box":
        return lib.SpatialInertia.SolidBoxWithMass(solid.mass, *size)
    if kind == "sphere":
        return lib.SpatialInertia.SolidSphereWithMass(solid.mass, *size)
    return lib.SpatialInertia.SolidCylinderWithMass(solid.mass, *size, [0.0, 0.0, 1.0])


class MuJoCo:
    """Scenes in MuJoCo.

    Args:
        cone: of friction, "pyramidal" (MuJoCo's default) or "elliptic".
    """

    def __init__(self, cone: str = "pyramidal"):
        import mujoco

        self.mujoco, self.cone = mujoco, cone

    def start(self, scene: Scene) -> None:
        """Builds a scene and goes to its beginning."""
        gravity, dt = _text(scene.gravity), scene.time_step
        direct = ""
        if scene.stiffness is not None:  # of a mass of 1 kg
            direct = f'solref="-{scene.stiffness} 0" solimp="0.9999 0.9999 0.001"'
        condim = 3 if scene.friction else 1
        grip = f'friction="{scene.friction} 0 0" condim="{condim}" {direct}'
        xml, motors = [], []
        for k, solid in enumerate(scene.solids):
            xml.append(_solid_xml(solid, k, grip))
            if solid.axis is not None:
                motors.append(f'<motor joint="slide{k}"/>')
        self.model = self.mujoco.MjModel.from_xml_string(
            f'<mujoco><compiler angle="radian" eulerseq="XYZ"/>'
            f'<option timestep="{dt}" gravity="{gravity}" cone="{self.cone}"/>'
            f'<size memory="200M"/><worldbody>{"".join(xml)}</worldbody><actuator>{"".join(motors)}</actuator></mujoco>'
        )
        self.reset(scene)

    def reset(self, scene: Scene) -> None:
        """Back to the beginning; free bodies with positions and velocities of this (otherwise equal) scene."""
        self.data = self.mujoco.MjData(self.model)
        self.data.ctrl[:] = [s.force for s in scene.moving() if s.axis is not None]
        at, to = 0, 0
        for solid in scene.moving():
            if solid.axis is not None:
                at, to = at + 1, to + 1
                continue
            R_WB = _rotation(solid.rpy)
            wxyz = np.zeros(4)
            self.mujoco.mju_mat2Quat(wxyz, R_WB.ravel())
            self.data.qpos[at : at + 7] = [*solid.p, *wxyz]
            self.data.qvel[to : to + 6] = [*solid.v, *(R_WB.T @ solid.w)]
            at, to = at + 7, to + 6
        self.mujoco.mj_forward(self.model, self.data)

    def advance(self, seconds: float) -> None:
        """Takes as many whole steps as there are in this time."""
        steps = round(seconds / self.model.opt.timestep)
        if steps:
            self.mujoco.mj_step(self.model, self.data, steps)

    def positions(self) -> np.ndarray:
        """Of what moves [m], shape (n, 3)."""
        self.mujoco.mj_kinematics(self.model, self.data)
        return self.data.xpos[1:].copy()

    def rotations(self) -> np.ndarray:
        """Of what moves, shape (n, 3, 3)."""
        self.mujoco.mj_kinematics(self.model, self.data)
        return self.data.xmat[1:].reshape(-1, 3, 3).copy()

    def velocities(self) -> np.ndarray:
        """Of what moves, in the world: angular [rad/s], then translational [m/s], shape (n, 6)."""
        self.mujoco.mj_forward(self.model, self.data)
        out = np.zeros((self.model.nbody - 1, 6))
        for body in range(1, self.model.nbody):
            kind = self.mujoco.mjtObj.mjOBJ_BODY
            self.mujoco.mj_objectVelocity(self.model, self.data, kind, body, out[body - 1], 0)
        return out

    def depth_and_contacts(self) -> tuple[float, int]:
        """Depth of the deepest contact point [m], and how many there are."""
        distances = [contact.dist for contact in self.data.contact]
        return -min([*distances, 0.0]), len(distances)


def _rotation(rpy: Triple) -> np.ndarray:
    c, s = np.cos(rpy), np.sin(rpy)
    X = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    Y = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    Z = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    return Z @ Y @ X


def _solid_xml(solid: Solid, k: int, grip: str) -> str:
    kind, *size = solid.shape
    if kind == "half_space":
        size, kind = [0.0, 0.0, 1.0], "plane"
    elif kind == "box":
        size = [0.5 * s for s in size]
    elif kind == "cylinder":
        size = [size[0], 0.5 * size[1]]
    x, y = _rotation(solid.rpy)[:, :2].T
    place = f'pos="{_text(solid.p)}" xyaxes="{_text(x)} {_text(y)}"'
    geom = f'<geom type="{kind}" size="{_text(size)}" {grip}'
    if solid.mass == 0.0:
        return f"{geom} {place}/>"
    joint = "<freejoint/>"
    if solid.axis is not None:
        joint = f'<joint name="slide{k}" type="slide" axis="{_text(solid.axis)}"/>'
    return f'<body {place}>{joint}{geom} mass="{solid.mass}"/></body>'


def _text(numbers) -> str:
    return " ".join(repr(float(x)) for x in numbers)
