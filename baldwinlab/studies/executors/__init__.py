"""Executors of the tasks of a study: threads of this process, Dask clusters and Slurm jobs."""

from __future__ import annotations

import re
import shutil

from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.files import require_cluster_extra
from baldwinlab.engine.threads import available_cores
from baldwinlab.studies.executors.tasks import THREADS, Executor, ExecutorError, Task

__all__ = ["THREADS", "Executor", "ExecutorError", "Task", "available_cores", "choose_executor"]

# Address of a Dask scheduler.
ADDRESS_PATTERN = re.compile(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d+")


def choose_executor(name: str, workers: int | None = None) -> Executor:
    """Return an executor by its name.

    `name`: "threads", "slurm", or "dask:" and the address of a scheduler:
    dask:tcp://127.0.0.1:8786. `workers`: number of threads or Slurm jobs. Threads default to the
    number of cores.
    """
    if name == "threads":
        return THREADS if workers is None else THREADS._replace(workers=workers)
    kind, _, address = name.partition(":")
    is_dask = kind == "dask" and ADDRESS_PATTERN.fullmatch(address) is not None
    if name != "slurm" and not is_dask:
        raise ArgumentError("executor", name, "must be threads, dask:tcp://HOST:PORT or slurm")
    require_cluster_extra(f"--executor {name}")
    # Loading Dask takes long, so it is imported only when it is used.
    from baldwinlab.studies.executors import dask

    if name == "slurm":
        if workers is None:
            raise RefusedError("--executor slurm needs --workers: the number of jobs to submit")
        if not shutil.which("sbatch"):
            raise RefusedError(
                "--executor slurm needs sbatch, which is not installed on this machine: "
                "run the command on a machine that submits jobs to Slurm"
            )
        return dask.make_slurm_executor(workers)
    if workers is not None:
        raise ArgumentError(
            "workers",
            workers,
            "is for threads and slurm: a Dask cluster has its own number of workers",
        )
    return dask.make_dask_executor(address)
