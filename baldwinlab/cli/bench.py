"""The command `bench`: measure the speed of this machine."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from baldwinlab.api.benchmark import measure_cases
from baldwinlab.api.machine import describe_machine
from baldwinlab.cli.options import FLAG, OVERWRITE_FORCE, Backend, Parts
from baldwinlab.core import console
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.output_paths import require_writable

MILLION: Final = 1e6


def bench(
    *,
    quick: Annotated[bool, FLAG, Parameter(help="Use shorter measurements.")] = False,
    backend: Backend = "auto",
    all_rules: Annotated[
        bool, FLAG, Parameter(help="Also measure every learning rule. Each rule is compiled first.")
    ] = False,
    part: Parts = None,
    out: Annotated[
        Path | None, Parameter(help="JSON file for the measured values. Default: no file.")
    ] = None,
    force: Annotated[bool, FLAG, Parameter(help=OVERWRITE_FORCE)] = False,
) -> None:
    """Measure this machine in agent-steps per second: a study, each condition, and large worlds.

    With --all-rules, also measure the agents of the first paper on map A under each learning rule.
    With --part, also measure the parts in each file, in the small worlds of `check`. The
    values are printed. Nothing is written unless --out is given.

    For example:

        baldwinlab bench --quick
    """
    if out:
        # Every file of this command contains this key.
        require_writable("--out", out, b"agent_steps_per_second", force=force)
    records = []
    console.info(
        f"{'case':<22} {'million agent-steps/s':>22} {'seconds':>9} {'compile s':>10} "
        f"{'peak MiB':>9} {'threads':>8}"
    )
    for record in measure_cases(quick, backend, part or (), all_rules):
        records.append(record._asdict())
        million_steps_per_second = record.agent_steps_per_second / MILLION
        peak_mib = "?" if record.peak_mib is None else f"{record.peak_mib:.0f}"
        console.info(
            f"{record.case:<22} {million_steps_per_second:>22.1f} {record.seconds:>9.2f} "
            f"{record.compile_seconds:>10.2f} {peak_mib:>9} {record.threads:>8}"
        )
    if out:
        content = dumps({"machine": describe_machine(), "records": records}, indent=2)
        write_atomically(out, f"{content}\n".encode())
        console.info(f"records: {out}")
