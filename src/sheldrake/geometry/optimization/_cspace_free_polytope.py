"""Polytopes of tan of half angles that are proven free of collisions (C-IRIS)."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sheldrake.common import Parallelism
from sheldrake.common._checked import checked
from sheldrake.common._enums import NumberEnum
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._options import Options
from sheldrake.common._options import Options as _Options
from sheldrake.geometry.optimization import _cspace_certificates as certificates
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._cspace_certificates import (
    Face,
    Gram,
    Identity,
    SeparationCertificateProgram,
    affine,
    polynomial_of,
    unit,
)
from sheldrake.geometry.optimization._cspace_geometries import (
    CIrisCollisionGeometry,
    CSpaceSeparatingPlane,
    CSpaceSeparatingPlane_,
    SeparatingPlaneOrder,
)
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.multibody.rational import RationalForwardKinematics
from sheldrake.solvers import ClarabelSolver, MakeSolver, MathematicalProgram, SolverId, SolverOptions
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry import GeometryId
    from sheldrake.geometry._scene_graph import SceneGraph
    from sheldrake.geometry.optimization import Hyperellipsoid
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.solvers._functions.costs import LinearCost

# ---- options


class FindSeparationCertificateOptions(Options):
    """How certificates are looked for.

    Attributes:
        parallelism: Of no effect: pairs are looked at one after the other.
        verbose: Whether it says how each pair went.
        solver_id: The solver of semidefinite programs.
        terminate_at_failure: Whether the first pair without a certificate ends the search.
        solver_options: Options of the solver.
    """

    parallelism: Parallelism = Parallelism.Max()
    verbose: bool = False
    solver_id: SolverId = ClarabelSolver.id()
    terminate_at_failure: bool = True
    solver_options: SolverOptions | None = None


class FindSeparationCertificateGivenPolytopeOptions(FindSeparationCertificateOptions):
    """How certificates for a polytope C s <= d are looked for.

    Attributes:
        ignore_redundant_C: Whether rows of C that follow from the others have no multipliers.
    """

    ignore_redundant_C: bool = False


class EllipsoidMarginCost(NumberEnum):
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

    backoff_scale: float | None = None
    ellipsoid_margin_epsilon: float = 1e-5
    solver_id: SolverId = ClarabelSolver.id()
    solver_options: SolverOptions | None = None
    s_inner_pts: np.ndarray | None = None
    search_s_bounds_lagrangians: bool = True
    ellipsoid_margin_cost: EllipsoidMarginCost = EllipsoidMarginCost.kGeometricMean


class BilinearAlternationOptions(Options):
    """How certificates and polytopes are looked for in turn.

    Attributes:
        max_iter: Most rounds.
        convergence_tol: The search ends where the volume of the inscribed ellipsoid grows by less than this.
        find_polytope_options: For polytopes.
        find_lagrangian_options: For certificates.
        ellipsoid_scaling: What part of the inscribed ellipsoid the next polytope contains.
    """

    max_iter: int = 10
    convergence_tol: float = 1e-3
    find_polytope_options: FindPolytopeGivenLagrangianOptions = FindPolytopeGivenLagrangianOptions()
    find_lagrangian_options: FindSeparationCertificateGivenPolytopeOptions = (
        FindSeparationCertificateGivenPolytopeOptions()
    )
    ellipsoid_scaling: float = 0.99


class BinarySearchOptions(Options):
    """How the largest scale of a polytope is looked for.

    Attributes:
        scale_max: The largest scale that is tried.
        scale_min: The smallest one.
        max_iter: Most bisections.
        convergence_tol: The search ends where the scale is known to this.
        find_lagrangian_options: For certificates.
    """

    scale_max: float = 1.0
    scale_min: float = 0.01
    max_iter: int = 10
    convergence_tol: float = 1e-3
    find_lagrangian_options: FindSeparationCertificateGivenPolytopeOptions = (
        FindSeparationCertificateGivenPolytopeOptions()
    )


# ---- searches for large polytopes


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


# ---- what is searched

_CertificateOptions: TypeAlias = FindSeparationCertificateGivenPolytopeOptions  # what `CspaceFreePolytope` shows
_PolytopeOptions: TypeAlias = FindPolytopeGivenLagrangianOptions
_MarginCost: TypeAlias = EllipsoidMarginCost
_Alternation: TypeAlias = BilinearAlternationOptions
_BinarySearch: TypeAlias = BinarySearchOptions
_Found: TypeAlias = SearchResult


_log = logging.getLogger("drake")


@no_constructor()
class CspaceFreePolytopeBase:
    """Planes that are to separate the geometries of a plant; see `CspaceFreePolytope`."""

    class Options(_Options):
        """How certificates are made.

        Attributes:
            with_cross_y: For geometries that are no polytopes: whether squares may have products of different y.
        """

        with_cross_y: bool = False

    _pairs: dict[tuple[GeometryId, GeometryId], int]
    _planes: list[CSpaceSeparatingPlane]
    _y: np.ndarray

    def map_geometries_to_separating_planes(self) -> dict[tuple, int]:
        """Returns for each pair of geometries, the smaller id first, the index of its plane."""
        return dict(self._pairs)

    def separating_planes(self) -> list:
        """Returns the planes, one for each pair of geometries that may collide."""
        return list(self._planes)

    def y_slack(self) -> np.ndarray:
        """Returns the further indeterminates of conditions of geometries that are no polytopes, shape (3,)."""
        return self._y.copy()


@checked
class CspaceFreePolytope(CspaceFreePolytopeBase):
    """Proves polytopes {s | C s <= d, s_lower <= s <= s_upper} free of collisions, and makes them large.

    s are tan of half the angles from q*, so that poses are rational in s. For each pair of geometries there is a plane
    whose coefficients are affine in s; sums of squares prove that it separates them wherever s is in the polytope
    (Dai, Amice, Werner, Zhang and Tedrake, Certified polyhedral decompositions of collision-free configuration space,
    2023).

    Args:
        plant: The plant, finalized, with limits of its joints.
        scene_graph: Its SceneGraph.
        plane_order: How planes depend on s.
        q_star: The nominal posture q*, shape (nq,).
        options: How certificates are made.

    Raises:
        RuntimeError: a joint is neither weld, revolute nor prismatic, a shape is not supported, or a size is another.
    """

    SeparatingPlaneLagrangians = certificates.SeparatingPlaneLagrangians
    SeparationCertificate = certificates.SeparationCertificate
    SeparationCertificateProgram: TypeAlias = certificates.SeparationCertificateProgram
    SeparationCertificateResult = certificates.SeparationCertificateResult
    FindSeparationCertificateGivenPolytopeOptions: TypeAlias = _CertificateOptions
    FindPolytopeGivenLagrangianOptions: TypeAlias = _PolytopeOptions
    EllipsoidMarginCost: TypeAlias = _MarginCost
    BilinearAlternationOptions: TypeAlias = _Alternation
    BinarySearchOptions: TypeAlias = _BinarySearch
    SearchResult: TypeAlias = _Found

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        plane_order: SeparatingPlaneOrder,
        q_star: ArrayLike,
        options: CspaceFreePolytopeBase.Options | None = None,
    ):
        self._kinematics = RationalForwardKinematics(plant)
        self._q_star = np.array(q_star, dtype=float).ravel()
        if self._q_star.size != plant.num_positions():
            raise RuntimeError(
                f"CspaceFreePolytope(): q_star has {self._q_star.size} values, expected {plant.num_positions()}."
            )
        self._order = plane_order
        self._with_cross_y = (options if options is not None else self.Options()).with_cross_y
        self._y = _variables(3, "y")
        self._variables = [*self._kinematics.s(), *self._y]
        values = self._kinematics.ComputeSValue
        self._s_lower = values(plant.GetPositionLowerLimits(), self._q_star, angles_wrap_to_inf=True)
        self._s_upper = values(plant.GetPositionUpperLimits(), self._q_star, angles_wrap_to_inf=True)
        self._planes: list = []
        self._pairs: dict = {}
        self._rows: list[np.ndarray] = []
        self._cached: dict[int, list] = {}
        for (A, B), pairs in sorted(self._candidates(plant, scene_graph).items()):
            for first, second in pairs:
                self._add_plane(A, B, first, second)

    def _candidates(self, plant: MultibodyPlant, scene_graph: SceneGraph) -> dict[tuple[int, int], list]:
        """Pairs of geometries that may collide, by their bodies, the smaller index first."""
        inspector = scene_graph.model_inspector()
        geometries: dict[Any, CIrisCollisionGeometry] = {}
        out: dict[tuple[int, int], list] = {}
        for pair in sorted(inspector.GetCollisionCandidates(), key=lambda ids: [i.get_value() for i in ids]):
            for id in pair:
                if id not in geometries:
                    body = plant.GetBodyFromFrameId(inspector.GetFrameId(id))
                    assert body is not None  # the SceneGraph is the plant's
                    geometries[id] = CIrisCollisionGeometry._of(
                        inspector.GetShape(id), body.index(), id, inspector.GetPoseInFrame(id)
                    )
            found = sorted((geometries[id] for id in pair), key=lambda g: int(g.body_index()))
            bodies = (int(found[0].body_index()), int(found[1].body_index()))
            if self._middle(*bodies) is not None:
                out.setdefault(bodies, []).append(found)
        return out

    def _middle(self, A: int, B: int) -> int | None:
        """The body with half the moving joints between A and B on either side; None without such joints."""
        up, down = self._kinematics._kinematic_path(A, B)
        steps = [(self._kinematics._mobilities[b].parent, b) for b in up]
        steps += [(b, b) for b in down]
        moving = [end for end, b in steps if self._kinematics._mobilities[b].s >= 0]
        return moving[(len(moving) + 1) // 2 - 1] if moving else None

    def _add_plane(self, A: int, B: int, first: CIrisCollisionGeometry, second: CIrisCollisionGeometry) -> None:
        n, size = len(self._kinematics.s()), len(self._variables)
        plane = object.__new__(CSpaceSeparatingPlane_[Variable])
        v = plane.decision_variables = _variables(4 * (n + 1), "plane_var")
        rows = np.zeros((4, n + 1, v.size + 1))
        polynomials = []
        for i in range(4):
            mine = v[i * (n + 1) : (i + 1) * (n + 1)]
            keys = [unit(size, n - 1 - k) for k in range(n)] + [(0,) * size]
            polynomials.append(polynomial_of({}, [(x, key, 1.0) for x, key in zip(mine, keys)], self._variables))
            for k in range(n + 1):
                rows[i, n - 1 - k if k < n else n, i * (n + 1) + k] = 1.0
        plane.a, plane.b = np.array(polynomials[:3], dtype=object), polynomials[3]
        plane.positive_side_geometry, plane.negative_side_geometry = first, second
        middle = self._middle(A, B)
        assert middle is not None, "a plane is for bodies that move against each other"
        plane.expressed_body, plane.plane_degree = type(first.body_index())(middle), self._order.value
        ids = sorted((first.id(), second.id()), key=lambda id: id.get_value())
        self._pairs[ids[0], ids[1]] = len(self._planes)
        self._planes.append(plane)
        self._rows.append(rows)

    def _rationals(self, index: int) -> list:
        if index not in self._cached:
            self._cached[index] = certificates.rationals(
                self._planes[index], self._kinematics, self._q_star, self._rows[index], self._with_cross_y
            )
        return self._cached[index]

    # Certificates

    def _checked(self, call: str, C: ArrayLike, d: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        C, d, n = np.atleast_2d(np.asarray(C, dtype=float)), np.asarray(d, dtype=float).ravel(), len(self._s_lower)
        if C.shape != (d.size, n):
            raise RuntimeError(f"{call}(): C has shape {C.shape} and d has {d.size} values; there are {n} s.")
        return C, d

    def _faces(self, C: np.ndarray, d: np.ndarray, ignore_redundant_C: bool) -> list[Face]:
        n, size = len(self._s_lower), len(self._variables)
        faces = [("polytope", i, -C[i], d[i]) for i in range(len(d))]
        for i in range(n):
            faces.append(("s_lower", i, np.eye(n)[i], -self._s_lower[i]))
            faces.append(("s_upper", i, -np.eye(n)[i], self._s_upper[i]))
        faces = [f for f in faces if math.isfinite(f[3])]
        redundant = programs.implied(
            np.array([-f[2] for f in faces]),
            np.array([f[3] for f in faces]),
            list(range(len(faces))),
            [k for k, f in enumerate(faces) if f[0] != "polytope" or ignore_redundant_C],
        )
        return [
            Face(kind, i, affine(size, constant, slopes))
            for k, (kind, i, slopes, constant) in enumerate(faces)
            if k not in redundant
        ]

    def _index_of(self, call: str, geometry_pair: tuple[GeometryId, GeometryId]) -> int:
        first, second = sorted(geometry_pair, key=lambda id: id.get_value())
        if (first, second) not in self._pairs:
            raise RuntimeError(f"{call}(): the geometries {geometry_pair} need no plane to separate them.")
        return self._pairs[first, second]

    def MakeIsGeometrySeparableProgram(
        self, geometry_pair: tuple[GeometryId, GeometryId], C: ArrayLike, d: ArrayLike
    ) -> SeparationCertificateProgram:
        """Returns a program that looks for a certificate that two geometries do not touch.

        Args:
            geometry_pair: Their ids.
            C: Shape (m, n); the polytope is {s | C s <= d, s_lower <= s <= s_upper}.
            d: Shape (m,).

        Raises:
            RuntimeError: the geometries need no certificate, being on the same body for example, or sizes differ.
        """
        call = "MakeIsGeometrySeparableProgram"
        C, d = self._checked(call, C, d)
        return self._program(self._index_of(call, geometry_pair), C, d, self._faces(C, d, False))

    def _program(self, index: int, C: np.ndarray, d: np.ndarray, faces: list[Face]) -> SeparationCertificateProgram:
        return certificates.certificate_program(
            index, self._planes[index], self._rationals(index), faces, len(d), self._variables
        )

    def SolveSeparationCertificateProgram(
        self,
        certificate_program: SeparationCertificateProgram,
        options: FindSeparationCertificateGivenPolytopeOptions,
    ) -> certificates.SeparationCertificateResult | None:
        """Returns the plane and the multipliers that a program finds, or None.

        Args:
            certificate_program: The program.
            options: Which solver, and how.
        """
        result = MakeSolver(options.solver_id).Solve(certificate_program.prog(), None, options.solver_options)
        if not result.is_success():
            return None
        plane = self._planes[certificate_program.plane_index]
        return certificate_program.certificate.GetSolution(
            certificate_program.plane_index, plane.a, plane.b, plane.decision_variables, result
        )

    def FindSeparationCertificateGivenPolytope(
        self,
        C: ArrayLike,
        d: ArrayLike,
        ignored_collision_pairs: set,
        options: FindSeparationCertificateGivenPolytopeOptions,
    ) -> tuple[bool, dict]:
        """Looks for certificates of all pairs of geometries.

        Args:
            C: Shape (m, n); the polytope is {s | C s <= d, s_lower <= s <= s_upper}.
            d: Shape (m,).
            ignored_collision_pairs: Pairs of ids that are left out.
            options: How to search.

        Returns:
            Whether there are certificates for all; and those that were found, by pair.

        Raises:
            RuntimeError: sizes differ.
        """
        C, d = self._checked("FindSeparationCertificateGivenPolytope", C, d)
        ignored = {tuple(sorted(pair, key=lambda id: id.get_value())) for pair in ignored_collision_pairs}
        faces = self._faces(C, d, options.ignore_redundant_C)
        success, found = True, {}
        for pair, index in self._pairs.items():
            if pair in ignored:
                continue
            certificate = self.SolveSeparationCertificateProgram(self._program(index, C, d, faces), options)
            if options.verbose:
                _log.info("Separation of %s: %s", pair, "certified" if certificate is not None else "not certified")
            if certificate is not None:
                found[pair] = certificate
                continue
            success = False
            if options.terminate_at_failure:
                break
        return success, found

    # ---- searches for large polytopes

    def _polytope(self, C: np.ndarray, d: np.ndarray) -> HPolyhedron:
        box = programs.box_rows(self._s_lower, self._s_upper)
        A, b = np.vstack((C, box[0])), np.concatenate((d, box[1]))
        keep = np.isfinite(b)
        return HPolyhedron(A[keep], b[keep])

    def _proven(self, C: np.ndarray, d: np.ndarray, planes: dict[int, tuple[np.ndarray, Any]]) -> SearchResult:
        """A polytope, proven by a and b of separating planes."""
        out = SearchResult()
        out._C, out._d, out._polytope = C.copy(), d.copy(), self._polytope(C, d)
        out._a, out._b = {k: a for k, (a, _) in planes.items()}, {k: b for k, (_, b) in planes.items()}
        return out

    def BinarySearch(
        self,
        ignored_collision_pairs: set,
        C: ArrayLike,
        d: ArrayLike,
        s_center: ArrayLike,
        options: BinarySearchOptions,
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

        def tried(scale: float) -> SearchResult | None:
            scaled = C @ center + scale * (d - C @ center)
            success, found = self.FindSeparationCertificateGivenPolytope(
                C, scaled, ignored_collision_pairs, options.find_lagrangian_options
            )
            return self._proven(C, scaled, {f.plane_index: (f.a, f.b) for f in found.values()}) if success else None

        low, high = float(options.scale_min), float(options.scale_max)
        best = tried(high)
        if best is not None:
            return best
        best = tried(low)
        num_iter = 0
        while best is not None and num_iter < options.max_iter and high - low > options.convergence_tol:
            num_iter += 1
            middle = 0.5 * (low + high)
            better = tried(middle)
            if better is None:
                high = middle
            else:
                low, best = middle, better
        if best is not None:
            best._num_iter = num_iter
        return best

    def SearchWithBilinearAlternation(
        self, ignored_collision_pairs: set, C_init: ArrayLike, d_init: ArrayLike, options: BilinearAlternationOptions
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
        self, C: np.ndarray, d: np.ndarray, found: dict, ellipsoid: Hyperellipsoid, options: BilinearAlternationOptions
    ) -> SearchResult | None:
        """C and d with the multipliers of `found`, faces far from the ellipsoid; or None."""
        how, center = options.find_polytope_options, ellipsoid.center()
        Q = options.ellipsoid_scaling * np.linalg.inv(ellipsoid.A())  # It is {Q u + center | |u| <= 1}.
        prog = MathematicalProgram()
        new_C, new_d = prog.NewContinuousVariables(len(C), C.shape[1], "C"), prog.NewContinuousVariables(len(d), "d")
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
        solved = {}
        for certificate in found.values():
            plane = self._planes[certificate.plane_index]
            a = np.array([result.GetSolution(p) for p in plane.a], dtype=object)
            solved[certificate.plane_index] = a, result.GetSolution(plane.b)
        C, d = result.GetSolution(new_C).reshape(C.shape), np.atleast_1d(result.GetSolution(new_d))
        return self._proven(C, d, solved)

    @staticmethod
    def _add_margin_cost(prog: MathematicalProgram, margin: np.ndarray, how: Any) -> BindingBase[LinearCost]:
        if how.ellipsoid_margin_cost is EllipsoidMarginCost.kSum:
            return prog.AddLinearCost(-np.ones(len(margin)), 0.0, margin)
        before = len(prog.linear_costs())
        m = len(margin)
        prog.AddMaximizeGeometricMeanCost(np.eye(m), np.full(m, how.ellipsoid_margin_epsilon), margin)
        return prog.linear_costs()[before]

    def _impose_certificate(
        self,
        prog: MathematicalProgram,
        certificate: Any,
        faces: list,
        new_C: np.ndarray,
        new_d: np.ndarray,
        search_bounds: bool,
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


def _variables(count: int, name: str) -> np.ndarray:
    return np.array([Variable(f"{name}{i}") for i in range(count)], dtype=object)
