"""Questions about geometry at the poses of a context.

The value of the SceneGraph's query port. It compiles the geometry's arrays when first asked, gathers poses from the
sources, and calls the same kernels that the plant's step calls.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common._checked import checked
from sheldrake.common.kernel import Kernel
from sheldrake.common.value import _register_value_type
from sheldrake.geometry._compiled.hydroelastic import explain_unsupported, find_surfaces
from sheldrake.geometry._compiled.search import find_contacts
from sheldrake.geometry._ids import GeometryId, number_of
from sheldrake.geometry._kernels.contacts import place_geometries
from sheldrake.geometry._kernels.model import (
    HALF_SPACE,
    BodyPose,
    BodyPoses,
    ContactTable,
    Found,
    Geometry,
    GeometryModel,
    contact_table,
)
from sheldrake.geometry._kernels.pair_distance import find_distances, see_from_geometries, see_from_point
from sheldrake.geometry._numbers import as_numbers, like, values_of
from sheldrake.geometry._query.contact_surface import ContactSurface, surfaces_of
from sheldrake.geometry._query.images import Images
from sheldrake.geometry._query.ray_casts import HAVE_FORMULAS, Surface, meet_any, rays_of
from sheldrake.geometry._query.results import (
    PenetrationAsPointPair,
    RayIntersections,
    SignedDistancePair,
    SignedDistanceToPoint,
)
from sheldrake.geometry._query.scene import (
    FoundPoints,
    GivenPoses,
    QueryScene,
    ShownPoses,
    explain_contact_status,
    points_in,
    pose_of_point,
    with_point,
    world_poses,
)
from sheldrake.geometry._roles import HydroelasticContactRepresentation
from sheldrake.geometry._shape_types import type_of
from sheldrake.geometry._shapes import Mesh, Shape
from sheldrake.math import RigidTransform, RotationMatrix

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry._bounding import Obb

_NOW = "geometry and poses"
"""Where a context keeps the answer of `QueryObject._now`."""
_KIND = operator.index(Geometry.kind)


class QueryObject(Images):
    """Answers where geometry is and what touches what, at the present poses of the context it came from."""

    # ---- proximity

    def _scene(self) -> QueryScene:
        """The proximity geometry of the context."""
        scene_graph, context = self._required()
        return scene_graph._compile_for_queries(scene_graph._geometry_state(context))

    def _now(self) -> tuple[QueryScene, GivenPoses | ShownPoses]:
        """The proximity geometry of the context, and poses of its bodies; of duals where poses are."""
        scene_graph, context = self._required()
        state, known, store = scene_graph._geometry_state(context), context._reads.get(_NOW), context._store
        if known is None or known[0] != state.serial or store.frozen:
            scene = scene_graph._compile_for_queries(state)
            shown = self._numbers_of_source(scene) if scene_graph._scalar is float else None
            known = state.serial, scene, shown
            if not (store.uncached or store.frozen or store.unsettled):
                context._reads[_NOW] = known  # until its ports are connected otherwise
        _, scene, shown = known
        if shown is not None:
            return scene, shown
        return scene, self._published_poses(scene) if scene_graph._scalar is float else self._dual_poses(scene)

    def _placed(self) -> tuple[GeometryModel, list[GeometryId], np.ndarray]:
        """The proximity geometry as arrays, its ids, and X_WB of the frames that have some."""
        scene, poses = self._now()
        return scene.model, scene.ids, poses.X_WB()

    def _dual_poses(self, scene: QueryScene) -> GivenPoses:
        X_WB = world_poses(scene.num_bodies, object)
        poses = self._world_poses(scene.moving)
        for body, frame in zip(scene.bodies, scene.moving):
            X_WB[body, BodyPose.R_WB.columns] = poses[frame].rotation().matrix().ravel()
            X_WB[body, BodyPose.p_WB.columns] = poses[frame].translation()
        dual = any(X_WF.translation().dtype == object for X_WF in poses.values())
        return GivenPoses(X_WB if dual else X_WB.astype(float))

    def _published_poses(self, scene: QueryScene) -> GivenPoses:
        """Poses that are numbers but no plant's, kept until the source publishes others."""
        rows, last = self._published(scene.memo), self._last_poses
        published = None if rows is None else rows[1]
        if published is not None and last is not None and last[0] is scene and last[1] is published:
            return last[2]
        places = None if rows is None else scene.places_of_all(rows[0])
        if published is not None and places is not None:
            X_WB = scene.place_bodies(published.take(places, 0))
        else:
            X_WF = self._world_matrices(scene.moving, scene.memo)
            X_WB = scene.place_bodies(np.concatenate([X_WF[:, :, :3].reshape(-1, 9), X_WF[:, :, 3]], axis=1))
        poses = GivenPoses(X_WB)
        self._last_poses = scene, published, poses
        return poses

    def _contacts(self) -> tuple[FoundPoints, list[GeometryId]]:
        scene, poses = self._now()
        if poses.are_duals:
            return points_in(_find_points(scene.model, poses.X_WB())), scene.ids
        return scene.find_points(poses), scene.ids

    def ComputePointPairPenetration(self) -> list[PenetrationAsPointPair]:
        """One pair of points for every pair of geometries that overlap, sorted by ids."""
        return self._point_pairs(*self._contacts())

    @staticmethod
    def _point_pairs(points: FoundPoints, ids: list[GeometryId]) -> list[PenetrationAsPointPair]:
        return PenetrationAsPointPair._each(ids, *points)

    def HasCollisions(self) -> bool:
        """True if any two geometries that may touch overlap."""
        scene, poses = self._now()
        if poses.are_duals:
            return int(_find_points(scene.model, poses.X_WB()).count[Found.num_contacts]) > 0
        return scene.some_overlap(poses)

    def FindCollisionCandidates(self) -> list[tuple[GeometryId, GeometryId]]:
        """Pairs that may touch and whose bounding spheres overlap, sorted."""
        scene, poses = self._now()
        ids = scene.ids
        if poses.are_duals:
            poses = GivenPoses(values_of(poses.X_WB()))
        return [(ids[a], ids[b]) for a, b in scene.find_candidates(poses)]

    # ---- distances

    @staticmethod
    def _distances(
        model: GeometryModel, X_WB: np.ndarray, reach: float, see: Kernel = see_from_geometries
    ) -> FoundPoints:
        """Distances at poses of duals, points in the frames of their geometries."""
        table = _table(model, X_WB.dtype)
        if find_distances(model, BodyPoses(X_WB), float(reach), table):
            raise explain_contact_status(model, table)
        see(model, table)
        return points_in(table)

    @checked
    def ComputeSignedDistancePairwiseClosestPoints(self, max_distance: float = math.inf) -> list[SignedDistancePair]:
        """Signed distance and nearest points of all pairs that may touch and are no farther apart than max_distance.

        Meshes count as their convex hulls. Sorted by ids.
        """
        scene, poses = self._now()
        if poses.are_duals:
            pairs, rows = self._distances(scene.in_order, poses.X_WB(), max_distance)
        else:
            pairs, rows = scene.find_distances(poses, max_distance)
        return SignedDistancePair._each(scene.ids, pairs, rows)

    def ComputeSignedDistancePairClosestPoints(
        self, geometry_id_A: GeometryId, geometry_id_B: GeometryId
    ) -> SignedDistancePair:
        """Signed distance and nearest points of one pair, filtered or not.

        In whichever order they are given, A of the result is the one of the smaller id.

        Raises:
            RuntimeError: one of them is unknown, has no proximity role, or both are half spaces.
        """
        (result,) = self._signed_distances_of([(geometry_id_A, geometry_id_B)])
        return result

    def _signed_distances_of(self, pairs: Sequence[tuple[GeometryId, GeometryId]]) -> list[SignedDistancePair]:
        """The same of several pairs; poses are looked at once."""
        scene, poses = self._now()
        return [self._signed_distance(scene, poses, pair) for pair in pairs]

    def _signed_distance(
        self, scene: QueryScene, poses: GivenPoses | ShownPoses, pair: tuple[GeometryId, GeometryId]
    ) -> SignedDistancePair:
        model, rows = scene.model, []
        for geometry_id in pair:
            row = scene.row_of.get(geometry_id) if isinstance(geometry_id, GeometryId) else None
            if row is None:
                number = number_of(geometry_id, GeometryId)
                raise RuntimeError(
                    f"The geometry given by id {number} does not reference a geometry that can be "
                    "used in a signed distance query"
                )
            rows.append(row)
        if all(model.geometry.item(row, _KIND) == HALF_SPACE for row in rows):
            raise RuntimeError("Signed distance queries between two half spaces are not supported.")
        if poses.are_duals:
            return self._distance_of_duals(scene, sorted(rows), poses.X_WB())
        (result,) = SignedDistancePair._each(scene.ids, *scene.find_distance(rows[0], rows[1], poses))
        return result

    def _distance_of_duals(self, scene: QueryScene, rows: list[int], X_WB: np.ndarray) -> SignedDistancePair:
        """The distance of two geometries at poses of duals."""
        quick = scene.find_distance_of_duals(rows, X_WB) if self._required()[0]._scalar is AutoDiffXd else None
        if quick is not None:
            (result,) = SignedDistancePair._each(scene.ids, *quick)
            return result
        model = scene.model  # no other geometries are placed, which would be done in Python
        two = {name: getattr(model, name)[rows] for name in ("geometry", "size", "material", "X_BG")}
        found = self._distances(model._replace(**two, pair=np.array([[0, 1]], np.int64)), X_WB, math.inf)
        (result,) = SignedDistancePair._each([scene.ids[row] for row in rows], *found)
        return result

    @checked
    def ComputeSignedDistanceToPoint(self, p_WQ: ArrayLike, threshold: float = math.inf) -> list[SignedDistanceToPoint]:
        """Signed distance of point Q, in W [m], to every proximity geometry no farther away than `threshold`.

        Meshes count as they are, not as their hulls. Sorted by id.
        """
        p_WQ = as_numbers(p_WQ)
        if p_WQ.shape != (3,):
            p_WQ = p_WQ.reshape(3)
        scene, poses = self._now()
        if poses.are_duals or p_WQ.dtype == object:
            X_WB = np.concatenate([poses.X_WB().astype(object), pose_of_point(p_WQ.astype(object))])
            model = with_point(scene.model, scene.num_bodies)
            pairs, rows = self._distances(model, X_WB, threshold, see_from_point)
        else:
            pairs, rows = scene.find_distances_to(p_WQ, poses, threshold)
        found = SignedDistanceToPoint._each(scene.ids, pairs, rows)
        if not scene.meshes:
            return found
        for (g, _), to in zip(pairs, found):
            if g in scene.meshes:
                self._see_mesh(to, scene.meshes[g], p_WQ)
        return [to for to in found if to.distance <= threshold]

    def _see_mesh(self, to: SignedDistanceToPoint, mesh: Mesh, p_WQ: np.ndarray) -> None:
        """Makes a distance to the hull of a mesh one to the mesh itself."""
        from sheldrake.geometry._meshes.mesh_distance import point_to_triangles

        surface = _surface_of(mesh, "ComputeSignedDistanceToPoint()")
        X_WG = self.GetPoseInWorld(to.id_G)
        to.distance, to.p_GN, gradient = point_to_triangles(X_WG.inverse() @ p_WQ, *surface)
        to.grad_W = X_WG.rotation().matrix() @ gradient

    def ComputeRayIntersections(
        self,
        p_WO: ArrayLike,
        direction_W: ArrayLike,
        max_distance: float = math.inf,
        excluded: Iterable[GeometryId] = (),
    ) -> RayIntersections:
        """Where rays first meet the surface of a proximity geometry, from outside or from inside.

        Drake has no such query. Exact for every shape; meshes count as they are, not as their hulls. Many rays in one
        call cost little more than one.

        Args:
            p_WO: Origins in W [m], shape (3,) for all rays or (3, n).
            direction_W: Directions in W, of any length but zero, shape (3,) for all rays or (3, n).
            max_distance: What is farther away is not met [m].
            excluded: Geometries that rays go through.

        Returns:
            Distances, geometries, points and normals, one for each ray.

        Raises:
            ValueError: shapes do not fit, or a direction is zero or not finite.
            RuntimeError: an excluded geometry is unknown.
        """
        p_WO, d_W = rays_of(p_WO, direction_W)
        excluded = set(excluded)
        for geometry_id in excluded:
            self._state.geometry(geometry_id)
        model, ids, X_WB = self._placed()
        table = _table(model, float)
        place_geometries.native(model, BodyPoses(np.ascontiguousarray(values_of(X_WB))), table)
        wanted = [g for g, geometry_id in enumerate(ids) if geometry_id not in excluded]
        shapes = {g: self._state.geometries[ids[g]].shape for g in wanted}
        meshes = {g: surface for g, s in shapes.items() if (surface := _surface_for_rays(s)) is not None}
        distance, who, normal = meet_any(model, table.X_WG, meshes, wanted, p_WO, d_W)
        missed = (who < 0) | (distance > max_distance)
        distance[missed], who[missed], normal[missed] = np.inf, -1, np.nan
        return RayIntersections(
            distance=distance,
            id_G=[None if g < 0 else ids[g] for g in who],
            p_WC=np.where(missed, np.nan, (p_WO + np.where(missed, 0.0, distance)[:, None] * d_W).T),
            nhat_W=normal.T.copy(),
        )

    def ComputeObbInWorld(self, geometry_id: GeometryId) -> Obb | None:
        """The oriented bounding box of a geometry in W; None for a half space."""
        from sheldrake.geometry._bounding import bounding_box

        box = bounding_box(self._state.geometry(geometry_id).shape)
        if box is None:
            return None
        X_WG = self.GetPoseInWorld(geometry_id)
        R, p = X_WG.rotation().matrix(), X_WG.translation()
        if R.dtype == object:
            X_WG = RigidTransform(RotationMatrix(values_of(R)), values_of(p))
        return box._moved(X_WG)

    def ComputeAabbInWorld(self, geometry_id: GeometryId) -> None:
        """None: only deformable geometry has an axis-aligned box in W."""
        self._state.geometry(geometry_id)

    # ---- contact surfaces

    def _surfaces(
        self, call: str, representation: HydroelasticContactRepresentation
    ) -> tuple[list[ContactSurface], FoundPoints, list[GeometryId]]:
        """The contact surfaces, and points of the pairs that can have none."""
        if not isinstance(representation, HydroelasticContactRepresentation):
            raise TypeError(
                f"{call}(): incompatible function arguments. Expected a HydroelasticContactRepresentation, not "
                f"{representation!r}."
            )
        scene_graph, _ = self._required()
        scene, poses = self._now()
        ids = scene.ids
        pairs = scene_graph._hydro_for_queries(self._state, representation)
        if not poses.are_duals:
            return (*scene.find_surfaces(pairs, representation, poses), ids)
        points = _find_points(pairs.points, poses.X_WB())
        if len(pairs.model.pair) == 0:
            return [], points_in(points), ids
        surfaces = surfaces_of(find_surfaces(pairs.model, points), pairs.model, ids)
        return [surface for _, surface in surfaces], points_in(points), ids

    def ComputeContactSurfaces(self, representation: HydroelasticContactRepresentation) -> list[ContactSurface]:
        """The surface of every pair of geometries that overlap, sorted by ids.

        Args:
            representation: HydroelasticContactRepresentation, what faces are.

        Raises:
            RuntimeError: two geometries overlap that can have no surface: both rigid, one without hydroelastic
                representation, or a compliant half space with another compliant one.
        """
        surfaces, points, ids = self._surfaces("ComputeContactSurfaces", representation)
        pairs, _ = points
        if pairs:
            a, b = pairs[0][:2]
            raise explain_unsupported(self._state, ids[a], ids[b])
        return surfaces

    def ComputeContactSurfacesWithFallback(
        self, representation: HydroelasticContactRepresentation
    ) -> tuple[list[ContactSurface], list[PenetrationAsPointPair]]:
        """Contact surfaces where there can be some, and pairs of points for all others.

        Args:
            representation: HydroelasticContactRepresentation, what faces are.
        """
        surfaces, points, ids = self._surfaces("ComputeContactSurfacesWithFallback", representation)
        return surfaces, self._point_pairs(points, ids)

    # ---- what is not there

    def GetConfigurationsInWorld(self, deformable_geometry_id: GeometryId) -> np.ndarray:
        """Not available: deformable geometry."""
        raise NotImplementedError("QueryObject.GetConfigurationsInWorld(): deformable geometry is not supported.")


