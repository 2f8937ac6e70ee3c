"""What a plant reports about contact: all contacts at one time, and those at points."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import _register_value_type
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
        self._A, self._B = BodyIndex(int(bodyA_index)), BodyIndex(int(bodyB_index))
        self._f_Bc_W, self._p_WC = np.array(f_Bc_W), np.array(p_WC)
        self._separation, self._slip, self._pair = separation_speed, slip_speed, point_pair

    @classmethod
    def _of(
        cls, A: BodyIndex, B: BodyIndex, f_Bc_W: np.ndarray, p_WC: np.ndarray, separation: float, slip: float, pair: Any
    ) -> PointPairContactInfo:
        """One whose arrays nobody changes; `pair` has the fields of a PenetrationAsPointPair, in order."""
        info = object.__new__(cls)
        info._A, info._B, info._f_Bc_W, info._p_WC = A, B, f_Bc_W, p_WC
        info._separation, info._slip, info._pair = separation, slip, pair
        return info

    def bodyA_index(self) -> BodyIndex:
        """Body A."""
        return self._A

    def bodyB_index(self) -> BodyIndex:
        """Body B."""
        return self._B

    def contact_force(self) -> np.ndarray:
        """Force on B at C, in W [N], shape (3,)."""
        return self._f_Bc_W.copy()

    def contact_point(self) -> np.ndarray:
        """p_WC [m], shape (3,)."""
        return self._p_WC.copy()

    def separation_speed(self) -> float:
        """Speed of the two points along the normal, positive when they part [m/s]."""
        return self._separation

    def slip_speed(self) -> float:
        """Tangential speed of the two points [m/s]."""
        return self._slip

    def point_pair(self) -> PenetrationAsPointPair:
        """The PenetrationAsPointPair it comes from."""
        if type(self._pair) is tuple:
            from sheldrake.geometry import PenetrationAsPointPair

            self._pair = PenetrationAsPointPair._of(*self._pair)
        return self._pair

    def __copy__(self) -> PointPairContactInfo:
        return PointPairContactInfo(
            self._A, self._B, self._f_Bc_W, self._p_WC, self._separation, self._slip, self.point_pair()
        )

    def __deepcopy__(self, memo: dict) -> PointPairContactInfo:
        return copy.copy(self)

    def __repr__(self) -> str:
        return (
            f"PointPairContactInfo(bodyA_index={int(self._A)}, bodyB_index={int(self._B)}, "
            f"f_Bc_W={self._f_Bc_W.tolist()}, p_WC={self._p_WC.tolist()})"
        )


class PointContactArrays(NamedTuple):
    """Point contacts in columns.

    Attributes:
        pair: Places of geometries A and B in `geometries`, then of bodies A and B in `bodies`, shape (n, 4).
        geometries: All geometries that may touch.
        bodies: All bodies.
        f_Bc_W: Forces on B [N], shape (n, 3).
        p_WC: Points [m], shape (n, 3).
    """

    pair: np.ndarray
    geometries: Sequence[Any]
    bodies: Sequence[BodyIndex]
    f_Bc_W: np.ndarray
    p_WC: np.ndarray


class ContactResults:
    """All contacts of a plant at one time."""

    def __init__(self) -> None:
        self._plant: MultibodyPlant | None = None
        self._made: list[PointPairContactInfo] | None = []
        self._make: Callable[[], list[PointPairContactInfo]] | None = None
        self._arrays: PointContactArrays | None = None
        self._hydroelastic: list[Any] = []

    @property
    def _point_pairs(self) -> list[PointPairContactInfo]:
        if self._made is None:
            assert self._make is not None
            self._made = self._make()
        return self._made

    @_point_pairs.setter
    def _point_pairs(self, infos: list[PointPairContactInfo]) -> None:
        self._made, self._make, self._arrays = infos, None, None

    def _set_points(self, arrays: PointContactArrays, make: Callable[[], list[PointPairContactInfo]]) -> None:
        """Keeps point contacts as arrays; objects are made of them when somebody asks."""
        self._made, self._make, self._arrays = None, make, arrays

    def plant(self) -> MultibodyPlant | None:
        """The MultibodyPlant they come from, None when empty."""
        return self._plant

    def num_point_pair_contacts(self) -> int:
        """Number of point contacts."""
        return len(self._point_pairs) if self._arrays is None else len(self._arrays.p_WC)

    def point_pair_contact_info(self, i: int) -> PointPairContactInfo:
        """Point contact number i.

        Raises:
            RuntimeError: there is none.
        """
        if not 0 <= i < len(self._point_pairs):
            raise RuntimeError(f"ContactResults.point_pair_contact_info(): {i} is not one of {len(self._point_pairs)}.")
        return self._point_pairs[i]

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
        new._make, new._arrays = self._make, self._arrays
        return new

    def __deepcopy__(self, memo: dict) -> ContactResults:
        return copy.copy(self)


_register_value_type(ContactResults)
