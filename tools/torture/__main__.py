"""Campaigns against sheldrake: `python dev.py torture`, or `python -m tools.torture --share 0.02`.

Each has a number of trials with chance from a seed, in processes of their own, so that a crash is counted and a hang
ends. The table says how many trials there were and what went wrong; the status is 1 if anything did.

A whole run may be done in pieces, one after the other or side by side, and go on after it was cut off:
`--share 0.1 --seed 1 2 3 --record docs/reliability.jsonl` leaves out what the file has already, and
`--record docs/reliability.jsonl --write docs/reliability.md` alone puts the sums of all pieces into the page.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import subprocess
import sys
from typing import Any

from tools.torture.campaign import ROOT, Campaign, Outcome, run
from tools.torture.campaigns import CAMPAIGNS

ATTACKED = ("src", "tools/torture", "tests/models", "tests/unit/systems/framework")
"""What decides about the outcome of a run."""
KINDS = ("crash", "hang", "silent", "unclear")
BEGIN, END = "<!-- made by `python dev.py torture --write docs/reliability.md` -->", "<!-- end -->"


def piece(outcome: Outcome, seed: int, source: str) -> dict[str, Any]:
    """What is kept of a campaign with a seed: numbers alone."""
    trials = outcome.trials * outcome.campaign.each
    found = {"campaign": outcome.campaign.name, "seed": seed, "source": source, "trials": trials}
    return {**found, "cpu": round(outcome.cpu, 1), **{kind: outcome.count(kind) for kind in KINDS}}


def pieces_of(path: pathlib.Path | None) -> dict[tuple[str, int], dict[str, Any]]:
    """The pieces in a file, by campaign and seed; of the same ones the last."""
    lines = path.read_text().splitlines() if path and path.exists() else []
    return {(found["campaign"], found["seed"]): found for found in map(json.loads, lines)}


def is_done(found: dict[str, Any] | None, source: str) -> bool:
    """Whether a piece need not run: all went well, or it is of the source that would run again."""
    return found is not None and (found["source"] == source or not any(found[kind] for kind in KINDS))


def table(pieces: list[dict[str, Any]]) -> str:
    """The table of the documentation, and which source and chance it is of."""
    head = "| campaign | what holds | trials | crashes | hangs | silent | unclear |"
    lines = [head, "|---|---|--:|--:|--:|--:|--:|"]
    keys = ("trials", *KINDS)
    for campaign in CAMPAIGNS:
        mine = [p for p in pieces if p["campaign"] == campaign.name]
        sums = [f"{sum(p[key] for p in mine):,}" for key in keys]
        lines += [f"| {' | '.join([campaign.name, campaign.says, *sums])} |"] if mine else []
    lines.append("| **all** | | " + " | ".join(f"**{sum(p[key] for p in pieces):,}**" for key in keys) + " |")
    sources = {
        s: sum(p["trials"] for p in pieces if p["source"] == s) for s in dict.fromkeys(p["source"] for p in pieces)
    }
    of = "; ".join(f"`{source}` ({count:,} trials)" for source, count in sources.items())
    seeds = ", ".join(map(str, sorted({p["seed"] for p in pieces})))
    return (
        "\n".join(lines)
        + f"\n\nWhat ran, as `git rev-parse --short HEAD:src HEAD:tools/torture` says: {of}. Seeds {seeds}."
    )


def what_runs() -> str:
    """The source that runs.

    Raises:
        RuntimeError: files differ from what is committed, so that no hash says what ran.
    """

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()

    if changed := git("status", "--porcelain", "--", *ATTACKED):
        raise RuntimeError(f"--record is for what is committed; these files are changed or new:\n{changed}")
    return " ".join(git("rev-parse", "--short", f"HEAD:{folder}") for folder in ("src", "tools/torture"))


def write(path: pathlib.Path, pieces: list[dict[str, Any]]) -> None:
    """Puts the table into a page."""
    before, _, rest = path.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    path.write_text(f"{before}{BEGIN}\n\n{table(pieces)}\n\n{END}{after}", encoding="utf-8")


def tell(outcome: Outcome, seed: int) -> None:
    """Prints what a campaign found."""
    wrong = ", ".join(f"{n} {kind}" for kind in KINDS if (n := outcome.count(kind))) or "nothing went wrong"
    trials = f"{outcome.trials * outcome.campaign.each} trials in {outcome.seconds:.0f} s ({outcome.cpu:.1f} of CPU)"
    print(f"{outcome.campaign.name}: {trials} with seed {seed}, {wrong}", flush=True)
    for failure in outcome.failures:
        print(f"---- {failure.kind} in trial {failure.number}\n{failure.text}", flush=True)


def main(words: list[str] | None = None) -> int:
    """What the command does."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = ", ".join(c.name for c in CAMPAIGNS)
    parser.add_argument("only", nargs="*", help=f"campaigns, by the beginning of their names: {names}")
    parser.add_argument("--share", type=float, default=1.0, help="of the trials of a whole run, which takes an hour")
    parser.add_argument("--minutes", type=float, default=20.0, help="at most, for each campaign and seed")
    parser.add_argument("--seed", type=int, nargs="+", default=[])
    parser.add_argument("--record", type=pathlib.Path, help="a file that keeps what each piece found")
    parser.add_argument("--write", type=pathlib.Path, help="a page that gets the table of what is recorded")
    given = parser.parse_args(words)
    if given.write and not given.record:
        parser.error("--write needs --record")
    source = what_runs() if given.record else ""
    seeds, wrong = given.seed or ([] if given.write else [0]), False

    def wanted(campaign: Campaign, seed: int) -> bool:
        is_meant = not given.only or campaign.name.startswith(tuple(given.only))
        return is_meant and not is_done(pieces_of(given.record).get((campaign.name, seed)), source)

    for seed in seeds:
        for campaign in (c for c in CAMPAIGNS if wanted(c, seed)):
            outcome = run(campaign, max(1, round(given.share * campaign.trials)), 60 * given.minutes, seed)
            tell(outcome, seed)
            wrong = wrong or bool(outcome.failures)
            if given.record:
                given.record.parent.mkdir(parents=True, exist_ok=True)
                with given.record.open("a") as file:
                    file.write(json.dumps(piece(outcome, seed, source)) + "\n")
    if given.write:
        write(ROOT / given.write, list(pieces_of(given.record).values()))
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
