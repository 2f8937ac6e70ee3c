"""Searches for large polytopes with certificates."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry.optimization import _cspace_options as options_of
from sheldrake.geometry.optimization._cspace_polynomials import Gram, Identity, affine, unit
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.solvers import MakeSolver, MathematicalProgram


class SearchResult:
    """A polytope {s | C s <= d, s_lower <= s <= s_upper} that is proven free of collisions."""

    _C: np.ndarray
    _d: np.ndarray

    def __init__(self) -> None:
        self._C, self._d = np.zeros((0, 0)), np.zeros(0)
        self._a: dict[int, np.ndarray] = {}
        self._b: dict[int, Any] = {}
        self._num_iter, self._polytope = 0, HPolyhedron()

    def C(self) -> np.ndarray:
        """Returns C, shape (m, n)."""
        return self._C.copy()

    def d(self) -> np.ndarray:
        """Returns d, shape (m,)."""
        return self._d.copy()

    def a(self) -> dict[int, np.ndarray]:
        """Returns a of each separating plane a x + b = 0, polynomials of shape (3,), by its index."""
        return dict(self._a)

    def b(self) -> dict[int, Any]:
        """Returns b of each separating plane, by its index."""
        return dict(self._b)

    def num_iter(self) -> int:
        """Returns in which round it was found."""
        return self._num_iter

    def certified_polytope(self) -> HPolyhedron:
        """Returns the polytope with the bounds of s."""
        return self._polytope


class Searches:
    """Searches of `CspaceFreePolytope`, by its certificates."""

    _s_lower: np.ndarray
    _s_upper: np.ndarray
    _planes: list
    _variables: list

    def _polytope(self, C: np.ndarray, d: np.ndarray) -> HPolyhedron:
        n = len(self._s_lower)
        A, b = np.vstack((C, np.eye(n), -np.eye(n))), np.concatenate((d, self._s_upper, -self._s_lower))
        keep = np.isfinite(b)
        return HPolyhedron(A[keep], b[keep])

    def _found(self, C: np.ndarray, d: np.ndarray, found: dict, num_iter: int) -> SearchResult:
        out = SearchResult()
        out._C, out._d, out._num_iter, out._polytope = C.copy(), d.copy(), num_iter, self._polytope(C, d)
        for certificate in found.values():
            out._a[certificate.plane_index], out._b[certificate.plane_index] = certificate.a, certificate.b
        return out

    def BinarySearch(
        self, ignored_collision_pairs: set, C: Any, d: Any, s_center: Any, options: options_of.BinarySearchOptions
    ) -> SearchResult | None:
        """Looks for the largest scale of a polytope about a point that has certificates.

        Args:
            ignored_collision_pairs: Pairs of ids that are left out.
            C: Shape (m, n); the polytope is {s | C s <= d, s_lower <= s <= s_upper}.
            d: Shape (m,).
            s_center: The point, in the polytope, shape (n,).
            options: How to search.

        Returns:
            The scaled polytope, or None if not even the smallest scale has certificates.

        Raises:
            RuntimeError: sizes differ, the point is not in the polytope, or the largest scale is below the smallest.
        """
        C, d = self._checked("BinarySearch", C, d)
        center = np.asarray(s_center, dtype=float).ravel()
        if not self._polytope(C, d).PointInSet(center):
            raise RuntimeError(f"BinarySearch(): s_center {center} is not in the polytope.")
        if not 0.0 < options.scale_min <= options.scale_max:
            raise RuntimeError(
                f"BinarySearch(): scale_min must be positive, and at most scale_max; they are {options.scale_min} and "
                f"{options.scale_max}."
            )

        def tried(scale: float, num_iter: int) -> SearchResult | None:
            scaled = C @ center + scale * (d - C @ center)
            success, found = self.FindSeparationCertificateGivenPolytope(
                C, scaled, ignored_collision_pairs, options.find_lagrangian_options
            )
            return self._found(C, scaled, found, num_iter) if success else None

        low, high = float(options.scale_min), float(options.scale_max)
        best = tried(high, 0)
        if best is not None:
            return best
        best = tried(low, 0)
        num_iter = 0
        while best is not None and num_iter < options.max_iter and high - low > options.convergence_tol:
            num_iter += 1
            middle = 0.5 * (low + high)
            better = tried(middle, num_iter)
            if better is None:
                high = middle
            else:
                low, best = middle, better
        if best is not None:
            best._num_iter = num_iter
        return best

    def SearchWithBilinearAlternation(
        self, ignored_collision_pairs: set, C_init: Any, d_init: Any, options: options_of.BilinearAlternationOptions
    ) -> list[SearchResult]:
        """Looks for certificates of a polytope, then for a larger polytope with their multipliers, and so on.

        Args:
            ignored_collision_pairs: Pairs of ids that are left out.
            C_init: Shape (m, n); the first polytope is {s | C s <= d, s_lower <= s <= s_upper}.
            d_init: Shape (m,).
            options: How to search.

        Returns:
            The polytopes of all rounds, each proven by its planes; none if the first polytope has no certificates.

        Raises:
            RuntimeError: sizes differ.
        """
        C, d = self._checked("SearchWithBilinearAlternation", C_init, d_init)
        out: list[SearchResult] = []
        ellipsoid = self._polytope(C, d).MaximumVolumeInscribedEllipsoid()
        for num_iter in range(options.max_iter):
            success, found = self.FindSeparationCertificateGivenPolytope(
                C, d, ignored_collision_pairs, options.find_lagrangian_options
            )
            larger = self._larger_polytope(C, d, found, ellipsoid, options) if success else None
            if larger is None:
                break
            larger._num_iter = num_iter
            out.append(larger)
            C, d, volume = larger._C, larger._d, ellipsoid.CalcVolume()
            ellipsoid = larger._polytope.MaximumVolumeInscribedEllipsoid()
            if ellipsoid.CalcVolume() - volume <= options.convergence_tol:
                break
        return out

    def _larger_polytope(
        self, C: np.ndarray, d: np.ndarray, found: dict, ellipsoid: Any, options: Any
    ) -> SearchResult | None:
        """C and d with the multipliers of `found`, faces far from the ellipsoid; or None."""
        how, center = options.find_polytope_options, ellipsoid.center()
        Q = options.ellipsoid_scaling * np.linalg.inv(ellipsoid.A())  # It is {Q u + center | |u| <= 1}.
        prog = MathematicalProgram()
        new_C, new_d = prog.NewContinuousVariables(*C.shape, "C"), prog.NewContinuousVariables(len(d), "d")
        margin = prog.NewContinuousVariables(len(d), "delta")
        prog.AddBoundingBoxConstraint(0.0, np.inf, margin)
        if how.s_inner_pts is not None:
            for point in np.asarray(how.s_inner_pts, dtype=float).T:
                for row, end in zip(new_C, new_d):
                    prog.AddLinearConstraint(np.append(point, -1.0)[None], [-np.inf], [0.0], np.append(row, end))
        n = len(center)
        for row, end, delta in zip(new_C, new_d, margin):
            # |Q c| <= d - c center - delta, and |c| <= 1.
            x = np.concatenate((row, [end, delta]))
            top = np.concatenate((-center, [1.0, -1.0]))
            prog.AddLorentzConeConstraint(np.vstack((top, np.hstack((Q.T, np.zeros((n, 2)))))), np.zeros(n + 1), x)
            prog.AddLorentzConeConstraint(np.vstack((np.zeros(n), np.eye(n))), np.append(1.0, np.zeros(n)), row)
        faces = self._faces(C, d, options.find_lagrangian_options.ignore_redundant_C)
        for certificate in found.values():
            self._impose_certificate(prog, certificate, faces, new_C, new_d, how.search_s_bounds_lagrangians)
        cost = self._add_margin_cost(prog, margin, how)
        solver = MakeSolver(how.solver_id)
        result = solver.Solve(prog, None, how.solver_options)
        if result.is_success() and how.backoff_scale is not None:
            least = result.get_optimal_cost()
            prog.RemoveCost(cost)
            a, x = cost.evaluator().a(), cost.variables()
            prog.AddLinearConstraint(a[None], [-np.inf], [least + how.backoff_scale * abs(least)], x)
            result = solver.Solve(prog, None, how.solver_options)
        if not result.is_success():
            return None
        out = SearchResult()
        out._C, out._d = result.GetSolution(new_C).reshape(C.shape), np.atleast_1d(result.GetSolution(new_d))
        out._polytope = self._polytope(out._C, out._d)
        for certificate in found.values():
            plane = self._planes[certificate.plane_index]
            out._a[certificate.plane_index] = np.array([result.GetSolution(p) for p in plane.a], dtype=object)
            out._b[certificate.plane_index] = result.GetSolution(plane.b)
        return out

    @staticmethod
    def _add_margin_cost(prog: MathematicalProgram, margin: np.ndarray, how: Any) -> Any:
        if how.ellipsoid_margin_cost is options_of.EllipsoidMarginCost.kSum:
            return prog.AddLinearCost(-np.ones(len(margin)), 0.0, margin)
        before = len(prog.linear_costs())
        m = len(margin)
        prog.AddMaximizeGeometricMeanCost(np.eye(m), np.full(m, how.ellipsoid_margin_epsilon), margin)
        return prog.linear_costs()[before]

    def _impose_certificate(
        self, prog: Any, certificate: Any, faces: list, new_C: np.ndarray, new_d: np.ndarray, search_bounds: bool
    ) -> None:
        """The identities of a plane, with the multipliers of faces of C fixed and those of bounds fixed or free."""
        size = len(self._variables)
        plane = self._planes[certificate.plane_index]
        prog.AddDecisionVariables(plane.decision_variables)
        bounds = self._faces(np.zeros((0, new_C.shape[1])), np.zeros(0), False)
        for rational, values in zip(self._rationals(certificate.plane_index), certificate._values):
            identity = Identity()
            identity.add_rows(rational.numerator, plane.decision_variables)
            for face, table in zip(faces, values):
                if face.kind == "polytope":
                    row, end = new_C[face.index], new_d[face.index]
                    for key, x in table.items():
                        identity.add(end, key, -x)
                        for k, c in enumerate(row):
                            identity.add(c, tuple(p + q for p, q in zip(key, unit(size, k))), x)
                elif not search_bounds:
                    for key, x in table.items():
                        for other, y in face.slack.items():
                            place = tuple(p + q for p, q in zip(key, other))
                            identity.add_numbers({place: -x * y})
            if search_bounds:
                for face in bounds:
                    identity.add_gram(Gram(prog, rational.groups), {key: -x for key, x in face.slack.items()})
            identity.add_gram(Gram(prog, rational.groups), affine(size, -1.0, []))
            identity.impose(prog)
