"""Campaigns against sheldrake: `python dev.py torture`, or `python -m tools.torture --share 0.02`.

Each has a number of trials with chance from a seed, in processes of their own, so that a crash is counted and a hang
ends. The table says how many trials there were and what went wrong; the status is 1 if anything did.
"""

from __future__ import annotations

import argparse
import pathlib
import subprocess
import sys

from tools.torture.campaign import ROOT, Outcome, run
from tools.torture.campaigns import CAMPAIGNS

ATTACKED = ("src", "tools/torture", "tests/models", "tests/unit/systems/framework")
"""What decides about the outcome of a run."""
KINDS = ("crash", "hang", "silent", "unclear")
BEGIN, END = "<!-- made by `python dev.py torture --write docs/reliability.md` -->", "<!-- end -->"


def row(outcome: Outcome) -> list[str]:
    """A campaign as the table shows it; by name, what holds, trials, and what went wrong."""
    campaign, trials = outcome.campaign, outcome.trials * outcome.campaign.each
    return [campaign.name, campaign.says, f"{trials:,}", *(str(outcome.count(kind)) for kind in KINDS)]


def table(rows: dict[str, list[str]]) -> str:
    """The table of the documentation."""
    lines = ["| campaign | what holds | trials | crashes | hangs | silent | unclear |", "|---|---|--:|--:|--:|--:|--:|"]
    rows = {c.name: rows[c.name] for c in CAMPAIGNS if c.name in rows}
    lines += ["| " + " | ".join(cells) + " |" for cells in rows.values()]
    sums = [sum(int(cells[k].replace(",", "")) for cells in rows.values()) for k in range(2, 7)]
    lines.append("| **all** | | " + " | ".join(f"**{n:,}**" for n in sums) + " |")
    return "\n".join(lines)


def what_runs(seed: int) -> str:
    """The sentence that says of which source and chance the numbers are; what belongs to the same ones can be joined.

    Raises:
        RuntimeError: files differ from what is committed, so that no hash says what ran.
    """

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()

    if changed := git("status", "--porcelain", "--", *ATTACKED):
        raise RuntimeError(f"--write is for what is committed; these files are changed or new:\n{changed}")
    src, tools = (git("rev-parse", "--short", f"HEAD:{folder}") for folder in ("src", "tools/torture"))
    return f"All of one source, `git rev-parse HEAD:src` {src} and `HEAD:tools/torture` {tools}, with seed {seed}."


def write(path: pathlib.Path, outcomes: list[Outcome], source: str) -> None:
    """Puts the campaigns into the table of a page, which keeps rows of others from earlier runs of the same source."""
    page = path.read_text(encoding="utf-8")
    before, _, rest = page.partition(BEGIN)
    old, _, after = rest.partition(END)
    lines = [line.strip("| ").split(" | ") for line in old.splitlines() if line.startswith("|") and source in old]
    rows = {cells[0]: cells for cells in lines} | {o.campaign.name: row(o) for o in outcomes}
    path.write_text(f"{before}{BEGIN}\n\n{table(rows)}\n\n{source}\n\n{END}{after}", encoding="utf-8")


def main(words: list[str] | None = None) -> int:
    """What the command does."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "only", nargs="*", help=f"campaigns, by the beginning of their names: {', '.join(c.name for c in CAMPAIGNS)}"
    )
    parser.add_argument(
        "--share", type=float, default=1.0, help="of the trials of a whole run, which takes about an hour"
    )
    parser.add_argument("--minutes", type=float, default=20.0, help="at most, for each campaign")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--write", type=pathlib.Path, help="a page that gets the table")
    given = parser.parse_args(words)
    outcomes, source = [], what_runs(given.seed) if given.write else ""
    for campaign in CAMPAIGNS:
        if given.only and not campaign.name.startswith(tuple(given.only)):
            continue
        trials = max(1, round(given.share * campaign.trials))
        outcome = run(campaign, trials, 60 * given.minutes, given.seed)
        outcomes.append(outcome)
        wrong = ", ".join(f"{n} {kind}" for kind in KINDS if (n := outcome.count(kind))) or "nothing went wrong"
        print(
            f"{campaign.name}: {outcome.trials * campaign.each} trials in {outcome.seconds:.0f} s, {wrong}", flush=True
        )
        for failure in outcome.failures:
            print(f"---- {failure.kind} in trial {failure.number}\n{failure.text}", flush=True)
        if given.write:
            write(ROOT / given.write, outcomes, source)
    return int(any(o.failures for o in outcomes))


if __name__ == "__main__":
    sys.exit(main())
