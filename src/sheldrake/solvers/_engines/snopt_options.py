"""Names of SNOPT's options, understood as SNOPT does: by the beginnings of their first two words, in any case."""

from __future__ import annotations

from collections.abc import Iterable

_FIRST_WORDS = """
    aij backup bounds central cg check coefficients cold columns debug defaults difference dump elements error expand
    factorization function infinite insert iterations list load log lower maximize minimize mps new nonderivative
    objective old optimality partial penalty pivot problem proximal punch ranges reduced rhs rows save sticky
    superbasics suppress system time timing upper user violation warm
""".split()
_SECOND_WORDS = {
    "crash": "option tolerance",
    "derivative": "level linesearch option",
    "elastic": "mode objective weight",
    "feasibility": "tolerance",
    "feasible": "point",
    "hessian": "dimension flush frequency full limited updates",
    "linesearch": "tolerance",
    "lu": "complete density diagonal factor partial rook singularity swap update",
    "major": "feasibility iterations optimality print step",
    "minor": "feasibility iterations optimality print",
    "print": "file frequency level",
    "qpsolver": "cg cholesky qn",
    "scale": "option print tolerance",
    "solution": "file no yes",
    "start": "constraint objective",
    "stop": "constraint objective",
    "summary": "file frequency",
    "total": "character integer real",
    "unbounded": "objective step",
    "verify": "level",
}
_PAIRS = [(word, "") for word in _FIRST_WORDS]
_PAIRS += [(first, second) for first, seconds in _SECOND_WORDS.items() for second in seconds.split()]


def words_of(name: str) -> tuple[str, str] | None:
    """The words in full that tell an option from others, such as ("major", "iterations"); None for no option."""
    first, second, *_ = [*name.lower().split(), "", ""]
    for known in _PAIRS:
        if first and known[0].startswith(first) and (not known[1] or (second and known[1].startswith(second))):
            return known
    return None


def unknown(names: Iterable[str]) -> list[str]:
    """Those that name no option, in alphabetical order."""
    return sorted(name for name in names if words_of(name) is None)
