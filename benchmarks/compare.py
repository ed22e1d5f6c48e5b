"""Compare baldwinlab with alternatives: `python -m benchmarks.compare [--out DIR]`.

The command writes comparison.json and comparison.md into DIR.

A scenario consists of lifetimes of 5000 steps of 20 agents with genomes that evolved for 50
generations. Evolved agents find food, so they sense, learn and eat more than agents with random
genomes, and cost more time.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate_batch
from benchmarks.machine import provenance
from benchmarks.race import Entry, Record, race
from benchmarks.setting import Genomes, Setting, from_experiment
from benchmarks.tables import comparison_tables

OUTPUT_FOLDER = Path("build/benchmarks")
SCENARIOS = ("evo+self-taught/A", "evo/A", "evo+self-taught/B")
N_WORLDS = 8
GENERATION = 50
CONTENDERS = ("baldwinlab_lives", "python_plain", "numpy_vectorised", "jax_scan")
MULTI_CORE = ("baldwinlab_lives", "jax_scan")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument("--out", type=Path, default=OUTPUT_FOLDER)
    arguments.add_argument("--rounds", type=int, default=5)
    given = arguments.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    measured = measure(given.rounds)
    (given.out / "comparison.json").write_text(json.dumps(measured, indent=1) + "\n")
    (given.out / "comparison.md").write_text(comparison_tables(measured))
    print(comparison_tables(measured))


def measure(rounds: int) -> dict[str, Any]:
    """Return all measurements as plain data; `races` has the records of each scenario."""
    began = datetime.now(UTC).isoformat(timespec="seconds")
    machine = provenance()
    races: dict[str, list[Record]] = {}
    for name in SCENARIOS:
        print(f"measuring {name}", flush=True)
        setting, genomes = make_scenario(name)
        races[name] = race(list_entries(setting, genomes, machine["cores"]), rounds)
    return {
        "began": began,
        "machine": machine,
        "load_at_the_end": provenance()["load"],
        "rounds": rounds,
        "races": {name: [asdict(record) for record in records] for name, records in races.items()},
    }


def make_scenario(name: str) -> tuple[Setting, Genomes]:
    """Return the setting, and the genomes of generation 50 of 8 runs with seed 0."""
    experiment = load(name)
    short = experiment.replace(
        evolution={"generations": GENERATION + 1}, record={"genome_every": GENERATION}
    )
    runs = simulate_batch(short, seed=0, runs=range(N_WORLDS))
    genomes = np.stack([run["genome"].values[GENERATION] for run in runs])
    return from_experiment(experiment), genomes.tolist()


def list_entries(setting: Setting, genomes: Genomes, cores: int) -> list[Entry]:
    single_core = [Entry(name, setting, genomes) for name in CONTENDERS]
    return single_core + [Entry(name, setting, genomes, cores) for name in MULTI_CORE if cores > 1]


if __name__ == "__main__":
    main()
