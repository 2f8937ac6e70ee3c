"""The law of a contact under the chosen approximation."""

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.lagged import lagged_cost, lagged_impulse
from sheldrake.multibody.contact_solvers._kernels.problem import (
    APPROXIMATION,
    BACK,
    DISSIPATION,
    DT,
    EPS,
    FE0,
    FRICTION,
    LAGGED,
    N0,
    R_N,
    R_T,
    SIMILAR,
    STIFFNESS,
    VHAT_N,
)
from sheldrake.multibody.contact_solvers._kernels.sap_cone import sap_cone_cost, sap_cone_impulse
from sheldrake.multibody.contact_solvers._kernels.similar import similar_cost, similar_impulse


@kernel
def contact_impulse(model, law, c, vc):
    """Impulse gamma [N s] and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz) of contact c at velocity vc [m/s]."""
    dt = model.option[DT]
    mu = law[c, FRICTION]
    kind = model.setting[APPROXIMATION]
    if kind == LAGGED:
        return lagged_impulse(
            law[c, STIFFNESS], law[c, DISSIPATION], mu, law[c, FE0], law[c, BACK], law[c, N0], law[c, EPS], dt, vc
        )
    if kind == SIMILAR:
        return similar_impulse(
            law[c, STIFFNESS], law[c, DISSIPATION], mu, law[c, FE0], law[c, BACK], law[c, EPS], dt, vc
        )
    return sap_cone_impulse(mu, law[c, R_T], law[c, R_N], law[c, VHAT_N], vc)


@kernel
def contact_cost(model, law, c, vc):
    """Cost l(vc) of contact c [J]."""
    dt = model.option[DT]
    mu = law[c, FRICTION]
    kind = model.setting[APPROXIMATION]
    if kind == LAGGED:
        return lagged_cost(
            law[c, STIFFNESS], law[c, DISSIPATION], mu, law[c, FE0], law[c, BACK], law[c, N0], law[c, EPS], dt, vc
        )
    if kind == SIMILAR:
        return similar_cost(law[c, STIFFNESS], law[c, DISSIPATION], mu, law[c, FE0], law[c, BACK], law[c, EPS], dt, vc)
    return sap_cone_cost(mu, law[c, R_T], law[c, R_N], law[c, VHAT_N], vc)
