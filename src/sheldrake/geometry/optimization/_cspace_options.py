"""Options of searches for collision-free polytopes in s."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from sheldrake.common import Parallelism
from sheldrake.common._enums import BoundEnum
from sheldrake.common._options import Options
from sheldrake.solvers import ClarabelSolver, SolverOptions


class FindSeparationCertificateOptions(Options):
    """How certificates are looked for.

    Attributes:
        parallelism: Of no effect: pairs are looked at one after the other.
        verbose: Whether it says how each pair went.
        solver_id: The solver of semidefinite programs.
        terminate_at_failure: Whether the first pair without a certificate ends the search.
        solver_options: Options of the solver.
    """

    _fields: ClassVar[tuple[tuple[str, Any, Any], ...]] = (
        ("parallelism", Any, None),
        ("verbose", bool, False),
        ("solver_id", Any, None),
        ("terminate_at_failure", bool, True),
        ("solver_options", SolverOptions | None, None),
    )

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        if self.parallelism is None:
            self.parallelism = Parallelism.Max()
        if self.solver_id is None:
            self.solver_id = ClarabelSolver.id()


class FindSeparationCertificateGivenPolytopeOptions(FindSeparationCertificateOptions):
    """How certificates for a polytope C s <= d are looked for.

    Attributes:
        ignore_redundant_C: Whether rows of C that follow from the others have no multipliers.
    """

    _fields: ClassVar[tuple[tuple[str, Any, Any], ...]] = (
        *FindSeparationCertificateOptions._fields,
        ("ignore_redundant_C", bool, False),
    )


class EllipsoidMarginCost(BoundEnum):
    """What is made large: the sum, or the geometric mean, of the distances of faces to an ellipsoid."""

    kSum = 0
    kGeometricMean = 1


class FindPolytopeGivenLagrangianOptions(Options):
    """How a polytope is looked for when the multipliers of its faces are fixed.

    Attributes:
        backoff_scale: If given, the objective may be worse by this part, and any such polytope is taken.
        ellipsoid_margin_epsilon: What is added to margins in the geometric mean.
        solver_id: The solver.
        solver_options: Options of the solver.
        s_inner_pts: Points that are to be in the polytope, as columns, or None.
        search_s_bounds_lagrangians: Whether the multipliers of bounds of s are looked for again.
        ellipsoid_margin_cost: What is made large.
    """

    _fields = (
        ("backoff_scale", Any, None),
        ("ellipsoid_margin_epsilon", float, 1e-5),
        ("solver_id", Any, None),
        ("solver_options", SolverOptions | None, None),
        ("s_inner_pts", np.ndarray | None, None),
        ("search_s_bounds_lagrangians", bool, True),
        ("ellipsoid_margin_cost", EllipsoidMarginCost, EllipsoidMarginCost.kGeometricMean),
    )

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        if self.solver_id is None:
            self.solver_id = ClarabelSolver.id()


class BilinearAlternationOptions(Options):
    """How certificates and polytopes are looked for in turn.

    Attributes:
        max_iter: Most rounds.
        convergence_tol: The search ends where the volume of the inscribed ellipsoid grows by less than this.
        find_polytope_options: For polytopes.
        find_lagrangian_options: For certificates.
        ellipsoid_scaling: What part of the inscribed ellipsoid the next polytope contains.
    """

    _fields = (
        ("max_iter", int, 10),
        ("convergence_tol", float, 1e-3),
        ("find_polytope_options", FindPolytopeGivenLagrangianOptions, None),
        ("find_lagrangian_options", FindSeparationCertificateGivenPolytopeOptions, None),
        ("ellipsoid_scaling", float, 0.99),
    )

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        if self.find_polytope_options is None:
            self.find_polytope_options = FindPolytopeGivenLagrangianOptions()
        if self.find_lagrangian_options is None:
            self.find_lagrangian_options = FindSeparationCertificateGivenPolytopeOptions()


class BinarySearchOptions(Options):
    """How the largest scale of a polytope is looked for.

    Attributes:
        scale_max: The largest scale that is tried.
        scale_min: The smallest one.
        max_iter: Most bisections.
        convergence_tol: The search ends where the scale is known to this.
        find_lagrangian_options: For certificates.
    """

    _fields = (
        ("scale_max", float, 1.0),
        ("scale_min", float, 0.01),
        ("max_iter", int, 10),
        ("convergence_tol", float, 1e-3),
        ("find_lagrangian_options", FindSeparationCertificateGivenPolytopeOptions, None),
    )

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        if self.find_lagrangian_options is None:
            self.find_lagrangian_options = FindSeparationCertificateGivenPolytopeOptions()
