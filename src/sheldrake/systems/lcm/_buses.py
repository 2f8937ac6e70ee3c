"""Connections by name."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from sheldrake.common._overloads import Mismatch
from sheldrake.lcm import DrakeLcm, DrakeLcmInterface, DrakeLcmParams
from sheldrake.systems.lcm._systems import LcmInterfaceSystem
from sheldrake.systems.primitives import SharedPointerSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework import DiagramBuilder

NULL_URL = "memq://null"


class LcmBuses:
    """Connections by name."""

    kLcmUrlMemqNull = NULL_URL
    """URL of a connection that nobody else is on: what asks for it gets no LCM."""

    def __init__(self) -> None:
        self._buses: dict[str, DrakeLcmInterface] = {}

    def size(self) -> int:
        """How many there are."""
        return len(self._buses)

    def GetAllBusNames(self) -> list[str]:
        """Their names, sorted."""
        return sorted(self._buses)

    def Find(self, description_of_caller: str, bus_name: str) -> DrakeLcmInterface:
        """The connection of this name.

        Args:
            description_of_caller: Who asks, for the error.
            bus_name: The name.

        Raises:
            RuntimeError: there is none.
        """
        if bus_name not in self._buses:
            raise RuntimeError(
                f"{description_of_caller} requested an LCM bus '{bus_name}' that does not exist "
                f"(there are: {', '.join(self.GetAllBusNames()) or 'none'})"
            )
        return self._buses[bus_name]

    def Add(self, bus_name: str, bus: DrakeLcmInterface) -> None:
        """Adds a connection.

        Raises:
            RuntimeError: the name is taken.
        """
        if not isinstance(bus, DrakeLcmInterface):
            raise Mismatch(f"LcmBuses.Add(): incompatible function arguments: {bus!r} is no DrakeLcmInterface")
        if bus_name in self._buses:
            raise RuntimeError(f"An LCM bus with name '{bus_name}' has already been defined")
        self._buses[bus_name] = bus


def ApplyLcmBusConfig(lcm_buses: dict[str, DrakeLcmParams | None], builder: DiagramBuilder) -> LcmBuses:
    """Makes the connections and adds, for each, what keeps it going to a builder.

    Args:
        lcm_buses: Settings by name; None, or the URL "memq://null", is a connection to nobody.
        builder: Where the systems go.
    """
    buses = LcmBuses()
    for name, params in lcm_buses.items():
        if params is not None and not isinstance(params, DrakeLcmParams):
            raise Mismatch(
                f"ApplyLcmBusConfig(): incompatible function arguments: bus {name!r}: {params!r} is no DrakeLcmParams"
            )
    for name, params in sorted(lcm_buses.items()):
        if params is None or params.lcm_url == NULL_URL:
            lcm: DrakeLcmInterface = DrakeLcm(NULL_URL)
        else:
            lcm = DrakeLcm(params)
            logging.getLogger("drake").info("LCM bus '%s' created for URL %s", name, lcm.get_lcm_url())
        builder.AddNamedSystem(f"DrakeLcm(bus_name={name})", SharedPointerSystem(lcm))
        if lcm.get_lcm_url() != NULL_URL:
            lcm = builder.AddNamedSystem(f"LcmInterfaceSystem(bus_name={name})", LcmInterfaceSystem(lcm))
        buses.Add(name, lcm)
    return buses
