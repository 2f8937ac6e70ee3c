"""Free bodies that spin faster than the time step resolves: what explicit Euler makes of them is kept finite.

The gyroscopic torque w x (I w) is taken at the start of the step, as Drake takes it. That adds (dt |w|)^2 of the energy
of a tumbling body in each step, so that one that turns by more than some tenths of a radian a step is soon infinitely
fast. There is nothing right about such a motion; with less of the torque the faster it turns, it stays a motion.
Steps that do not settle have Drake's numbers, to infinity.

Quaternions are not normalized, either: explicit Euler makes them longer by half the square of half the angle, and those
of what spins so fast would overflow.
"""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, load_inertia, mul_inertia, scale3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.tree._kernels.model import FREE, KIND, QUATERNION, Q, V

LONG = np.float64(1e6)  # square of the length of a quaternion that needs shortening
RESOLVED = np.float64(0.2)  # angle of a step that is left as it is [rad]


@kernel
def hold_back_gyroscopic_torques(tree_model, tree, dt):
    """Takes away some of the gyroscopic torque about the centre of mass, in `bias`, of bodies that spin so fast."""
    for body in range(1, tree_model.body.shape[0]):
        if tree_model.body[body, KIND] == FREE:
            w = load3(tree.V, body)
            angle2 = dt * dt * dot3(w, w)
            if angle2 > RESOLVED * RESOLVED:
                I = load_inertia(tree.inertia, body)
                mass, first_moment, _ = I
                momentum, _ = mul_inertia(I, (w, (0.0, 0.0, 0.0)))  # about the origin
                momentum = add3(momentum, scale3(cross3(first_moment, cross3(first_moment, w)), 1.0 / mass))
                x, y, z = scale3(cross3(w, momentum), 1.0 - RESOLVED * RESOLVED / angle2)
                dof = tree_model.body[body, V]
                tree.bias[dof] -= x
                tree.bias[dof + 1] -= y
                tree.bias[dof + 2] -= z


@kernel
def shorten_quaternions(tree_model, q):
    """Makes quaternions that have grown very long unit quaternions; the rotation they stand for stays."""
    for body in range(1, tree_model.body.shape[0]):
        kind = tree_model.body[body, KIND]
        if kind == FREE or kind == QUATERNION:
            at = tree_model.body[body, Q]
            length2 = q[at] * q[at] + q[at + 1] * q[at + 1] + q[at + 2] * q[at + 2] + q[at + 3] * q[at + 3]
            if length2 > LONG:
                scale = 1.0 / sqrt(length2)
                for k in range(at, at + 4):
                    q[k] *= scale
