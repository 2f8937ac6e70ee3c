"""Masses of a cart and pole: symbolic inverse dynamics, taken apart by `DecomposeLumpedParameters`, least squares."""

import _robots as robots
import numpy as np
import pydrake.symbolic as sym
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces, MultibodyForces_


def program():
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    eng = plant.ToSymbolic()
    c = eng.CreateDefaultContext()
    q, v, vd = (sym.MakeVectorVariable(2, n) for n in ("q", "v", "vd"))
    m1, m2 = sym.Variable("m1"), sym.Variable("m2")
    one, two = (eng.GetBodyByName(n) for n in ("cart", "pole"))
    one.SetMass(c, m1)  # type: ignore  # annotations speak of floats; a context of symbols takes symbols
    two.SetMass(c, m2)  # type: ignore
    eng.SetPositionsAndVelocities(c, np.r_[q, v])

    f = MultibodyForces_[sym.Expression](eng)
    eng.CalcForceElementsContribution(c, f)
    tau = eng.CalcInverseDynamics(c, vd, f)
    err = list(tau)
    W, alpha, w0 = sym.DecomposeLumpedParameters(err, [m1, m2])
    rng = np.random.default_rng(2)
    cd = plant.CreateDefaultContext()
    rows, rhs = [], []

    forces = MultibodyForces(plant)
    for _ in range(20):
        x = rng.normal(size=6)
        plant.SetPositionsAndVelocities(cd, x[:4])
        plant.CalcForceElementsContribution(cd, forces)
        t = plant.CalcInverseDynamics(cd, x[4:], forces)
        env = dict(zip(np.r_[q, v, vd], x))
        Wk = sym.Evaluate(W, env)
        w0k = sym.Evaluate(w0, env)
        rows.append(Wk)
        rhs.append(t - w0k.ravel())
    sol, _, _, sv = np.linalg.lstsq(np.vstack(rows), np.concatenate(rhs), rcond=None)
    truth = {m1: 10.0, m2: 1.0}
    a = sym.Evaluate(np.asarray(alpha).reshape(-1, 1), truth).ravel()
    return np.sort(sol), np.sort(a), np.sort(sv)[-1]


for _ in range(5):
    program()
