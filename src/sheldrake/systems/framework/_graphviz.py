"""Pictures of systems as Graphviz text."""

from __future__ import annotations

from typing import Any


class Graphviz:
    """The part of System that draws it."""

    def GetGraphvizString(self, max_depth: int | None = None, options: dict[str, str] | None = None) -> str:
        """The system as a Graphviz "digraph"; diagrams deeper than `max_depth` are drawn as boxes."""
        fragment = self.GetGraphvizFragment(max_depth, options)
        return f"digraph _{self._system_id} {{\nrankdir=LR\n{''.join(fragment.fragments)}}}\n"

    def GetGraphvizFragment(self, max_depth: int | None = None, options: dict[str, str] | None = None) -> Any:
        raise NotImplementedError
