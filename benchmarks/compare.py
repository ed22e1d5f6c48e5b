"""baldwinlab beside what a user would pick instead: `python -m benchmarks.compare [--out DIR]`.

Writes comparison.json, comparison.md and comparison.png and .svg into DIR.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from baldwinlab.papers.presets import paper
from benchmarks.machine import installed_mib, provenance
from benchmarks.race import Entry, Record, race
from benchmarks.scenarios import SCENARIOS, scenario
from benchmarks.setting import Genomes, Setting, from_experiment
from benchmarks.tables import draw_comparison, tables

OUT = Path("build/benchmarks")
SAME_MODEL = ("baldwinlab_lives", "python_plain", "numpy_vectorised", "jax_scan")
PUBLISHED = ("evojax_waterworld", "mesa_boids")
ALSO_ON_ALL_CORES = ("baldwinlab_lives", "jax_scan")
FIRST_STEPS = 100  # of the lives by which the time to the first result is measured
STARTS = 3  # fresh processes for that
SLOW_TO_START = "evojax_waterworld"  # it compiles for a quarter of a minute, so its one start in the race must do


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument("--out", type=Path, default=OUT)
    arguments.add_argument("--rounds", type=int, default=5)
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    found = measure(given.rounds)
    (given.out / "comparison.json").write_text(json.dumps(found, indent=1) + "\n")
    (given.out / "comparison.md").write_text(tables(found))
    draw_comparison(found, given.out)
    print(tables(found))


def measure(rounds: int) -> dict[str, Any]:
    """All races, as plain data. The keys of `races` are the scenarios, then `runs` and `starts`."""
    began, machine = datetime.now(UTC).isoformat(timespec="seconds"), provenance()
    races: dict[str, list[Record]] = {}
    for name in SCENARIOS:
        print(f"measuring {name}", flush=True)
        races[name] = race(
            entries(*scenario(name), machine["cores"], published=name == SCENARIOS[0]), rounds
        )
    print("measuring whole runs", flush=True)
    races["runs"] = whole_runs()
    print("measuring first results", flush=True)
    races["starts"] = [
        one for one in races[SCENARIOS[0]] if one.contender == SLOW_TO_START
    ] + first_results()
    contenders = {record.contender for records in races.values() for record in records}
    return {
        "began": began,
        "machine": machine,
        "load_at_the_end": provenance()["load"],
        "rounds": rounds,
        "installed_mib": {contender: installed_mib(contender) for contender in sorted(contenders)},
        "races": {name: [asdict(record) for record in records] for name, records in races.items()},
    }


def entries(setting: Setting, genomes: Genomes, cores: int, published: bool) -> list[Entry]:
    names = SAME_MODEL + PUBLISHED * published
    alone = [Entry(name, setting, genomes) for name in names]
    return alone + [Entry(name, setting, genomes, cores) for name in ALSO_ON_ALL_CORES if cores > 1]


def whole_runs() -> list[Record]:
    """The paper's six conditions with evolution, on one core."""
    return [
        race([Entry("baldwinlab_runs", from_experiment(experiment), [])], rounds=2)[0]
        for experiment in paper()
    ]


def first_results() -> list[Record]:
    """Time to the first result of a short life, in fresh processes; the last is baldwinlab where it was never compiled before."""
    setting, genomes = scenario(SCENARIOS[0])
    short = replace(setting, steps=FIRST_STEPS)
    names = [name for name in SAME_MODEL + PUBLISHED if name != SLOW_TO_START]
    found = [
        record
        for name in names * STARTS
        for record in race([Entry(name, short, genomes)], rounds=0)
    ]
    with TemporaryDirectory() as empty:
        cold = Entry("baldwinlab_lives", short, genomes, environment={"BALDWINLAB_CACHE": empty})
        return found + race([cold], rounds=0)


if __name__ == "__main__":
    main()
