"""Entries of the gallery: papers, with the claims and systems of their stored studies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from baldwinlab.analysis.gallery.analysis import System, evaluate_systems
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import is_local, is_study, list_names, quote_path
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.conditions import CONDITIONS
from baldwinlab.papers import DEFAULT_PAPER, Paper, load_stored_paper
from baldwinlab.papers.claims import KINDS
from baldwinlab.papers.design import CONFIRMATION_FOLDER
from baldwinlab.studies.assays.results import read_assays
from baldwinlab.studies.assays.unseen_maps import UNSEEN_MAPS
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.status import read_claims
from baldwinlab.studies.store import StudyStore


@dataclass(frozen=True)
class Entry:
    """A paper with the results of its study."""

    paper: Paper
    # Changes of the paper's model.
    changes: tuple[str, ...]
    directory: Path
    # Number of runs of the condition with the most runs.
    runs: int
    # Verdict by identifier of the claim. Empty if the study has no report.
    claims: dict[str, str]
    systems: tuple[System, ...]
    # The reason why there is no system. "" if there is a system.
    reason: str
    # Commands that add the missing results.
    commands: tuple[str, ...]

    @property
    def name(self) -> str:
        """The name of the paper, with a remark if the study changes its model."""
        return f"{self.paper.name} (changed model)" if self.changes else self.paper.name

    @property
    def claims_by_kind(self) -> dict[str, dict[str, str]]:
        """The verdicts by identifier of the claim, for each kind, such as "claims of the paper"."""
        verdicts = {
            plural: {
                claim.id: self.claims[claim.id]
                for claim in self.paper.claims
                if claim.kind == kind and claim.id in self.claims
            }
            for kind, (_, plural) in KINDS.items()
        }
        return {kind: claims for kind, claims in verdicts.items() if claims}


def holds_studies(folder: Path) -> bool:
    """Return whether a local folder is no study, but has studies in its subfolders."""
    return is_local(folder) and not is_study(folder) and bool(_list_studies(folder))


def _list_studies(folder: Path) -> list[Path]:
    """Return the directories of the studies in a folder."""
    names = sorted(list_names(folder)) if folder.is_dir() else []
    # The study of a paper with stages is in a subfolder.
    directories = [folder / name / part for name in names for part in ("", CONFIRMATION_FOLDER)]
    return [directory for directory in directories if directory.is_dir() and is_study(directory)]


def find_studies(folder: Path) -> dict[str, StudyStore]:
    """Find one study per paper in a folder: preferably unchanged, and then with the most runs."""
    studies: dict[str, StudyStore] = {}
    for directory in _list_studies(folder):
        study = StudyStore(directory)
        # Without the name of a paper, a study in the folder "paper" belongs to the default paper.
        name = study.paper or (DEFAULT_PAPER if directory.name == "paper" else "")
        has_runs = count_most_runs(study) > 0
        if study.kind != CONDITIONS or not name or not has_runs:
            continue
        if name not in studies or _rank_study(study) > _rank_study(studies[name]):
            studies[name] = study
    if not studies:
        raise RefusedError(
            f"{folder} has no study of a paper with a finished run. "
            "Run `baldwinlab reproduce PAPER` first."
        )
    return studies


def _rank_study(study: StudyStore) -> tuple[bool, int]:
    """Return a sort key that is largest for the preferred study of a paper."""
    return not study.changes, count_most_runs(study)


def count_most_runs(study: StudyStore) -> int:
    """Return the number of runs of the condition with the most runs."""
    return max(len(study.runs(name)) for name in study.experiments)


def read_entries(folder: Path, last: int) -> list[Entry]:
    """Read the results of all papers in a folder, sorted by year."""
    entries = []
    for name, study in find_studies(folder).items():
        console.info(f"{study.location}: {name}")
        entries.append(_read_entry(study, load_stored_paper(study.directory, name), last))
    return sorted(entries, key=lambda entry: (entry.paper.metadata.year, entry.paper.name))


def _read_entry(study: StudyStore, paper: Paper, last: int) -> Entry:
    assays = read_assays(study)
    # This assay does not measure the Baldwin effect.
    assays.pop(UNSEEN_MAPS, None)
    conditions_with_runs = [name for name in study.experiments if study.runs(name)]
    systems: list[System] = []
    if assays:
        selected = [name for name in paper.metadata.compared if name in conditions_with_runs]
        data = open_sample(study, conditions_with_runs)
        systems = evaluate_systems(data, assays, study.experiments, selected, last)
    reason = ""
    commands: tuple[str, ...] = ()
    if not systems:
        reason, commands = _explain_omission(
            study, conditions_with_runs, bool(assays.get("innate"))
        )
    claims = {claim["id"]: claim["verdict"] for claim in read_claims(study)}
    return Entry(
        paper=paper,
        changes=study.changes,
        directory=study.directory,
        runs=count_most_runs(study),
        claims=claims,
        systems=tuple(systems),
        reason=reason,
        commands=commands,
    )


def _explain_omission(
    study: StudyStore, conditions_with_runs: Sequence[str], has_innate: bool
) -> tuple[str, tuple[str, ...]]:
    """Return the reason why a study has no system, and the commands that add a system."""
    # `learns` raises ExperimentError if a custom part is not loaded.
    try:
        learning = [
            study.experiments[name]
            for name in conditions_with_runs
            if study.experiments[name].learns
        ]
    except ExperimentError as error:
        return str(error), ()
    if not learning:
        return "its conditions do not learn", ()
    if all(experiment.evolution.generations == 1 for experiment in learning):
        return "its runs have a single generation", ()
    if has_innate:
        return "the assay innate has no condition that learns and evolves", ()
    commands = (
        f"baldwinlab assay {quote_path(study.directory)} --assays innate",
        f"baldwinlab report {quote_path(study.directory.parent)}",
    )
    return "the assay innate is not stored", commands
