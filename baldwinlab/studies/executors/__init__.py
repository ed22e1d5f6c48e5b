"""Where the tasks of a study are done: on threads of this process, or by workers of a Dask cluster, also one that Slurm runs."""

from __future__ import annotations

import re
import shutil
from functools import partial

from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.files import require_cluster_extra
from baldwinlab.simulation.compilation import available_cores
from baldwinlab.studies.executors.tasks import Executor, ExecutorError, Task
from baldwinlab.studies.executors.threads import THREADS

__all__ = ["THREADS", "Executor", "ExecutorError", "Task", "available_cores", "choose"]

ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d+")


def choose(name: str, workers: int | None = None) -> Executor:
    """The executor of that name, with so many workers; unless that is given, with as many as there are.

    `name` is "threads"; "dask:" and the address of a scheduler, such as dask:tcp://127.0.0.1:8786; or "slurm", where workers
    are jobs. Raises RefusedError for any other name and where the executor cannot be used.
    """
    if name == "threads":
        return THREADS if workers is None else THREADS._replace(workers=workers)
    kind, _, address = name.partition(":")
    if name != "slurm" and (kind != "dask" or not ADDRESS.fullmatch(address)):
        raise ArgumentError("executor", name, "must be threads, dask:tcp://HOST:PORT or slurm")
    require_cluster_extra(f"--executor {name}")
    from baldwinlab.studies.executors import dask  # here, because to load it takes a while

    if name == "slurm":
        if workers is None:
            raise RefusedError("--executor slurm needs --workers: how many jobs to submit")
        if not shutil.which("sbatch"):
            raise RefusedError(
                "--executor slurm needs sbatch, which is not here: run this on a machine that submits to Slurm"
            )
        return Executor(
            "slurm", workers * dask.count_job_cores(), partial(dask.connect_slurm, workers)
        )
    if workers is not None:
        raise ArgumentError(
            "workers", workers, "is for threads and slurm: a Dask cluster has the workers it has"
        )
    return Executor("dask", max(1, dask.count_cores(address)), partial(dask.connect_dask, address))
