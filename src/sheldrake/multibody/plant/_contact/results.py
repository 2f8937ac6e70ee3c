"""What a plant reports about contact: all contacts at one time, and those at points."""

from __future__ import annotations

import copy
import operator
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import _register_value_type
from sheldrake.multibody.plant._kernels.contact_report import PointContact
from sheldrake.multibody.tree import BodyIndex

if TYPE_CHECKING:
    from sheldrake.geometry import PenetrationAsPointPair
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo


class PointPairContactInfo:
    """One point contact between bodies A and B."""

    def __init__(
        self,
        bodyA_index: BodyIndex,
        bodyB_index: BodyIndex,
        f_Bc_W: np.ndarray,
        p_WC: np.ndarray,
        separation_speed: float,
        slip_speed: float,
        point_pair: PenetrationAsPointPair,
    ):
        """
        Args:
            bodyA_index: Body A.
            bodyB_index: Body B.
            f_Bc_W: Force on B at C, in W [N], shape (3,).
            p_WC: The contact point C, in W [m], shape (3,).
            separation_speed: Of the two points along the normal [m/s].
            slip_speed: Of the two points tangentially [m/s].
            point_pair: The PenetrationAsPointPair it comes from.
        """
        numbers = [*point_pair.p_WCa, *point_pair.p_WCb, *point_pair.nhat_BA_W, *p_WC, *f_Bc_W]
        how = np.array([[*numbers, point_pair.depth, slip_speed, separation_speed]])
        bodies = BodyIndex(int(bodyA_index)), BodyIndex(int(bodyB_index))
        who = np.array([[0, 1, 0, 1]], np.int64)
        self._all = PointContactArrays(who, how, (point_pair.id_A, point_pair.id_B), bodies)
        self._row = 0
        self._pair: PenetrationAsPointPair | None = point_pair

    @classmethod
    def _of(cls, arrays: PointContactArrays, row: int) -> PointPairContactInfo:
        """One of several, whose numbers nobody changes."""
        info = object.__new__(cls)
        info._all, info._row, info._pair = arrays, row, None
        return info

    def bodyA_index(self) -> BodyIndex:
        """Body A."""
        return self._all.bodies[self._all.pair.item(self._row, 2)]

    def bodyB_index(self) -> BodyIndex:
        """Body B."""
        return self._all.bodies[self._all.pair.item(self._row, 3)]

    def contact_force(self) -> np.ndarray:
        """Force on B at C, in W [N], shape (3,)."""
        return self._all.how[self._row, _FORCE].copy()

    def contact_point(self) -> np.ndarray:
        """p_WC [m], shape (3,)."""
        return self._all.how[self._row, _WHERE].copy()

    def separation_speed(self) -> float:
        """Speed of the two points along the normal, positive when they part [m/s]."""
        return self._all.how.item(self._row, _SEPARATION)

    def slip_speed(self) -> float:
        """Tangential speed of the two points [m/s]."""
        return self._all.how.item(self._row, _SLIP)

    def point_pair(self) -> PenetrationAsPointPair:
        """The PenetrationAsPointPair it comes from."""
        if self._pair is None:
            from sheldrake.geometry import PenetrationAsPointPair

            (A, B, _, _), how = self._all.pair[self._row].tolist(), self._all.how[self._row]
            ids, points = self._all.geometries, [how[columns].copy() for columns in _POINTS]
            self._pair = PenetrationAsPointPair._of(ids[A], ids[B], *points, how.item(_DEPTH))
        return self._pair

    def __copy__(self) -> PointPairContactInfo:
        new = self._of(self._all, self._row)
        new._pair = self._pair
        return new

    def __deepcopy__(self, memo: dict) -> PointPairContactInfo:
        return copy.copy(self)

    def __repr__(self) -> str:
        return (
            f"PointPairContactInfo(bodyA_index={int(self.bodyA_index())}, bodyB_index={int(self.bodyB_index())}, "
            f"f_Bc_W={self.contact_force().tolist()}, p_WC={self.contact_point().tolist()})"
        )


