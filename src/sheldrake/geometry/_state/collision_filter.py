"""Which pairs of geometries may touch: declarations, and the manager that applies them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, NamedTuple

from sheldrake.common._checked import checked
from sheldrake.common._no_constructor import no_constructor
from sheldrake.geometry._ids import FilterId, GeometryId
from sheldrake.geometry._roles import CollisionFilterScope
from sheldrake.geometry._state.geometry_set import GeometrySet

if TYPE_CHECKING:
    from typing_extensions import Self

Resolver = Callable[[GeometrySet, CollisionFilterScope], "set[GeometryId]"]


class _Statement(NamedTuple):
    allow: bool
    set_A: GeometrySet
    set_B: GeometrySet | None  # None: within set_A


class CollisionFilterDeclaration:
    """A list of statements that allow or exclude contact between or within sets; later statements win."""

    @checked
    def __init__(self, scope: CollisionFilterScope = CollisionFilterScope.kAll) -> None:
        self._scope = scope
        self._statements: list[_Statement] = []

    @checked
    def AllowBetween(self, set_A: GeometrySet, set_B: GeometrySet) -> CollisionFilterDeclaration:
        """Allows contact of every geometry of A with every geometry of B."""
        return self._add(True, set_A, set_B)

    def AllowWithin(self, geometry_set: GeometrySet) -> CollisionFilterDeclaration:
        """Allows contact of every pair in the set."""
        return self._add(True, geometry_set, None)

    @checked
    def ExcludeBetween(self, set_A: GeometrySet, set_B: GeometrySet) -> CollisionFilterDeclaration:
        """Excludes contact of every geometry of A with every geometry of B."""
        return self._add(False, set_A, set_B)

    def ExcludeWithin(self, geometry_set: GeometrySet) -> CollisionFilterDeclaration:
        """Excludes contact of every pair in the set."""
        return self._add(False, geometry_set, None)

    def _add(self, allow: bool, set_A: GeometrySet, set_B: GeometrySet | None) -> CollisionFilterDeclaration:
        for value in (set_A,) if set_B is None else (set_A, set_B):
            if not isinstance(value, GeometrySet):
                raise TypeError(f"CollisionFilterDeclaration: expected a GeometrySet, got {value!r}.")
        self._statements.append(_Statement(allow, set_A._copy(), None if set_B is None else set_B._copy()))
        return self


Pair = tuple[GeometryId, GeometryId]


def ordered_pair(a: GeometryId, b: GeometryId) -> Pair:
    """The two ids, smaller first."""
    return (a, b) if a._value < b._value else (b, a)


class CollisionFilter:
    """The pairs a user excluded: a persistent layer and transient layers on top of it.

    Pairs that can never touch (same frame, both anchored) are not its business.
    """

    def __init__(self) -> None:
        self._excluded: frozenset[Pair] = frozenset()
        self._transient: tuple[tuple[FilterId, dict[Pair, bool]], ...] = ()
        self._effective: frozenset[Pair] | None = frozenset()
        self._inactive: frozenset[GeometryId] = frozenset()

    def copy(self) -> CollisionFilter:
        """An independent copy."""
        new = CollisionFilter()
        new.__dict__.update(self.__dict__)
        return new

    def parts(self) -> tuple[object, ...]:
        """What says which pairs are excluded: the very same objects until others are."""
        return self._declared(), self._inactive

    def excluded(self, among: Iterable[GeometryId] = ()) -> frozenset[Pair]:
        """The pairs that declarations exclude, smaller id first, and those of inactive geometries `among` these."""
        excluded = self._declared()
        if not self._inactive:
            return excluded
        ids = list(among)
        return excluded.union(ordered_pair(a, b) for a in self._inactive.intersection(ids) for b in ids if a != b)

    def _declared(self) -> frozenset[Pair]:
        if self._effective is None:
            effective = set(self._excluded)
            for _, layer in self._transient:
                effective -= {pair for pair, allow in layer.items() if allow}
                effective |= {pair for pair, allow in layer.items() if not allow}
            self._effective = frozenset(effective)
        return self._effective

    def has_transient_history(self) -> bool:
        return bool(self._transient)

    def apply(self, declaration: CollisionFilterDeclaration, resolve: Resolver) -> None:
        if self._transient:
            raise RuntimeError(
                "CollisionFilterManager.Apply(): You cannot attempt to modify the persistent collision filter "
                "configuration when there are active, transient filter declarations"
            )
        layer = _pairs(declaration, resolve)
        excluded = {pair for pair, allow in layer.items() if not allow}
        allowed = {pair for pair, allow in layer.items() if allow}
        self._excluded = (self._excluded - allowed) | excluded
        self._effective = None

    def apply_transient(self, declaration: CollisionFilterDeclaration, resolve: Resolver) -> FilterId:
        filter_id = FilterId.get_new_id()
        self._transient = (*self._transient, (filter_id, _pairs(declaration, resolve)))
        self._effective = None
        return filter_id

    def is_active(self, filter_id: FilterId) -> bool:
        return any(known == filter_id for known, _ in self._transient)

    def remove_declaration(self, filter_id: FilterId) -> bool:
        if not self.is_active(filter_id):
            return False
        self._transient = tuple(entry for entry in self._transient if entry[0] != filter_id)
        self._effective = None
        return True

    def deactivate(self, ids: set[GeometryId]) -> None:
        """Lets geometries touch nothing, whatever declarations say."""
        self._inactive = self._inactive | ids

    def activate(self, ids: set[GeometryId]) -> None:
        """Takes `deactivate` back."""
        self._inactive = self._inactive - ids

    def exclude(self, pairs: set[Pair]) -> None:
        """Adds persistent exclusions."""
        self._excluded = self._excluded | pairs
        self._effective = None

    def remove_geometry(self, geometry_id: GeometryId) -> None:
        """Forgets a geometry."""
        self._inactive = self._inactive - {geometry_id}
        self._excluded = frozenset(pair for pair in self._excluded if geometry_id not in pair)
        self._transient = tuple(
            (filter_id, {pair: allow for pair, allow in layer.items() if geometry_id not in pair})
            for filter_id, layer in self._transient
        )
        self._effective = None


def _pairs(declaration: CollisionFilterDeclaration, resolve: Resolver) -> dict[Pair, bool]:
    """What a declaration says of each pair it names; nothing is applied yet, so an error changes nothing."""
    if not isinstance(declaration, CollisionFilterDeclaration):
        raise TypeError(f"CollisionFilterManager: expected a CollisionFilterDeclaration, got {declaration!r}.")
    scope = declaration._scope
    layer: dict[Pair, bool] = {}
    for allow, set_A, set_B in declaration._statements:
        ids_A = resolve(set_A, scope)
        ids_B = ids_A if set_B is None else resolve(set_B, scope)
        for a in ids_A:
            for b in ids_B:
                if a != b:
                    layer[ordered_pair(a, b)] = allow
    return layer


@no_constructor("Use SceneGraph.collision_filter_manager().")
class CollisionFilterManager:
    """Changes which pairs of a SceneGraph (its model, or the copy in one context) may touch."""

    @classmethod
    def _make(cls, edit: Callable[[], tuple[CollisionFilter, Resolver]], read: Callable[[], CollisionFilter]) -> Self:
        manager = object.__new__(cls)
        manager._edit = edit
        manager._read = read
        return manager

    _edit: Callable[[], tuple[CollisionFilter, Resolver]]
    _read: Callable[[], CollisionFilter]

    def Apply(self, declaration: CollisionFilterDeclaration) -> None:
        """Applies a declaration for good. Geometries registered later are not affected.

        Raises:
            RuntimeError: a transient declaration is active, or the declaration names an unknown frame or geometry.
        """
        collision_filter, resolve = self._edit()
        collision_filter.apply(declaration, resolve)

    def ApplyTransient(self, declaration: CollisionFilterDeclaration) -> FilterId:
        """Applies a declaration until it is removed; returns its id."""
        collision_filter, resolve = self._edit()
        return collision_filter.apply_transient(declaration, resolve)

    @checked
    def Deactivate(self, geometry_set: GeometrySet) -> None:
        """Lets the geometries of a set touch nothing until they are activated; declarations do not matter meanwhile.

        Raises:
            RuntimeError: the set names an unknown frame or geometry.
        """
        collision_filter, resolve = self._edit()
        collision_filter.deactivate(resolve(geometry_set, CollisionFilterScope.kAll))

    @checked
    def Activate(self, geometry_set: GeometrySet) -> None:
        """Takes `Deactivate` back: the geometries of a set touch what declarations allow.

        Raises:
            RuntimeError: the set names an unknown frame or geometry.
        """
        collision_filter, resolve = self._edit()
        collision_filter.activate(resolve(geometry_set, CollisionFilterScope.kAll))

    @checked
    def RemoveDeclaration(self, filter_id: FilterId) -> bool:
        """Removes a transient declaration; returns whether it was active."""
        if not self.IsActive(filter_id):
            return False
        collision_filter, _ = self._edit()
        return collision_filter.remove_declaration(filter_id)

    @checked
    def IsActive(self, filter_id: FilterId) -> bool:
        """True if the transient declaration has been applied and not removed."""
        return self._read().is_active(filter_id)

    def has_transient_history(self) -> bool:
        """True if any transient declaration is active."""
        return self._read().has_transient_history()
