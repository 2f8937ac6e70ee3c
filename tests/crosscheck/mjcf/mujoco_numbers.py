"""A plant against what MuJoCo makes of its MJCF: masses, inertias, limits, armature, kinematics, geometry."""

from __future__ import annotations

import numpy as np

from sheldrake.cad._mesh_files import _as_obj
from sheldrake.math import RigidTransform, RotationMatrix

LENGTH = 1e-9  # [m] poses of ten to forty bodies in a row, and MuJoCo normalises each quaternion
MESH = 2e-6  # of the size of a mesh: MuJoCo keeps vertices in single precision
LEAST = 1e-11  # what the file gives to moving bodies without mass [kg], [kg m²]


def faults(plant, scene_graph, model, data, states=3, seed=1):
    """Returns texts, one for each thing in which MuJoCo's model of a plant is not the plant."""
    found = _faults_of_inertias(plant, model)
    context, rng = plant.CreateDefaultContext(), np.random.default_rng(seed)
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    found += [text for joint in joints for text in _faults_of_joint(joint, model)]
    for _ in range(states):
        _set_random_state(joints, plant, context, model, data, rng)
        found += _faults_of_poses(plant, context, model, data)
        found += _faults_of_masses(plant, context, model, data) if _same_velocities(joints) else []
    if scene_graph is not None:
        found += _faults_of_geometry(plant, scene_graph.model_inspector(), model)
    return found


def _name(plant, body):
    return "world" if body.index() == plant.world_body().index() else body.name()


def _bodies(plant):
    from sheldrake.multibody.tree import BodyIndex

    return [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]


def _faults_of_inertias(plant, model):
    found = []
    if model.nbody != plant.num_bodies():
        found.append(f"{model.nbody} bodies instead of {plant.num_bodies()}")
    for body in _bodies(plant):
        twin = model.body(body.name())
        M = body.default_spatial_inertia()
        if abs(twin.mass[0] - M.get_mass()) > 1e-12 * M.get_mass() + LEAST:
            found.append(f"mass of {body.name()}: {twin.mass[0]} instead of {M.get_mass()}")
        if M.get_mass() == 0.0:
            continue
        I = M.Shift(M.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
        R = _rotation(twin.iquat).matrix()
        I_twin = R @ np.diag(twin.inertia) @ R.T
        if np.abs(I_twin - I).max() > 1e-9 * np.abs(I).max() + LEAST:
            found.append(f"inertia of {body.name()}")
        if np.abs(twin.ipos - M.get_com()).max() > 1e-12:
            found.append(f"centre of mass of {body.name()}")
    return found


def _rotation(wxyz):
    from sheldrake.common.eigen_geometry import Quaternion

    wxyz = np.asarray(wxyz, dtype=float)
    return RotationMatrix(Quaternion(wxyz / np.linalg.norm(wxyz)))


def _faults_of_joint(joint, model):
    found, kind = [], joint.type_name()
    if kind not in ("revolute", "prismatic"):
        return found
    twin = model.joint(joint.name())
    lower, upper = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
    is_limited = np.isfinite(lower) or np.isfinite(upper)
    if bool(twin.limited[0]) != is_limited:
        found.append(f"whether {joint.name()} is limited")
    elif is_limited and np.abs(twin.range - np.clip([lower, upper], -1e10, 1e10)).max() > 1.1e-9:
        found.append(f"limits of {joint.name()}: {twin.range} instead of {lower}, {upper}")
    if abs(twin.damping[0] - joint.default_damping_vector()[0]) > 0.0:
        found.append(f"damping of {joint.name()}")
    return found


def _same_velocities(joints):
    """Whether both count velocities of joints alike; a ball's and a free body's are others."""
    return all(joint.type_name() in ("revolute", "prismatic", "weld", "quaternion_floating") for joint in joints)


def _set_random_state(joints, plant, context, model, data, rng):
    import mujoco

    for joint in joints:
        kind = joint.type_name()
        if kind in ("revolute", "prismatic"):
            q = rng.uniform(-1.0, 1.0)
            plant.SetPositions(context, _with(plant, context, joint, [q]))
            data.joint(joint.name()).qpos[0] = q
        elif kind == "quaternion_floating":
            wxyz, p = rng.normal(size=4), rng.uniform(-1.0, 1.0, 3)
            wxyz /= np.linalg.norm(wxyz)
            plant.SetPositions(context, _with(plant, context, joint, [*wxyz, *p]))
            data.joint(joint.child_body().name()).qpos[:] = [*p, *wxyz]
        elif kind == "ball_rpy":
            from sheldrake.math import RollPitchYaw

            rpy = rng.uniform(-1.0, 1.0, 3)
            plant.SetPositions(context, _with(plant, context, joint, rpy))
            R_CM = joint.frame_on_child().GetFixedPoseInBodyFrame().rotation()
            R_FM = RollPitchYaw(rpy).ToRotationMatrix()  # MuJoCo turns in the frame of the child
            data.joint(joint.name()).qpos[:] = (R_CM @ R_FM @ R_CM.inverse()).ToQuaternion().wxyz()
        elif kind in ("planar", "universal"):
            q = rng.uniform(-1.0, 1.0, 3 if kind == "planar" else 2)
            plant.SetPositions(context, _with(plant, context, joint, q))
            for number, value in enumerate(q):
                data.joint(f"{joint.name()}_{number + 1}").qpos[0] = value
    mujoco.mj_forward(model, data)


def _with(plant, context, joint, values):
    q = np.array(plant.GetPositions(context))
    start = joint.position_start()
    q[start : start + len(values)] = values
    return q


def _faults_of_poses(plant, context, model, data):
    found = []
    for body in _bodies(plant):
        X_WB, twin = plant.EvalBodyPoseInWorld(context, body), data.body(body.name())
        difference = np.abs(twin.xpos - X_WB.translation()).max()
        difference = max(difference, np.abs(twin.xmat.reshape(3, 3) - X_WB.rotation().matrix()).max())
        if difference > LENGTH:
            found.append(f"pose of {body.name()}: {difference:.1e}")
    return found


def _faults_of_masses(plant, context, model, data):
    """Mass matrices, MuJoCo's in the velocities of the plant (a free body's: angular first, both in the world)."""
    import mujoco

    M_twin = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, M_twin, data.qM)
    except (AttributeError, TypeError):
        mujoco.mj_fullM(model, data, M_twin)
    T = np.zeros((model.nv, plant.num_velocities()))  # MuJoCo's velocities of the plant's
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        start = joint.velocity_start()
        if joint.type_name() == "quaternion_floating":
            at = model.joint(joint.child_body().name()).dofadr[0]
            R_WB = plant.EvalBodyPoseInWorld(context, joint.child_body()).rotation().matrix()
            T[at : at + 3, start + 3 : start + 6] = np.eye(3)
            T[at + 3 : at + 6, start : start + 3] = R_WB.T
        elif joint.num_velocities() == 1:
            T[model.joint(joint.name()).dofadr[0], start] = 1.0
    M = plant.CalcMassMatrix(context)
    difference = np.abs(T.T @ M_twin @ T - M).max() / np.abs(M).max()
    return [f"mass matrix: {difference:.1e}"] if difference > 1e-8 else []


