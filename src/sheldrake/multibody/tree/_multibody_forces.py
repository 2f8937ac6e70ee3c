"""Forces on a whole plant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch

if TYPE_CHECKING:
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant


class MultibodyForces:
    """Generalized forces, and spatial forces on the bodies at their origins, in W."""

    _scalar: type = float

    def __init__(self, plant: MultibodyPlant | None = None, nv: int | None = None, *, nb: int | None = None):
        """
        Args:
            plant: The MultibodyPlant they are for, or its number of bodies.
            nv: Number of velocities, when `plant` is a number of bodies.
            nb: Number of bodies, by name.
        """
        dtype: Any = float if self._scalar is float else object
        if nb is None and isinstance(plant, (int, np.integer)):
            nb, plant = int(plant), None
        is_of_plant = nb is None and nv is None and hasattr(plant, "num_velocities")
        if not is_of_plant and (nb is None or nv is None):
            raise Mismatch(
                "MultibodyForces(): incompatible constructor arguments. Takes (plant: MultibodyPlant) or "
                "(nb: int, nv: int)."
            )
        if plant is not None and is_of_plant:
            if not plant.is_finalized():
                raise RuntimeError(
                    "MultibodyForces(): this plant is pre-finalize; it answers once Finalize() is called."
                )
            nb, nv, dtype = plant.num_bodies(), plant.num_velocities(), float if plant._scalar is float else object
        self._zero = 0.0 if plant is None else plant._scalar(0.0)
        self._F_Bo_W, self._tau = np.zeros((int(nb or 0), 6), dtype), np.zeros(int(nv or 0), dtype)
        if dtype is object:
            self.SetZero()

    def num_bodies(self) -> int:
        """Number of bodies."""
        return len(self._F_Bo_W)

    def num_velocities(self) -> int:
        """Number of generalized forces."""
        return len(self._tau)

    def require_fitting(self, call: str, num_bodies: int, num_velocities: int) -> None:
        """Refuses to be used for a plant of another size.

        Raises:
            RuntimeError: they are for another number of bodies or velocities.
        """
        if len(self._F_Bo_W) != num_bodies or len(self._tau) != num_velocities:
            raise RuntimeError(
                f"{call}(): the forces are for {self.num_bodies()} bodies and {self.num_velocities()} velocities, "
                f"this plant has {num_bodies} and {num_velocities}; MultibodyForces(plant) fits it."
            )

    def SetZero(self) -> MultibodyForces:
        """Makes all forces zero."""
        self._F_Bo_W.fill(self._zero)
        self._tau.fill(self._zero)
        return self

    def generalized_forces(self) -> np.ndarray:
        """Generalized forces [N or N m], shape (nv,)."""
        return self._tau.copy()

    def mutable_generalized_forces(self) -> np.ndarray:
        """The same, for writing."""
        return self._tau

    def body_forces(self) -> list[Any]:
        """Spatial forces at the body origins, in W, by body."""
        from sheldrake.multibody.math import SpatialForce

        return [SpatialForce(F) for F in self._F_Bo_W]

    @checked
    def AddInForces(self, addend: MultibodyForces) -> None:
        """Adds other forces.

        Raises:
            RuntimeError: they are for another number of bodies or velocities.
        """
        if addend._F_Bo_W.shape != self._F_Bo_W.shape or addend._tau.shape != self._tau.shape:
            raise RuntimeError(
                f"MultibodyForces.AddInForces(): these forces are for {self.num_bodies()} bodies and "
                f"{self.num_velocities()} velocities, the others for {addend.num_bodies()} and "
                f"{addend.num_velocities()}."
            )
        self._F_Bo_W += addend._F_Bo_W
        self._tau += addend._tau

    def __copy__(self) -> MultibodyForces:
        new = object.__new__(MultibodyForces)
        new._zero, new._F_Bo_W, new._tau = self._zero, self._F_Bo_W.copy(), self._tau.copy()
        return new

    def __deepcopy__(self, memo: dict) -> MultibodyForces:
        return self.__copy__()
