"""Polytopes of tan of half angles that are proven free of collisions (C-IRIS)."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np

from sheldrake.common._options import Options as _Options
from sheldrake.geometry.optimization import _cspace_certificates as certificates
from sheldrake.geometry.optimization import _cspace_options as options_of
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._cspace_certificates import Face, SeparationCertificateProgram
from sheldrake.geometry.optimization._cspace_geometries import (
    CIrisCollisionGeometry,
    CSpaceSeparatingPlane_,
    SeparatingPlaneOrder,
)
from sheldrake.geometry.optimization._cspace_polynomials import affine, symbolic, unit
from sheldrake.geometry.optimization._cspace_searches import Searches, SearchResult
from sheldrake.multibody.rational import RationalForwardKinematics
from sheldrake.solvers import MakeSolver
from sheldrake.symbolic import Variable

_log = logging.getLogger("drake")


class CspaceFreePolytopeBase:
    """Planes that are to separate the geometries of a plant; see `CspaceFreePolytope`."""

    class Options(_Options):
        """How certificates are made.

        Attributes:
            with_cross_y: For geometries that are no polytopes: whether squares may have products of different y.
        """

        _fields = (("with_cross_y", bool, False),)

    def __init__(self, *args: Any, **kwargs: Any):
        raise TypeError("pydrake.geometry.optimization.CspaceFreePolytopeBase: No constructor defined!")

    _planes: list
    _pairs: dict[tuple, int]
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


class CspaceFreePolytope(CspaceFreePolytopeBase, Searches):
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
    SeparationCertificateProgram = certificates.SeparationCertificateProgram
    SeparationCertificateResult = certificates.SeparationCertificateResult
    FindSeparationCertificateGivenPolytopeOptions = options_of.FindSeparationCertificateGivenPolytopeOptions
    FindPolytopeGivenLagrangianOptions = options_of.FindPolytopeGivenLagrangianOptions
    EllipsoidMarginCost = options_of.EllipsoidMarginCost
    BilinearAlternationOptions = options_of.BilinearAlternationOptions
    BinarySearchOptions = options_of.BinarySearchOptions
    SearchResult = SearchResult

    def __init__(
        self,
        plant: Any,
        scene_graph: Any,
        plane_order: SeparatingPlaneOrder,
        q_star: Any,
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
        self._planes, self._pairs = [], {}
        self._rows: list[np.ndarray] = []
        self._cached: dict[int, list] = {}
        for (A, B), pairs in sorted(self._candidates(plant, scene_graph).items()):
            for first, second in pairs:
                self._add_plane(A, B, first, second)

    def _candidates(self, plant: Any, scene_graph: Any) -> dict[tuple[int, int], list]:
        """Pairs of geometries that may collide, by their bodies, the smaller index first."""
        inspector = scene_graph.model_inspector()
        geometries: dict[Any, CIrisCollisionGeometry] = {}
        out: dict[tuple[int, int], list] = {}
        for pair in sorted(inspector.GetCollisionCandidates(), key=lambda ids: [i.get_value() for i in ids]):
            for id in pair:
                if id not in geometries:
                    body = plant.GetBodyFromFrameId(inspector.GetFrameId(id)).index()
                    geometries[id] = CIrisCollisionGeometry._of(
                        inspector.GetShape(id), body, id, inspector.GetPoseInFrame(id)
                    )
            found = sorted((geometries[id] for id in pair), key=lambda g: int(g.body_index()))
            bodies = (int(found[0].body_index()), int(found[1].body_index()))
            if self._middle(*bodies) is not None:
                out.setdefault(bodies, []).append(found)
        return out

    def _middle(self, A: int, B: int) -> int | None:
        """The body with half the moving joints between A and B on either side; None without such joints."""
        up, down = self._kinematics._way(A, B)
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
            polynomials.append(symbolic({}, [(x, key, 1.0) for x, key in zip(mine, keys)], self._variables))
            for k in range(n + 1):
                rows[i, n - 1 - k if k < n else n, i * (n + 1) + k] = 1.0
        plane.a, plane.b = np.array(polynomials[:3], dtype=object), polynomials[3]
        plane.positive_side_geometry, plane.negative_side_geometry = first, second
        plane.expressed_body, plane.plane_degree = type(first.body_index())(self._middle(A, B)), self._order.value
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

    def _checked(self, call: str, C: Any, d: Any) -> tuple[np.ndarray, np.ndarray]:
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
        redundant = _redundant(
            np.array([-f[2] for f in faces]),
            np.array([f[3] for f in faces]),
            [k for k, f in enumerate(faces) if f[0] != "polytope" or ignore_redundant_C],
        )
        return [
            Face(kind, i, affine(size, constant, slopes))
            for k, (kind, i, slopes, constant) in enumerate(faces)
            if k not in redundant
        ]

    def _index_of(self, call: str, geometry_pair: Any) -> int:
        first, second = sorted(geometry_pair, key=lambda id: id.get_value())
        if (first, second) not in self._pairs:
            raise RuntimeError(f"{call}(): the geometries {geometry_pair} need no plane to separate them.")
        return self._pairs[first, second]

    def MakeIsGeometrySeparableProgram(self, geometry_pair: Any, C: Any, d: Any) -> SeparationCertificateProgram:
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
        options: options_of.FindSeparationCertificateGivenPolytopeOptions,
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
        C: Any,
        d: Any,
        ignored_collision_pairs: set,
        options: options_of.FindSeparationCertificateGivenPolytopeOptions,
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


def _variables(count: int, name: str) -> np.ndarray:
    return np.array([Variable(f"{name}{i}") for i in range(count)], dtype=object)


def _redundant(A: np.ndarray, b: np.ndarray, candidates: list[int]) -> set[int]:
    """Which of the candidate rows of A x <= b follow from the others."""
    out: set[int] = set()
    for k in candidates:
        others = [i for i in range(len(b)) if i != k and i not in out]
        if others and programs.largest(A[others], b[others], A[k]) <= b[k] + 1e-9:
            out.add(k)
    return out
