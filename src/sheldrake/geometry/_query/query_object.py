"""Questions about geometry at the poses of a context.

The value of the SceneGraph's query port. It compiles the geometry's arrays when first asked, gathers poses from the
sources, and calls the same kernels that the plant's step calls.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import _register_value_type
from sheldrake.geometry._compiled.hydroelastic import explain_unsupported, find_surfaces
from sheldrake.geometry._compiled.search import find_contacts
from sheldrake.geometry._ids import GeometryId, number_of
from sheldrake.geometry._kernels import model as columns
from sheldrake.geometry._kernels.contacts import place_geometries
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel, contact_table
from sheldrake.geometry._kernels.pair_distance import find_distances
from sheldrake.geometry._numbers import as_numbers, like, plain, values_of
from sheldrake.geometry._query.contact_surface import ContactSurface, surfaces_of
from sheldrake.geometry._query.pictures import Pictures
from sheldrake.geometry._query.ray_casts import Surface, meet_any, rays_of
from sheldrake.geometry._query.results import (
    PenetrationAsPointPair,
    RayIntersections,
    SignedDistancePair,
    SignedDistanceToPoint,
)
from sheldrake.geometry._query.scene import FoundPoints, QueryScene
from sheldrake.geometry._roles import HydroelasticContactRepresentation
from sheldrake.geometry._shapes import Mesh

if TYPE_CHECKING:
    from sheldrake.geometry._bounding import Obb


class QueryObject(Pictures):
    """Answers where geometry is and what touches what, at the present poses of the context it came from."""

    # ---- proximity

    def _scene(self) -> QueryScene:
        scene_graph, _ = self._required()
        return scene_graph._compile_for_queries(self._state)

    def _placed(self) -> tuple[GeometryModel, list[GeometryId], np.ndarray]:
        """The proximity geometry as arrays, its ids, and X_WB of the frames that have some."""
        scene = self._scene()
        return scene.model, scene.ids, self._body_poses(scene)

    def _body_poses(self, scene: QueryScene) -> np.ndarray:
        """X_WB of a scene's bodies, shape (num_bodies, 12); of duals where poses are."""
        scene_graph, _ = self._required()
        plain_numbers = scene_graph._scalar is float
        X_WB = np.full((scene.num_bodies, 12), 0.0, dtype=float if plain_numbers else object)
        X_WB[:, [0, 4, 8]] = 1.0
        if plain_numbers:
            X_WF = self._world_matrices(scene.moving, scene.memo)
            X_WB[scene.bodies, :9] = X_WF[:, :, :3].reshape(-1, 9)
            X_WB[scene.bodies, 9:] = X_WF[:, :, 3]
            return X_WB
        poses = self._world_poses(scene.moving)
        for body, frame in zip(scene.bodies, scene.moving):
            X_WB[body, :9] = poses[frame].rotation().matrix().ravel()
            X_WB[body, 9:] = poses[frame].translation()
        dual = any(X_WF.translation().dtype == object for X_WF in poses.values())
        return X_WB if dual else X_WB.astype(float)

    def _contacts(self) -> tuple[FoundPoints, list[GeometryId]]:
        scene = self._scene()
        X_WB = self._body_poses(scene)
        if X_WB.dtype == object:
            return FoundPoints.of(_find_points(scene.model, X_WB)), scene.ids
        return scene.find_points(X_WB), scene.ids

    def ComputePointPairPenetration(self) -> list[PenetrationAsPointPair]:
        """One pair of points for every pair of geometries that overlap, sorted by ids."""
        return self._point_pairs(*self._contacts())

    @staticmethod
    def _point_pairs(points: FoundPoints, ids: list[GeometryId]) -> list[PenetrationAsPointPair]:
        found = []
        for (a, b, _, _), row in zip(points.pair, points.point):
            found.append(
                PenetrationAsPointPair(
                    id_A=ids[a],
                    id_B=ids[b],
                    p_WCa=row[0:3].copy(),
                    p_WCb=row[3:6].copy(),
                    nhat_BA_W=row[6:9].copy(),
                    depth=plain(row[9]),
                )
            )
        return found

    def HasCollisions(self) -> bool:
        """True if any two geometries that may touch overlap."""
        return len(self._contacts()[0].pair) > 0

    def FindCollisionCandidates(self) -> list[tuple[GeometryId, GeometryId]]:
        """Pairs that may touch and whose bounding spheres overlap, sorted."""
        model, ids, X_WB = self._placed()
        R, p = X_WB[:, :9].reshape(-1, 3, 3), X_WB[:, 9:]
        R, p = values_of(R), values_of(p)
        body = model.geometry[:, columns.BODY]
        R_BG, p_BG = model.X_BG[:, :9].reshape(-1, 3, 3), model.X_BG[:, 9:]
        centre_G = model.size[:, columns.CENTRE : columns.CENTRE + 3]
        R_WG = R[body] @ R_BG
        p_WG = p[body] + np.einsum("nij,nj->ni", R[body], p_BG)
        centre = p_WG + np.einsum("nij,nj->ni", R_WG, centre_G)
        bound = model.size[:, columns.BOUND]
        found = []
        for a, b in sorted(model.pair.tolist()):
            if math.isinf(bound[a]) or math.isinf(bound[b]):
                shape, plane = (b, a) if math.isinf(bound[a]) else (a, b)
                near = R_WG[plane][:, 2] @ (centre[shape] - p_WG[plane]) <= bound[shape]
            else:
                near = np.linalg.norm(centre[a] - centre[b]) <= bound[a] + bound[b]
            if near:
                found.append((ids[a], ids[b]))
        return found

    # ---- distances

    def _distances(self, model: GeometryModel, X_WB: np.ndarray, reach: float) -> ContactTable:
        table = _table(model, X_WB.dtype)
        if X_WB.dtype == object:
            find_distances(model, X_WB, float(reach), table)
        else:
            find_distances.native(model, X_WB, float(reach), table)
        return table

    def _pair(self, table: ContactTable, row: int, ids: list[GeometryId]) -> SignedDistancePair:
        a, b = int(table.pair[row, 0]), int(table.pair[row, 1])
        point = table.point[row]
        return SignedDistancePair(
            id_A=ids[a],
            id_B=ids[b],
            p_ACa=_in_frame(table.X_WG[a], point[0:3]),
            p_BCb=_in_frame(table.X_WG[b], point[3:6]),
            distance=plain(-point[9]),
            nhat_BA_W=point[6:9].copy(),
        )

    def ComputeSignedDistancePairwiseClosestPoints(self, max_distance: float = math.inf) -> list[SignedDistancePair]:
        """Signed distance and nearest points of all pairs that may touch and are no farther apart than max_distance.

        Meshes count as their convex hulls. Sorted by ids.
        """
        model, ids, X_WB = self._placed()
        table = self._distances(model, X_WB, max_distance)
        rows = sorted(range(table.count[0]), key=lambda row: tuple(table.pair[row, :2]))
        return [self._pair(table, row, ids) for row in rows]

    def ComputeSignedDistancePairClosestPoints(
        self, geometry_id_A: GeometryId, geometry_id_B: GeometryId
    ) -> SignedDistancePair:
        """Signed distance and nearest points of one pair, filtered or not.

        Raises:
            RuntimeError: one of them is unknown, has no proximity role, or both are half spaces.
        """
        model, ids, X_WB = self._placed()
        rows = []
        for geometry_id in (geometry_id_A, geometry_id_B):
            if geometry_id not in ids:
                number = number_of(geometry_id, GeometryId)
                raise RuntimeError(
                    f"The geometry given by id {number} does not reference a geometry that can be "
                    "used in a signed distance query"
                )
            rows.append(ids.index(geometry_id))
        if all(model.geometry[row, columns.KIND] == columns.HALF_SPACE for row in rows):
            raise RuntimeError("Signed distance queries between two half spaces are not supported.")
        table = self._distances(model._replace(pair=np.array([rows], np.int64)), X_WB, math.inf)
        found = self._pair(table, 0, ids)
        if found.id_A != geometry_id_A:
            found.id_A, found.id_B, found.p_ACa, found.p_BCb = found.id_B, found.id_A, found.p_BCb, found.p_ACa
            found.nhat_BA_W = -found.nhat_BA_W
        return found

    def ComputeSignedDistanceToPoint(self, p_WQ: Any, threshold: float = math.inf) -> list[SignedDistanceToPoint]:
        """Signed distance of point Q, in W [m], to every proximity geometry no farther away than `threshold`.

        Meshes count as they are, not as their hulls. Sorted by id.
        """
        from sheldrake.geometry._meshes.mesh_distance import point_to_triangles

        p_WQ = as_numbers(p_WQ).reshape(3)
        model, ids, X_WB = self._placed()
        model, X_WB = _with_point(model, X_WB, p_WQ)
        table = self._distances(model, X_WB, math.inf)
        found = []
        for row in range(table.count[0]):
            g = int(table.pair[row, 0])
            shape = self._state.geometries[ids[g]].shape
            X_WG, point = table.X_WG[g], table.point[row]
            distance, p_GN, grad_W = plain(-point[9]), _in_frame(X_WG, point[0:3]), -point[6:9]
            if isinstance(shape, Mesh):
                surface = _surface_of(shape, "ComputeSignedDistanceToPoint()")
                distance, p_GN, gradient = point_to_triangles(_in_frame(X_WG, p_WQ), *surface)
                grad_W = X_WG[:9].reshape(3, 3) @ gradient
            if distance <= threshold:
                found.append(SignedDistanceToPoint(id_G=ids[g], p_GN=p_GN, distance=distance, grad_W=grad_W.copy()))
        return found

    def ComputeRayIntersections(
        self, p_WO: Any, direction_W: Any, max_distance: float = math.inf, excluded: Iterable[GeometryId] = ()
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
        place_geometries.native(model, np.ascontiguousarray(values_of(X_WB)), table)
        wanted = [g for g, geometry_id in enumerate(ids) if geometry_id not in excluded]
        shapes = {g: self._state.geometries[ids[g]].shape for g in wanted}
        meshes = {g: _surface_of(s, "ComputeRayIntersections()") for g, s in shapes.items() if isinstance(s, Mesh)}
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
        from sheldrake.geometry._bounding import Obb

        local = self.inspector().GetObbInGeometryFrame(geometry_id)
        return None if local is None else Obb(self.GetPoseInWorld(geometry_id) @ local.pose(), local.half_width())

    def ComputeAabbInWorld(self, geometry_id: GeometryId) -> None:
        """None: only deformable geometry has an axis-aligned box in W."""
        self._state.geometry(geometry_id)

    # ---- contact surfaces

    def _surfaces(self, call: str, representation: Any) -> tuple[list[ContactSurface], ContactTable, list[GeometryId]]:
        """The contact surfaces, and points of the pairs that can have none."""
        if not isinstance(representation, HydroelasticContactRepresentation):
            raise TypeError(
                f"{call}(): incompatible function arguments. Expected a HydroelasticContactRepresentation, not "
                f"{representation!r}."
            )
        scene_graph, _ = self._required()
        _, ids, X_WB = self._placed()
        pairs = scene_graph._hydro_for_queries(self._state, representation)
        points = _find_points(pairs.points, X_WB)
        if len(pairs.model.pair) == 0:
            return [], points, ids
        surfaces = surfaces_of(find_surfaces(pairs.model, points), pairs.model, ids)
        return [surface for _, surface in surfaces], points, ids

    def ComputeContactSurfaces(self, representation: Any) -> list[ContactSurface]:
        """The surface of every pair of geometries that overlap, sorted by ids.

        Args:
            representation: HydroelasticContactRepresentation, what faces are.

        Raises:
            RuntimeError: two geometries overlap that can have no surface: both rigid, one without hydroelastic
                representation, or a compliant half space with another compliant one.
        """
        surfaces, points, ids = self._surfaces("ComputeContactSurfaces", representation)
        if points.count[0] > 0:
            a, b = points.pair[0, :2]
            raise explain_unsupported(self._state, ids[a], ids[b])
        return surfaces

    def ComputeContactSurfacesWithFallback(
        self, representation: Any
    ) -> tuple[list[ContactSurface], list[PenetrationAsPointPair]]:
        """Contact surfaces where there can be some, and pairs of points for all others.

        Args:
            representation: HydroelasticContactRepresentation, what faces are.
        """
        surfaces, points, ids = self._surfaces("ComputeContactSurfacesWithFallback", representation)
        return surfaces, self._point_pairs(FoundPoints.of(points), ids)

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


def _table(model: GeometryModel, dtype: Any) -> ContactTable:
    """A table with room for one row a pair; of duals where poses are."""
    table = contact_table(model, capacity=max(1, model.pair.shape[0]))
    return ContactTable(*(like(a, dtype) for a in table))


def explain_contact_status(model: GeometryModel, table: ContactTable) -> Exception:
    """The error for a search of contacts that did not end well."""
    return RuntimeError(
        f"More than {table.pair.shape[0]} contact points among {model.pair.shape[0]} pairs of geometries: the contact "
        "table is full."
    )


def _in_frame(X_WG: np.ndarray, p_WQ: np.ndarray) -> np.ndarray:
    """p_GQ of a point given in W; X_WG is a row of ContactTable.X_WG."""
    return (p_WQ - X_WG[9:12]) @ X_WG[:9].reshape(3, 3)


def _surface_of(mesh: Mesh, call: str) -> Surface:
    """The triangles of a mesh, to scale and seen from outside."""
    from sheldrake.geometry._meshes.mesh_files import read_mesh

    data, scale = read_mesh(mesh.source(), call), mesh.scale3()
    triangles = data.triangles[:, ::-1] if np.prod(scale) < 0.0 else data.triangles
    return Surface(data.vertices * scale, triangles)


def _with_point(model: GeometryModel, X_WB: np.ndarray, p_WQ: np.ndarray) -> tuple[GeometryModel, np.ndarray]:
    """The model with a point Q as last geometry, paired with all others, on a body of its own."""
    count = len(model.geometry)
    geometry = np.vstack([model.geometry, np.zeros((1, columns.GEOMETRY_COLUMNS), np.int64)])
    geometry[count, columns.KIND], geometry[count, columns.BODY] = columns.SPHERE, len(X_WB)
    pose = np.array([[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
    dtype = object if object in (X_WB.dtype, p_WQ.dtype) else float
    X_WB, body = X_WB.astype(dtype), pose.astype(dtype)
    body[0, 9:] = p_WQ
    pairs = np.stack([np.arange(count), np.full(count, count)], axis=1).astype(np.int64)
    extended = model._replace(
        geometry=geometry,
        size=np.vstack([model.size, np.zeros((1, columns.SIZE_COLUMNS))]),
        material=np.vstack([model.material, np.zeros((1, columns.MATERIAL_COLUMNS))]),
        X_BG=np.vstack([model.X_BG, pose]),
        pair=np.ascontiguousarray(pairs),
    )
    return extended, np.vstack([X_WB, body])
