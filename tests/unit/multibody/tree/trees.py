"""Random trees for tests of the kernels, and a slow dense reference that shares nothing with them but the layout."""

import numpy as np

from sheldrake.multibody.tree._compile import Mobilizer, TreeDescription, compile_tree
from sheldrake.multibody.tree._joint_types import JOINT_TYPES

ALL_TYPES = tuple(JOINT_TYPES)


def random_rotation(rng):
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return R * np.linalg.det(R)


def random_tree(rng, num_bodies, types=ALL_TYPES, offset_M=True, actuators=False):
    """(description, model, p, nq, nv) of bodies with random joints, in depth-first order."""
    d, p = TreeDescription(), []

    def put(*numbers):
        p.extend(numbers)
        return len(p) - len(numbers)

    def frame():
        parent = fixed_frame() if rng.random() < 0.3 else -1
        return fixed_frame(parent)

    def fixed_frame(parent=-1):
        d.frames.append((parent, put(*random_rotation(rng).ravel(), *rng.normal(size=3))))
        return len(d.frames) - 1

    path = [0]
    for row in range(1, num_bodies + 1):
        path = path[: rng.integers(1, len(path) + 1)]
        kind = rng.choice(types)
        c, A = rng.normal(size=3) * 0.3, rng.normal(size=(3, 3))
        G = A @ A.T
        G = np.trace(G) * np.eye(3) - G + c @ c * np.eye(3) - np.outer(c, c)
        axis = rng.normal(size=3) if rng.random() < 0.5 else rng.choice((-1.0, 1.0)) * np.eye(3)[rng.integers(3)]
        axis /= np.linalg.norm(axis)
        lead = {"prismatic": 1.0, "screw": 0.3}.get(kind, 0.0)
        constants = (*random_rotation(rng).ravel(), *rng.normal(size=3)) if kind == "weld" else (*axis, lead)
        pieces = random_path(rng) if kind == "curvilinear" else []
        if pieces:
            constants = (*random_rotation(rng).ravel(), *rng.normal(size=3))
        free = kind == "quaternion_floating" and path[-1] == 0 and rng.random() < 0.7
        damping = tuple(put(rng.random()) for _ in range(len(JOINT_TYPES[kind].velocities)))
        d.mobilizers.append(
            Mobilizer(
                parent=path[-1], type_name=kind,
                inertia=put(rng.uniform(0.5, 2), *c, G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2]),
                frame_F=-1 if free or rng.random() < 0.2 else frame(),
                frame_M=-1 if free or not offset_M or rng.random() < 0.5 else frame(),
                constants=constants, path=pieces, damping=damping, gravity=(0.0, 0.0, -9.81),
            )
        )  # fmt: skip
        path.append(row)
    nq = sum(len(JOINT_TYPES[b.type_name].positions) for b in d.mobilizers)
    nv = sum(len(JOINT_TYPES[b.type_name].velocities) for b in d.mobilizers)
    if actuators:
        d.actuators = [(k, put(rng.random()), put(rng.normal())) for k in range(0, nv, 2)]
    return d, compile_tree(d), np.array(p), nq, nv


def random_path(rng):
    """Pieces of a path whose tangents are those of the ends of the pieces before."""
    s, X, pieces = 0.0, np.eye(4), []
    for rate in (rng.normal(), 0.0, rng.normal()):
        pieces.append((s, rate, X[0, 3], X[1, 3], X[0, 0], X[1, 0], 0.0))
        length = rng.uniform(0.1, 0.8)
        s, X = s + length, X @ along_arc(rate, length)
    return pieces


def along_arc(rate, length):
    z = np.array([0.0, 0.0, 1.0])
    if rate == 0.0:
        return move([length, 0, 0])
    return move([0, 1 / rate, 0]) @ about(z, rate * length) @ move([0, -1 / rate, 0])


def pose(numbers):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = np.reshape(numbers[:9], (3, 3)), numbers[9:12]
    return X


def frame_pose(d, p, frame):
    X = np.eye(4)
    while frame >= 0:
        parent, at = d.frames[frame]
        X, frame = pose(p[at : at + 12]) @ X, parent
    return X


def cross_matrix(a):
    return np.cross(np.eye(3), np.asarray(a, float))


def about(axis, angle):
    X, K = np.eye(4), cross_matrix(axis)
    X[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return X


def move(p):
    X = np.eye(4)
    X[:3, 3] = p
    return X


def joint_pose(mobilizer, q):
    x, y, z = np.eye(3)
    kind, c = mobilizer.type_name, np.array(mobilizer.constants)
    if kind == "weld":
        return pose(c)
    if kind == "curvilinear":
        start, rate, px, py, cosine, sine, _ = [b for i, b in enumerate(mobilizer.path) if not i or b[0] <= q[0]][-1]
        return pose(c) @ move([px, py, 0]) @ about(z, np.arctan2(sine, cosine)) @ along_arc(rate, q[0] - start)
    if kind == "revolute":
        return about(c[:3], q[0])
    if kind == "prismatic":
        return move(c[:3] * q[0])
    if kind == "screw":
        return move(c[:3] * c[3] * q[0]) @ about(c[:3], q[0])
    if kind == "quaternion_floating":
        X, K = move(q[4:]), cross_matrix(q[1:4])
        X[:3, :3] += 2 * (q[0] * K + K @ K) / (q[:4] @ q[:4])
        return X
    if kind == "rpy_floating":
        return move(q[3:]) @ about(z, q[2]) @ about(y, q[1]) @ about(x, q[0])
    if kind == "ball_rpy":
        return about(z, q[2]) @ about(y, q[1]) @ about(x, q[0])
    if kind == "planar":
        return move([q[0], q[1], 0]) @ about(z, q[2])
    return about(x, q[0]) @ about(y, q[1])


def body_poses(d, p, q):
    """Homogeneous poses by multiplying matrices."""
    X, at = [np.eye(4)], 0
    for b in d.mobilizers:
        n = len(JOINT_TYPES[b.type_name].positions)
        X_FM = joint_pose(b, q[at : at + n])
        X.append(X[b.parent] @ frame_pose(d, p, b.frame_F) @ X_FM @ np.linalg.inv(frame_pose(d, p, b.frame_M)))
        at += n
    return X
