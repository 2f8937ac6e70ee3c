"""What monomials become when polynomials are put in the place of variables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._variable import Variable

if TYPE_CHECKING:
    from sheldrake.symbolic._polynomial import Polynomial


class SubstituteAndExpandCacheData:
    """What `Polynomial.SubstituteAndExpand` found for monomials, kept for calls with the same substitution."""

    def __init__(self) -> None:
        self._data: dict[Monomial, Polynomial] = {}

    def get_data(self) -> dict[Monomial, Polynomial]:
        """Returns what each monomial becomes."""
        return self._data


def substituted(m: Monomial, places: dict[Variable, Polynomial], cache: dict[Monomial, Polynomial]) -> Polynomial:
    """What a monomial becomes: one factor times what the rest becomes."""
    if m not in cache:
        v, n = next(iter(m._powers.items()))
        if m.total_degree() == 1:
            cache[m] = places[v].Expand()
        else:
            rest = Monomial({**m._powers, v: n - 1})
            factor = substituted(Monomial(v), places, cache)
            cache[m] = (factor * substituted(rest, places, cache)).Expand()
    return cache[m]
