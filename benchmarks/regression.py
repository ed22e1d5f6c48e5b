"""Detect a loss of speed: `python benchmarks/regression.py [--record]`.

The script measures baldwinlab and the NumPy contender in turns, and compares the ratio of their
speeds with recorded.json. Both use one core and are timed by CPU time, so other processes matter
less. The exit status is 1 if the ratio of a scenario fell by more than 15 %. A ratio is valid for
one kind of CPU.
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

RECORD_FILE = Path(__file__).with_name("recorded.json")
CONTENDERS = ("baldwinlab_lives", "numpy_vectorised")
N_ROUNDS = 9
# Largest loss of the ratio that is accepted, as a share.
MAX_LOSS = 0.15


def measure() -> dict[str, float]:
    """Return the median ratio of the rounds, by scenario."""
    ratios = {}
    for name in SCENARIOS:
        setting, genomes = scenario(name)
        baldwinlab_record, numpy_record = race(
            [Entry(contender, setting, genomes) for contender in CONTENDERS], N_ROUNDS
        )
        for record in (baldwinlab_record, numpy_record):
            if record.not_measured:
                sys.exit(f"{record.contender} could not be measured: {record.not_measured}")
        ratios[name] = round(median(cpu_ratios(baldwinlab_record, numpy_record)), 2)
    return ratios


def describe_loss(ratios: dict[str, float], recorded: dict[str, Any]) -> str | None:
    """Return a sentence about the scenarios that lost too much speed, or None."""
    slower = [
        f"{name} ({ratios[name]:g} times NumPy's speed, recorded were {recorded['ratios'][name]:g})"
        for name in ratios
        if ratios[name] < (1 - MAX_LOSS) * recorded["ratios"][name]
    ]
    return (
        f"baldwinlab has become slower by more than {MAX_LOSS:.0%} in {' and in '.join(slower)}."
        if slower
        else None
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument(
        "--record", action="store_true", help="write the measured ratios to recorded.json"
    )
    options = arguments.parse_args()
    ratios = measure()
    if options.record:
        RECORD_FILE.write_text(
            json.dumps({"ratios": ratios, "machine": provenance()}, indent=1) + "\n"
        )
        print(f"recorded: {ratios}")
        return
    recorded = json.loads(RECORD_FILE.read_text())
    if recorded["machine"]["cpu"] != provenance()["cpu"]:
        print(f"The record is from another CPU ({recorded['machine']['cpu']}): compare with care.")
    if sentence := describe_loss(ratios, recorded):
        sys.exit(sentence)
    print(
        "not slower than recorded: "
        + ", ".join(f"{name} {ratios[name]:g} ({recorded['ratios'][name]:g})" for name in ratios)
    )


if __name__ == "__main__":
    main()
