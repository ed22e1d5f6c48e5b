"""What is stored of the papers: studies in a folder, each with its claims and its systems."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from baldwinlab.analysis.gallery.analysis import System, systems
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.output_paths import is_study
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.factors import CONDITIONS
from baldwinlab.papers import DEFAULT, Paper, of_study
from baldwinlab.studies.assays import storage
from baldwinlab.studies.claims_file import claims_in
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.store import StudyStore


@dataclass(frozen=True)
class Entry:
    """A paper, and what came of it in a study."""

    paper: Paper
    changes: tuple[str, ...]  # of the paper's model
    directory: Path
    runs: int  # of the condition with the most
    claims: dict[str, str]  # verdicts by claim; empty where no report was written yet
    systems: tuple[System, ...]
    why_not: str  # why there is no system, in words; empty where there is one
    mend: tuple[str, ...]  # the commands that bring it in

    @property
    def name(self) -> str:
        """The name of the paper, marked where the study is of a changed model."""
        return f"{self.paper.name} (changed model)" if self.changes else self.paper.name

    def counted(self, verdict: str) -> int:
        return Counter(self.claims.values())[verdict]


def studies(folder: Path) -> dict[str, StudyStore]:
    """Those of papers that lie in a folder, by paper; of several of a paper that with the most runs.

    A study of a changed model is taken only where the folder holds no other study of that paper with a run.

    Raises RefusedError where there is none.
    """
    found: dict[str, StudyStore] = {}
    for directory in sorted(folder.iterdir()) if folder.is_dir() else ():
        if not (directory.is_dir() and is_study(directory)):
            continue
        study = StudyStore(directory)
        name = study.paper or (DEFAULT if directory.name == "paper" else "")
        is_first = name not in found or _rank(study) > _rank(found[name])
        if study.kind == CONDITIONS and name and most_runs(study) and is_first:
            found[name] = study
    if not found:
        raise RefusedError(
            f"{folder} holds no study of a paper with a finished run; `baldwinlab reproduce PAPER` makes one"
        )
    return found


def _rank(study: StudyStore) -> tuple[bool, int]:
    return not study.changes, most_runs(study)


def most_runs(study: StudyStore) -> int:
    """Of the condition with the most."""
    return max(len(study.runs(name)) for name in study.experiments)


def entries(folder: Path, last: int, tell: Callable[[str], None]) -> list[Entry]:
    """What came of each paper that is stored in a folder, in the order of their years. Raises RefusedError for an empty one."""
    found = []
    for name, study in studies(folder).items():
        tell(f"{study.directory}: {name}")
        found.append(_entry(study, of_study(study.directory, name), last))
    return sorted(found, key=lambda entry: (entry.paper.about.year, entry.paper.name))


def _entry(study: StudyStore, paper: Paper, last: int) -> Entry:
    measured = storage.read(study, ["innate"])
    there = [name for name in study.experiments if study.runs(name)]
    answered: tuple[System, ...] = ()
    if measured:
        wanted = [name for name in paper.about.compared if name in there]
        answered = tuple(
            systems(open_conditions(study, there), measured, study.experiments, wanted, last)
        )
    why_not, mend = ("", ()) if answered else _why_not(study, there, bool(measured))
    claims = {claim["id"]: claim["verdict"] for claim in claims_in(study)}
    return Entry(
        paper, study.changes, study.directory, most_runs(study), claims, answered, why_not, mend
    )


def _why_not(
    study: StudyStore, there: Sequence[str], measured: bool
) -> tuple[str, tuple[str, ...]]:
    """Why nothing can be asked of a study with runs of these conditions, in words, and the commands that change it."""
    try:
        learning = [study.experiments[name] for name in there if study.experiments[name].learns]
    except ExperimentError as error:  # a part is not loaded
        return str(error), ()
    if not learning:
        return "nobody learns there", ()
    if all(one.evolution.generations == 1 for one in learning):
        return "there are no generations to compare", ()
    if measured:
        return "the assay innate has measured nobody who learns and evolves", ()
    commands = (
        f"baldwinlab assay {study.directory} --assays innate",
        f"baldwinlab gallery {study.directory.parent}",
    )
    return "the assay innate is not stored", commands
