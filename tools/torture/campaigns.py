"""All campaigns, in the order of the table."""

from __future__ import annotations

from tools.torture import calls, diagrams, files, numbers, parsers, programs, viewer
from tools.torture.campaign import Campaign

SANITIZED = {"SHELDRAKE_SANITIZE": "1"}
CAMPAIGNS = [
    Campaign("model files, changed", parsers.changed_models, 30_000, 100.0, "a model or an error with its place"),
    Campaign("model files, made", parsers.new_models, 25_000, 100.0, "a model or an error with its place"),
    Campaign("model files, nonsense", parsers.nonsense, 400, 10.0, "nothing is dropped without a word"),
    Campaign("mesh files", parsers.some_meshes, 50_000, 10.0, "a finite mesh or an error that names the file"),
    Campaign(
        "random diagrams",
        diagrams.random_diagrams,
        100,
        60.0,
        "native = interpreted = oracle, every address checked",
        SANITIZED,
    ),
    Campaign(
        "programs of calls",
        programs.some_programs,
        400,
        600.0,
        "native = interpreted; results or errors",
        each=programs.PROGRAMS,
    ),
    Campaign(
        "odd calls", calls.odd_calls, 500, 60.0, "an error in words; others compute on", SANITIZED, each=calls.CALLS
    ),
    Campaign(
        "odd numbers",
        numbers.odd_numbers,
        4000,
        60.0,
        "an error in words, or a step whose numbers are finite",
        SANITIZED,
    ),
    Campaign("contexts, cut", files.cut_contexts, 4000, 20.0, "refused by name", SANITIZED),
    Campaign("contexts, changed", files.changed_contexts, 6000, 20.0, "refused by name, or steps", SANITIZED),
    Campaign("logs, damaged", files.damaged_logs, 6000, 20.0, "refused by name, or whole samples"),
    Campaign("full disks", files.full_disks, 3000, 20.0, "the whole new file, or the old one and an error"),
    Campaign("caches, damaged", files.caches, 6000, 20.0, "compiled anew"),
    Campaign("compiles, killed", files.killed_compiles, 400, 20.0, "compiled by the next"),
    Campaign("viewer", viewer.clients, 3000, 60.0, "no answer of 500; a proper page is served"),
]
