"""Has baldwinlab become slower? `python benchmarks/regression.py [--record]`.

Its agent-steps a second over those of the NumPy contender, measured in turns in one go, against the ratio in recorded.json.
Both work on one core and are timed by the CPU's clock, so that others at work on the machine matter less.
Exit status 1 and one sentence if the ratio of any scenario fell by more than 15 %. A ratio holds for one kind of CPU.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent))

from benchmarks.machine import provenance
from benchmarks.race import Entry, cpu_ratios, race
from benchmarks.scenarios import SCENARIOS, scenario

RECORD = Path(__file__).with_name("recorded.json")
CONTENDERS = ("baldwinlab_lives", "numpy_vectorised")
ROUNDS = 9
ALLOWED = 0.15


def measure() -> dict[str, float]:
    """Median ratio of the rounds, by scenario."""
    found = {}
    for name in SCENARIOS:
        setting, genomes = scenario(name)
        ours, theirs = race(
            [Entry(contender, setting, genomes) for contender in CONTENDERS], ROUNDS
        )
        for record in (ours, theirs):
            if record.not_measured:
                sys.exit(f"{record.contender} could not be measured: {record.not_measured}")
        found[name] = round(median(cpu_ratios(ours, theirs)), 2)
    return found


def verdict(now: dict[str, float], recorded: dict[str, Any]) -> str | None:
    """What has become slower by more than is allowed, in a sentence; None if nothing has."""
    slower = [
        f"{name} ({now[name]:g} times NumPy's speed, recorded were {recorded['ratios'][name]:g})"
        for name in now
        if now[name] < (1 - ALLOWED) * recorded["ratios"][name]
    ]
    return (
        f"baldwinlab has become slower by more than {ALLOWED:.0%} in {' and in '.join(slower)}."
        if slower
        else None
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument(
        "--record", action="store_true", help="keep what is measured now as the record"
    )
    given, now = arguments.parse_args(), measure()
    if given.record:
        RECORD.write_text(json.dumps({"ratios": now, "machine": provenance()}, indent=1) + "\n")
        print(f"recorded: {now}")
        return
    recorded = json.loads(RECORD.read_text())
    if recorded["machine"]["cpu"] != provenance()["cpu"]:
        print(
            f"the record was made on another CPU ({recorded['machine']['cpu']}), so it says little about this one"
        )
    if sentence := verdict(now, recorded):
        sys.exit(sentence)
    print(
        "not slower than recorded: "
        + ", ".join(f"{name} {now[name]:g} ({recorded['ratios'][name]:g})" for name in now)
    )


if __name__ == "__main__":
    main()
