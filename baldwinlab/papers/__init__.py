"""The papers of baldwinlab, one folder each, custom papers in any folder, and checks of papers.

A paper is data without code: experiments, claims and texts. A study of a paper contains the name of
the paper in `study.toml`, and a copy of a custom paper in `DIR/paper`, so that the report can be
written again on any machine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from baldwinlab.core.file_writing import remove_file, write_atomically
from baldwinlab.core.files import PAPER_FILE, find_paths, read_bytes
from baldwinlab.core.names import suggest
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.paths import look_up
from baldwinlab.papers.claims import COMMON_MEASURES, FIRST_GENERATIONS, Claim, ClaimComparison
from baldwinlab.papers.design import DESIGN_FILE, Design, list_matched_names, read_design
from baldwinlab.papers.loading import PaperError
from baldwinlab.papers.paper import CARD_FILE, PRESET_KINDS, Paper, open_paper

__all__ = [
    "COPY_FOLDER",
    "DEFAULT_PAPER",
    "Paper",
    "PaperError",
    "built_in",
    "check_paper",
    "load",
    "load_stored_paper",
    "require_existing_names",
    "save_copy",
]

DEFAULT_PAPER = "le-2019"
# Folder of a study that contains a copy of the custom paper.
COPY_FOLDER = "paper"


@cache
def built_in() -> dict[str, Paper]:
    """Return the papers of baldwinlab by name, the default first."""
    folders = [path.parent for path in find_paths(Path(__file__).parent, "*/paper.toml")]
    papers = sorted(map(open_paper, folders), key=lambda paper: paper.name)
    # False is less than True, so the default comes first. The stable sort keeps the other names.
    papers.sort(key=lambda paper: paper.name != DEFAULT_PAPER)
    return {paper.name: paper for paper in papers}


def load(paper: str | Path = DEFAULT_PAPER) -> Paper:
    """Return the paper with a name, or the paper in a folder.

    Raises PaperError if there is no such paper, or if the folder is not a valid paper.
    """
    if str(paper) in built_in():
        return built_in()[str(paper)]
    folder = Path(paper)
    if not folder.is_dir():
        suggestion = suggest(str(paper), built_in())
        raise PaperError(
            f"there is no paper {str(paper)!r}{suggestion}, and any folder with a paper.toml"
        )
    custom = check_paper(open_paper(folder))
    if custom.name in built_in():
        raise PaperError(
            f"{folder / 'paper.toml'}: name {custom.name!r} is that of a paper of baldwinlab; "
            "choose another"
        )
    return custom


def save_copy(paper: Paper, directory: Path) -> None:
    """Copy a custom paper into a study, and remove an earlier copy there. Raises OSError."""
    if built_in().get(paper.name) == paper:
        return
    patterns = ("*.toml", "README.md", CARD_FILE, *(f"{kind}/*.toml" for kind in PRESET_KINDS))
    files = {
        path.relative_to(paper.folder): read_bytes(path, PAPER_FILE)
        for pattern in patterns
        for path in find_paths(paper.folder, pattern)
    }
    copy_folder = directory / COPY_FOLDER
    for path in find_paths(copy_folder, "**/*.toml"):
        remove_file(path)
    for name, content in files.items():
        write_atomically(copy_folder / name, content)


def load_stored_paper(directory: Path, name: str) -> Paper:
    """Return the paper of a study. `name` is the stored name, or "" for the default paper.

    Raises PaperError if the paper is neither in the study nor in baldwinlab.
    """
    copy_folder = directory / COPY_FOLDER
    if (copy_folder / "paper.toml").exists():
        return open_paper(copy_folder)
    paper_name = name or DEFAULT_PAPER
    if paper_name not in built_in():
        raise PaperError(
            f"{directory} is a study of the paper {name!r}, but {copy_folder} contains no copy of "
            "this paper"
        )
    return built_in()[paper_name]


def check_paper(paper: Paper) -> Paper:
    """Check all files of a paper and return it. Raises PaperError with the first error."""
    if not paper.names("conditions"):
        raise PaperError(
            f"{paper.folder / 'conditions'} contains no condition: a TOML file with changes of the "
            "default experiment"
        )
    _require_distinct_names(paper)
    metadata_path = paper.folder / "paper.toml"
    listed_names = {"conditions": paper.metadata.conditions, "maps": paper.metadata.maps}
    for kind, names_of_kind in listed_names.items():
        _require_names(names_of_kind, paper.names(kind), f"{metadata_path}: {kind}")
    names = paper.experiment_names()
    experiments = [paper.experiment(name) for name in names]
    for variant in paper.names("variants"):
        paper.experiment(names[0], variant)
    emergence = [paper.metadata.emergence] if paper.metadata.emergence else []
    _require_names(emergence, names, f"{metadata_path}: emergence")
    _require_names(paper.metadata.compared, names, f"{metadata_path}: compared")
    claims_path = paper.folder / "claims.toml"
    design = read_design(paper)
    matched_names = []
    if design:
        _check_design(paper, design)
        matched_names = list_matched_names(paper, design)
    require_existing_names(paper.claims, claims_path, names + matched_names, paper.measures)
    for claim in paper.claims:
        for choice in claim.choices:
            location = f"{claims_path}: {claim.id}, choice {choice.id}"
            _require_field(choice.field, experiments, location)
    # Reading this cached property checks the texts.
    paper.texts  # noqa: B018
    if paper.card:
        exercise = paper.card.exercise
        path = f"{paper.folder / 'card.toml'}: try"
        _require_names([exercise.preset], names, f"{path} names a preset")
        for field in exercise.changes:
            _require_field(field, [paper.experiment(exercise.preset)], path)
    return paper


def _check_design(paper: Paper, design: Design) -> None:
    """Raise PaperError if the design names a condition or a map that does not exist."""
    path = paper.folder / DESIGN_FILE
    conditions = [*paper.names("conditions"), *paper.names("controls")]
    named = [*design.noise_controls]
    for grid in design.tuning.grids:
        named += [*grid.conditions, *filter(None, [grid.target])]
    _require_names(named, conditions, f"{path} names a condition")
    for stage in (design.matched_controls, design.specification_curve, design.quick):
        _require_names(stage.maps, paper.names("maps") or [""], f"{path} names a map")


def _require_distinct_names(paper: Paper) -> None:
    """Raise PaperError if a name in claims or on the command line is ambiguous."""
    for name in sorted({*paper.names("conditions")} & {*paper.names("controls")}):
        raise PaperError(
            f"{paper.folder / 'controls' / name}.toml: {name!r} is also the name of a condition; "
            "choose another name for the control"
        )
    if FIRST_GENERATIONS in paper.experiment_names():
        raise PaperError(
            f"{paper.folder}: no condition can be named {FIRST_GENERATIONS!r}, because claims use "
            "this name for the first generations; rename its file"
        )


def require_existing_names(
    claims: Sequence[Claim],
    path: Path,
    conditions: list[str],
    measures: Callable[[str], Mapping[str, Any] | None],
) -> None:
    """Raise PaperError if a claim names a condition or a measure that does not exist.

    `conditions` are the existing names. `measures` returns the measures that the model of a
    condition adds to `COMMON_MEASURES`, or None if the model is not loaded.
    """
    for claim in claims:
        _require_names(
            sorted(claim.conditions), conditions, f"{path}: {claim.id} names a condition"
        )
        for comparison in claim.comparisons:
            for name in sorted(comparison.conditions):
                model_measures = measures(name)
                if model_measures is not None:
                    location = f"{path}: {claim.id}"
                    _require_measure(comparison, name, model_measures, location)


def _require_measure(
    comparison: ClaimComparison, condition: str, measures: Mapping[str, Any], location: str
) -> None:
    """Raise PaperError if the measure of a comparison does not exist or does not fit its rule."""
    measure = comparison.measure
    _require_names(
        [measure], [*COMMON_MEASURES, *measures], f"{location}: a measure of {condition}"
    )
    if comparison.rule == "survives_longer" and not measures[measure].censored:
        raise PaperError(
            f"{location}: the rule 'survives_longer' needs a measure with censored runs, "
            f"and {measure!r} of {condition} has none"
        )


def _require_names(names: Iterable[str], existing: list[str], location: str) -> None:
    for name in names:
        if name not in existing:
            raise PaperError(f"{location} {name!r}, which does not exist{suggest(name, existing)}")


def _require_field(path: str, experiments: Sequence[Experiment], location: str) -> None:
    """Raise PaperError if none of the experiments has a field.

    The field of a part exists only in experiments that choose the part.
    """
    faults = []
    for experiment in experiments:
        try:
            look_up(experiment, path)
        except ExperimentError as error:
            faults.append(error)
    if len(faults) == len(experiments):
        raise PaperError(f"{location}: {faults[0]}")
