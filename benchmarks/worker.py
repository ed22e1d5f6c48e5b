"""A fresh process for one contender: `python -m benchmarks.worker NAME`, driven by `benchmarks.race`.

The first line of its standard input is the task as JSON; each further line is an order, answered by a line of JSON: the seconds
(by the wall clock and of the CPU) and agent-steps of as many calls as fill `fill` seconds (at least one), and the most memory
held so far.
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
    from benchmarks.setting import (
        Contender,
        from_dict,
    )  # here, so that it counts towards the start-up of all alike

    contender: Contender = import_module(f"benchmarks.contenders.{sys.argv[1]}")
    setting = from_dict(task["setting"])
    live, seed = contender.lives(setting, task["genomes"]), 0
    for line in sys.stdin:
        fill, calls, began, busy = (
            json.loads(line)["fill"],
            0,
            time.perf_counter(),
            time.process_time(),
        )
        while not calls or time.perf_counter() - began < fill:
            eaten = live(seed)
            calls, seed = calls + 1, seed + 1
        seconds, cpu_seconds = time.perf_counter() - began, time.process_time() - busy
        answer = {
            "seconds": seconds,
            "cpu_seconds": cpu_seconds,
            "calls": calls,
            "agent_steps": calls * contender.agent_steps(setting),
        }
        print(
            json.dumps(answer | {"eaten": mean(eaten), "peak_mib": (peak_memory() or 0) / 2**20}),
            flush=True,
        )


def mean(eaten: Any) -> float | None:
    """Items eaten by an agent, of [world][agent]."""
    if eaten is None:
        return None
    values = [float(value) for value in chain.from_iterable(eaten)]
    return sum(values) / len(values)


if __name__ == "__main__":
    main()
