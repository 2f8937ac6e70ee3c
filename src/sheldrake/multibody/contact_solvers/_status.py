"""What a solver's status means and what to try."""

from __future__ import annotations

from sheldrake.multibody.contact_solvers._kernels import problem as codes

_TEXT = {
    codes.ITERATION_LIMIT: (
        "the contact solver has not converged within its limit of iterations. Try a smaller time step, less "
        "extreme ratios of mass or stiffness, or another contact approximation (set_discrete_contact_approximation)."
    ),
    codes.LINE_SEARCH_FAILED: (
        "the line search of the contact solver found no minimum. This happens when the state holds NaN or when masses "
        "or stiffnesses differ by more than about ten orders of magnitude; check the state and the contact parameters."
    ),
    codes.HESSIAN_NOT_POSITIVE: (
        "the contact problem is not positive definite. A body or joint is without mass or inertia, or the state holds "
        "NaN; check the inertias and the state."
    ),
    codes.FACTOR_CAPACITY: (
        "the bodies in contact are too many for one factorisation. Split the scene or reduce the number of bodies that "
        "touch each other."
    ),
    codes.CONTACT_CAPACITY: (
        "there are more contact points than room was made for, and none is dropped silently. Try 'single_point' "
        "contact, collision filters, or fewer overlapping geometries."
    ),
    codes.ROW_CAPACITY: "there are more joint limits and constraints than room was made for.",
    codes.TAMSI_FAILED: (
        "TAMSI has not converged, even with 20 sub-steps. Try a smaller time step or another contact approximation, "
        "such as kLagged."
    ),
    codes.MASS_NOT_POSITIVE: (
        "the mass matrix is not positive definite. A free body, or the last body of a chain, is without mass or "
        "without inertia about its joint; give it some or weld it. The same is said when the state holds NaN."
    ),
    codes.MOTION_NOT_FINITE: "a force, an inertia or a parameter is infinite or NaN.",
    codes.UNSUPPORTED_PAIR: (
        "two geometries overlap whose kinds cannot yet touch each other. Filter their collisions, or use other shapes."
    ),
}


SOLVE_FAILURES = (
    codes.ITERATION_LIMIT,
    codes.LINE_SEARCH_FAILED,
    codes.HESSIAN_NOT_POSITIVE,
    codes.FACTOR_CAPACITY,
    codes.TAMSI_FAILED,
)
"""What can go wrong while an island of bodies is solved."""


def explain_solver_status(status: int) -> str:
    """What went wrong and what to try, as the end of a sentence; an empty string for 0 and for codes of others."""
    return _TEXT.get(status, "")