def _faults_of_geometry(plant, inspector, model):
    found, number = [], 0
    twins = {model.geom(i).name: model.geom(i) for i in range(model.ngeom)}
    for body in [plant.world_body(), *_bodies(plant)]:
        ids = plant.GetVisualGeometriesForBody(body), plant.GetCollisionGeometriesForBody(body)
        own = [geom for geom in twins.values() if geom.bodyid[0] == model.body(_name(plant, body)).id]
        wanted = [(i, role) for role, geometries in enumerate(ids) for i in geometries]
        number += len(wanted)
        if len(own) != len(wanted):
            found.append(f"{len(own)} geometries of {body.name()} instead of {len(wanted)}")
            continue
        for (geometry_id, role), geom in zip(wanted, own):
            name, shape = inspector.GetName(geometry_id), inspector.GetShape(geometry_id)
            if bool(geom.contype[0]) != bool(role):
                found.append(f"role of {name}")
            text = _fault_of_shape(shape, inspector.GetPoseInFrame(geometry_id), geom, model)
            found += [f"{name}: {text}"] if text else []
    return found


def _fault_of_shape(shape, X_BG, geom, model):
    kind = type(shape).__name__
    X_twin = RigidTransform(_rotation(geom.quat), np.asarray(geom.pos))
    if kind in ("Mesh", "Convex"):
        return _fault_of_mesh(shape, X_BG, X_twin, model.mesh(geom.dataid[0]), model)
    expected = {
        "Box": lambda: np.asarray(shape.size()) / 2.0,
        "Sphere": lambda: [shape.radius()],
        "Cylinder": lambda: [shape.radius(), shape.length() / 2.0],
        "Capsule": lambda: [shape.radius(), shape.length() / 2.0],
        "Ellipsoid": lambda: [shape.a(), shape.b(), shape.c()],
        "HalfSpace": lambda: [0.0, 0.0],
    }[kind]()
    if np.abs(geom.size[: len(expected)] - expected).max() > 1e-12:
        return f"size {geom.size} instead of {expected}"
    return "" if X_twin.IsNearlyEqualTo(X_BG, 1e-9) else "pose"


def _fault_of_mesh(shape, X_BG, X_twin, mesh, model):
    """Bounds of vertices: MuJoCo moves a mesh into its inertia's frame, and joins vertices that are equal.

    Vertices that no face has count in some formats and not in others, in MuJoCo.
    """
    first = mesh.vertadr[0]
    p_twin = _moved(X_twin, model.mesh_vert[first : first + mesh.vertnum[0]])
    lines = [line.split() for line in _as_obj(shape.source()).decode().splitlines()]
    every = np.array([words[1:] for words in lines if words[0] == "v"], dtype=float)
    used = every[np.unique([int(n) - 1 for words in lines if words[0] == "f" for n in words[1:]])]
    off = []
    for vertices in (every, used):
        p = _moved(X_BG, vertices * np.asarray(shape.scale3()))
        corners = [np.abs(f(p, axis=0) - f(p_twin, axis=0)).max() for f in (np.min, np.max)]
        off.append(max(corners) / np.ptp(p, axis=0).max())
    return "" if min(off) < MESH else f"mesh is off by {min(off):.1e} of its size"


def _moved(X, points):
    return np.asarray(points, dtype=float) @ X.rotation().matrix().T + X.translation()
