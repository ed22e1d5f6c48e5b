"""The process of one contender: `python -m benchmarks.worker NAME`, started by `benchmarks.race`.

The first line of standard input is the task as JSON. Each further line requests a measurement, and
the worker writes a line of JSON: wall time and agent-steps of a number of calls, and the peak
memory. The calls are repeated until at least `fill` seconds have passed.
"""

from __future__ import annotations

import json
import os
import sys
import time
from importlib import import_module
from itertools import chain
from typing import Any

from baldwinlab.core.resources import peak_memory


def main() -> None:
    task = json.loads(sys.stdin.readline())
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-task["cores"] :])
    # The import counts toward the start-up time of all contenders.
    from benchmarks.setting import Contender, from_dict

    contender: Contender = import_module(f"benchmarks.contenders.{sys.argv[1]}")
    setting = from_dict(task["setting"])
    simulate = contender.prepare(setting, task["genomes"])
    seed = 0
    for line in sys.stdin:
        min_seconds = json.loads(line)["fill"]
        calls = 0
        start_time = time.perf_counter()
        while not calls or time.perf_counter() - start_time < min_seconds:
            eaten = simulate(seed)
            calls += 1
            seed += 1
        seconds = time.perf_counter() - start_time
        measurement = {
            "seconds": seconds,
            "calls": calls,
            "agent_steps": calls * contender.agent_steps(setting),
        }
        print(
            json.dumps(
                measurement | {"eaten": mean(eaten), "peak_mib": (peak_memory() or 0) / 2**20}
            ),
            flush=True,
        )


def mean(eaten: Any) -> float | None:
    """Return the mean number of items eaten per agent, of [world][agent]."""
    if eaten is None:
        return None
    values = [float(value) for value in chain.from_iterable(eaten)]
    return sum(values) / len(values)


if __name__ == "__main__":
    main()
