"""Reproduce the atlas: `bl.reproduce_atlas`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.api.atlas.article import write_article
from baldwinlab.api.atlas.publish import publish_atlas
from baldwinlab.api.atlas.run import AtlasRequest, run_atlas
from baldwinlab.api.run_options import RunOptions
from baldwinlab.core import console
from baldwinlab.core.numbers import check_numbers

if TYPE_CHECKING:
    import xarray as xr


def default_folder(*, quick: bool) -> Path:
    """Return the folder of the atlas if none is given.

    Returns the folder, relative to the working directory.
    """
    return Path("results") / ("atlas-quick" if quick else "atlas")


@check_numbers
def reproduce_atlas(
    *,
    quick: bool = False,
    runs: int | None = None,
    seed: int = 0,
    out: str | Path | None = None,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
    force: bool = False,
) -> dict[str, xr.Dataset]:
    """Simulate all maps of the atlas, and write its page, article, tables and netCDF files.

    A repeated call simulates only the missing cells.

    Parameters
    ----------
    quick
        Simulate fewer cells, with too few runs for verdicts.
    runs
        Number of runs of each cell, more than the exploratory runs; by default as in the design.
    seed
        Seed of all random numbers, 0 to 2**31 - 1.
    out
        Folder of the atlas. By default results/atlas, or results/atlas-quick with `quick`.
    workers
        Number of threads, at least 1; by default one per core. With the executor "slurm", the
        number of jobs.
    backend
        "cpu", "cuda", or "auto" for the fastest that is available.
    executor
        "threads", "dask:tcp://HOST:PORT", or "slurm".
    force
        Run even if less memory or disk is free than the estimate.

    Returns
    -------
    dict of xarray.Dataset
        Outcomes of the confirmatory runs, by the name of the map. The dimensions are the swept
        settings and "run".

    Raises
    ------
    ArgumentError
        A number is out of range.
    StudyError
        The folder holds another study.
    RefusedError
        The backend cannot be used on this machine.
    InterruptedStudyError
        A worker or a disk failed. The stored cells remain, and a repeated call continues.
    """
    request = AtlasRequest(Path(out or default_folder(quick=quick)), seed, runs, quick)
    run_atlas(request, RunOptions(workers, backend=backend, executor=executor, force=force))
    results = publish_atlas(request)
    console.info(str(write_article(results, request.directory)))
    return {result.name: result.outcomes for result in results.maps}