class PointContactArrays(NamedTuple):
    """Point contacts in columns, in the order of the solver (sorted by pair of geometries).

    Attributes:
        pair: Places of geometries A and B in `geometries`, then of bodies A and B in `bodies`, shape (n, 4).
        how: Where they touch and how they push, columns as in `PointContact`.
        geometries: All geometries that may touch.
        bodies: All bodies.
    """

    pair: np.ndarray
    how: np.ndarray
    geometries: Sequence[Any]
    bodies: Sequence[BodyIndex]

    @property
    def f_Bc_W(self) -> np.ndarray:
        """Forces on B [N], shape (n, 3)."""
        return self.how[:, _FORCE]

    @property
    def p_WC(self) -> np.ndarray:
        """Points [m], shape (n, 3)."""
        return self.how[:, _WHERE]


_FORCE, _WHERE = PointContact.f_Bc_W.columns, PointContact.p_WC.columns
_POINTS = PointContact.p_WCa.columns, PointContact.p_WCb.columns, PointContact.nhat_BA_W.columns
_DEPTH, _SLIP = operator.index(PointContact.depth), operator.index(PointContact.slip_speed)
_SEPARATION = operator.index(PointContact.separation_speed)


class ContactResults:
    """All contacts of a plant at one time."""

    def __init__(self) -> None:
        self._plant: MultibodyPlant | None = None
        self._made: list[PointPairContactInfo] | None = []
        self._arrays: PointContactArrays | None = None
        self._hydroelastic: list[Any] = []

    @property
    def _point_pairs(self) -> list[PointPairContactInfo]:
        if self._made is None:
            assert self._arrays is not None
            self._made = [PointPairContactInfo._of(self._arrays, row) for row in range(len(self._arrays.pair))]
        return self._made

    @_point_pairs.setter
    def _point_pairs(self, infos: list[PointPairContactInfo]) -> None:
        self._made, self._arrays = infos, None

    def _set_points(self, arrays: PointContactArrays) -> None:
        """Keeps point contacts as arrays; objects are made of them when somebody asks."""
        self._made, self._arrays = None, arrays

    def plant(self) -> MultibodyPlant | None:
        """The MultibodyPlant they come from, None when empty."""
        return self._plant

    def num_point_pair_contacts(self) -> int:
        """Number of point contacts."""
        return len(self._point_pairs) if self._arrays is None else len(self._arrays.pair)

    def point_pair_contact_info(self, i: int) -> PointPairContactInfo:
        """Point contact number i.

        Raises:
            RuntimeError: there is none.
        """
        infos = self._point_pairs
        if not 0 <= i < len(infos):
            raise RuntimeError(f"ContactResults.point_pair_contact_info(): {i} is not one of {len(infos)}.")
        return infos[i]

    def num_hydroelastic_contacts(self) -> int:
        """Number of hydroelastic contacts."""
        return len(self._hydroelastic)

    def hydroelastic_contact_info(self, i: int) -> HydroelasticContactInfo:
        """Hydroelastic contact number i.

        Raises:
            RuntimeError: there is none.
        """
        if not 0 <= i < len(self._hydroelastic):
            raise RuntimeError(
                f"ContactResults.hydroelastic_contact_info(): {i} is not one of {len(self._hydroelastic)}."
            )
        return self._hydroelastic[i]

    def num_deformable_contacts(self) -> int:
        """Zero: there are no deformable bodies."""
        return 0

    @checked
    def deformable_contact_info(self, i: int) -> NoReturn:
        """There are no deformable bodies.

        Raises:
            RuntimeError: always.
        """
        raise RuntimeError(f"ContactResults.deformable_contact_info(): {i} is not one of 0.")

    def SelectHydroelastic(self, selector: Callable[[HydroelasticContactInfo], bool]) -> ContactResults:
        """A copy with only those hydroelastic contacts that the selector wants."""
        new = copy.copy(self)
        new._hydroelastic = [info for info in self._hydroelastic if selector(info)]
        return new

    def __copy__(self) -> ContactResults:
        new = ContactResults()
        new._plant, new._hydroelastic = self._plant, list(self._hydroelastic)
        new._made = None if self._made is None else list(self._made)
        new._arrays = self._arrays
        return new

    def __deepcopy__(self, memo: dict) -> ContactResults:
        return copy.copy(self)


_register_value_type(ContactResults)
