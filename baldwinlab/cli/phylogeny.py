"""Who begot whom."""

from __future__ import annotations

from pathlib import Path

from baldwinlab import console
from baldwinlab.assays.descent import HEADER
from baldwinlab.assays.descent import phylogeny as pedigree
from baldwinlab.cli.common import Directory, Force, Whole
from baldwinlab.files import write_atomically
from baldwinlab.outputs import require_writable
from baldwinlab.studies.store import Study


def phylogeny(directory: Directory, /, *, condition: str, run: Whole, out: Path, force: Force = False) -> None:
    """Write who begot whom in a run as CSV in the ALife data standard for phylogenies."""
    require_writable("--out", out, HEADER.encode(), force=force)
    study = Study(directory)
    study.experiment(condition)
    record = study.read(condition, run, genomes=False)
    write_atomically(out, pedigree(record).encode())
    console.say(f"{out}: {record.parents.sizes['generation'] * record.parents.sizes['agent']} agents")
