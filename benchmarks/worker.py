"""A fresh process for one contender: `python -m benchmarks.worker NAME`, driven by `benchmarks.race`.

The first line of its standard input is the task as JSON; each further line is an order, answered by a line of JSON: the seconds
(by the wall clock and of the CPU) and agent-steps of as many calls as fill `fill` seconds (at least one), and the most memory
held so far.
"""

from __future__ import annotations

import json
import os
import re
import resource
import sys
import time
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any

MIB_PER_UNIT = 1 / 2**20 if sys.platform == "darwin" else 1 / 2**10  # of ru_maxrss
HIGH_WATER = re.compile(r"^VmHWM:\s*(\d+) kB", re.MULTILINE)


def main() -> None:
    task = json.loads(sys.stdin.readline())
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-task["cores"] :])
    from benchmarks.setting import Contender, from_dict  # here, so that it counts towards the start-up of all alike

    contender: Contender = import_module(f"benchmarks.contenders.{sys.argv[1]}")
    setting = from_dict(task["setting"])
    live, seed = contender.lives(setting, task["genomes"]), 0
    for line in sys.stdin:
        fill, calls, began, busy = json.loads(line)["fill"], 0, time.perf_counter(), time.process_time()
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
        print(json.dumps(answer | {"eaten": mean(eaten), "peak_mib": peak_mib()}), flush=True)


def mean(eaten: Any) -> float | None:
    """Items eaten by an agent, of [world][agent]."""
    if eaten is None:
        return None
    values = [float(value) for value in chain.from_iterable(eaten)]
    return sum(values) / len(values)


def peak_mib() -> float:
    """The most memory that this process held. On Linux ru_maxrss would begin with the parent's, so it is read elsewhere."""
    status = Path("/proc/self/status")
    if status.exists() and (found := HIGH_WATER.search(status.read_text())):
        return int(found[1]) / 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * MIB_PER_UNIT


if __name__ == "__main__":
    main()
