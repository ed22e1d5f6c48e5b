"""Compare baldwinlab with alternatives: `python -m benchmarks.compare [--out DIR]`.

The command writes comparison.json, comparison.md, comparison.png and comparison.svg into DIR.
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

OUTPUT_FOLDER = Path("build/benchmarks")
SAME_MODEL = ("baldwinlab_lives", "python_plain", "numpy_vectorised", "jax_scan")
PUBLISHED = ("evojax_waterworld", "mesa_boids")
MULTI_CORE = ("baldwinlab_lives", "jax_scan")
# Steps of the lifetimes that measure the time to the first result, and fresh processes for it.
N_FIRST_STEPS = 100
N_STARTS = 3
# It compiles for 15 seconds, so its single start in the race is used.
SLOW_TO_START = "evojax_waterworld"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument("--out", type=Path, default=OUTPUT_FOLDER)
    arguments.add_argument("--rounds", type=int, default=5)
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    measured = measure(given.rounds)
    (given.out / "comparison.json").write_text(json.dumps(measured, indent=1) + "\n")
    (given.out / "comparison.md").write_text(tables(measured))
    draw_comparison(measured, given.out)
    print(tables(measured))


def measure(rounds: int) -> dict[str, Any]:
    """Return all measurements as plain data; `races` has the scenarios, `runs` and `starts`."""
    began = datetime.now(UTC).isoformat(timespec="seconds")
    machine = provenance()
    races: dict[str, list[Record]] = {}
    for name in SCENARIOS:
        print(f"measuring {name}", flush=True)
        races[name] = race(
            entries(*scenario(name), machine["cores"], published=name == SCENARIOS[0]), rounds
        )
    print("measuring whole runs", flush=True)
    races["runs"] = complete_runs()
    print("measuring first results", flush=True)
    slow = [record for record in races[SCENARIOS[0]] if record.contender == SLOW_TO_START]
    races["starts"] = slow + first_results()
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
    single_core = [Entry(name, setting, genomes) for name in names]
    return single_core + [Entry(name, setting, genomes, cores) for name in MULTI_CORE if cores > 1]


def complete_runs() -> list[Record]:
    """Measure complete runs of the six conditions of the paper on one core."""
    return [
        race([Entry("baldwinlab_runs", from_experiment(experiment), [])], rounds=2)[0]
        for experiment in paper()
    ]


def first_results() -> list[Record]:
    """Measure the time to the first result of a short lifetime, in fresh processes.

    The last record is baldwinlab with an empty compilation cache.
    """
    setting, genomes = scenario(SCENARIOS[0])
    short = replace(setting, steps=N_FIRST_STEPS)
    names = [name for name in SAME_MODEL + PUBLISHED if name != SLOW_TO_START]
    records: list[Record] = []
    for name in names * N_STARTS:
        records += race([Entry(name, short, genomes)], rounds=0)
    with TemporaryDirectory() as empty:
        cold = Entry("baldwinlab_lives", short, genomes, environment={"BALDWINLAB_CACHE": empty})
        return records + race([cold], rounds=0)


if __name__ == "__main__":
    main()
