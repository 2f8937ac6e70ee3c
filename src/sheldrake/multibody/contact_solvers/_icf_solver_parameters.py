"""Settings of the convex solver in an integrator."""

from __future__ import annotations

from types import SimpleNamespace

_DEFAULTS = {
    "max_iterations": 100,
    "min_tolerance": 1e-8,
    "enable_hessian_reuse": False,
    "hessian_reuse_target_iterations": 10,
    "use_dense_algebra": False,
    "max_linesearch_iterations": 100,
    "linesearch_tolerance": 1e-8,
    "alpha_max": 1.0,
    "print_solver_stats": False,
}


class IcfSolverParameters:
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

    __fields__ = tuple(SimpleNamespace(name=name, type=type(value)) for name, value in _DEFAULTS.items())

    max_iterations: int
    min_tolerance: float

    def __init__(self, **kwargs: object):
        self.__dict__.update(_DEFAULTS)
        for name, value in kwargs.items():
            if name not in _DEFAULTS:
                raise AttributeError(f"IcfSolverParameters has no field {name!r}; it has {', '.join(_DEFAULTS)}.")
            setattr(self, name, value)

    def __repr__(self) -> str:
        return f"IcfSolverParameters({', '.join(f'{name}={getattr(self, name)!r}' for name in _DEFAULTS)})"

    def __copy__(self) -> IcfSolverParameters:
        return IcfSolverParameters(**{name: getattr(self, name) for name in _DEFAULTS})

    def __deepcopy__(self, memo: dict) -> IcfSolverParameters:
        return self.__copy__()
