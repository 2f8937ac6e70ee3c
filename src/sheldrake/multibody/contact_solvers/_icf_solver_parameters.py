"""Settings of the convex solver in an integrator."""

from __future__ import annotations

from sheldrake.common._options import Options


class IcfSolverParameters(Options):
    """Settings of the solver of convex contact problems ("irrotational contact fields").

    Our solver uses `max_iterations` and `min_tolerance`; the other fields are there for scripts that set them. It
    factorises in every iteration, always sparsely, and tries the full step before it searches along a line.

    Args:
        max_iterations: Most Newton iterations of a step.
        min_tolerance: Residual at which iterations stop, relative to momentum and impulse; with error control they stop
            at a thousandth of the accuracy, if that is more.
        enable_hessian_reuse: Not used.
        hessian_reuse_target_iterations: Not used.
        use_dense_algebra: Not used.
        max_linesearch_iterations: Not used.
        linesearch_tolerance: Not used.
        alpha_max: Not used.
        print_solver_stats: Not used.
    """

    max_iterations: int = 100
    min_tolerance: float = 1e-8
    enable_hessian_reuse: bool = False
    hessian_reuse_target_iterations: int = 10
    use_dense_algebra: bool = False
    max_linesearch_iterations: int = 100
    linesearch_tolerance: float = 1e-8
    alpha_max: float = 1.0
    print_solver_stats: bool = False