_register_value_type(QueryObject)


def _find_points(model: GeometryModel, X_WB: np.ndarray) -> ContactTable:
    """One point for every pair of a model that overlaps."""
    table = _table(model, X_WB.dtype)
    if find_contacts(model, X_WB, table, native=X_WB.dtype != object):
        raise explain_contact_status(model, table)
    return table


def _table(model: GeometryModel, dtype: type | np.dtype) -> ContactTable:
    """A table with room for one row a pair; of duals where poses are."""
    table = contact_table(model, capacity=max(1, model.pair.shape[0]))
    return ContactTable(*(like(a, dtype) for a in table))


def _surface_for_rays(shape: Shape) -> Surface | None:
    """The triangles that rays meet: of a mesh as it is, of a shape without a formula as it is drawn; else None."""
    if isinstance(shape, Mesh):
        return _surface_of(shape, "ComputeRayIntersections()")
    row = type_of(shape)
    return Surface(*row.surface(shape)) if row.surface is not None and row.kind not in HAVE_FORMULAS else None


def _surface_of(mesh: Mesh, call: str) -> Surface:
    """The triangles of a mesh, to scale and seen from outside."""
    from sheldrake.geometry._meshes.mesh_files import read_mesh

    data, scale = read_mesh(mesh.source(), call), mesh.scale3()
    triangles = data.triangles[:, ::-1] if np.prod(scale) < 0.0 else data.triangles
    return Surface(data.vertices * scale, triangles)
