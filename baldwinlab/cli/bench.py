"""Measuring the machine."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.benchmark import bench as benchmark
from baldwinlab.api.benchmark import machine
from baldwinlab.cli.options import BackendName, Force, Parts
from baldwinlab.core import console
from baldwinlab.core.files import write_atomically
from baldwinlab.core.output_paths import require_writable


def bench(
    *,
    quick: Annotated[bool, Parameter(help="measure less of each case", negative="")] = False,
    backend: BackendName = "auto",
    rules: Annotated[
        bool, Parameter(help="measure every learning rule, too; each compiles first", negative="")
    ] = False,
    part: Parts = None,
    json: Annotated[
        Path | None, Parameter(help="a file for the records, for other programs")
    ] = None,
    force: Force = False,
) -> None:
    """Measure this machine: agent-steps a second of a study, of each condition, and of large worlds.

    With --rules, also of the first paper's agents on map A under each learning rule. With --part, also of
    the parts in each file, in the small worlds in which `check` tries them.
    """
    if json:
        require_writable("--json", json, b"agent_steps_per_second", force=force)
    records = []
    console.info(
        f"{'case':<22} {'million agent-steps/s':>22} {'seconds':>9} {'compile s':>10} {'peak MiB':>9} {'threads':>8}"
    )
    for record in benchmark(quick, backend, part or (), rules):
        records.append(record._asdict())
        rate = record.agent_steps_per_second / 1e6
        peak = "?" if record.peak_mib is None else f"{record.peak_mib:.0f}"
        numbers = f"{rate:>22.1f} {record.seconds:>9.2f} {record.compile_seconds:>10.2f} {peak:>9} {record.threads:>8}"
        console.info(f"{record.case:<22} {numbers}")
    if json:
        write_atomically(
            json, (dumps({"machine": machine(), "records": records}, indent=2) + "\n").encode()
        )
        console.info(f"records: {json}")
