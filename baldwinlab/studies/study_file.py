"""Text of `study.toml` with its checksum, and copies of data files and of sources of parts.

    DIR/study.toml                                [[parts]]: kind, name and SHA-256 of each part
    DIR/inputs/evo-A-generation-99-1a2b3c4d.nc    genomes of founders
    DIR/inputs/worth-5e6f7a8b.txt                 data file of a part
    DIR/parts/model-bit-strings.py                source of a part when the study was created

A study therefore needs no file outside of its directory. The name of a copy ends in the first
digits of the SHA-256 of the content, so two data files with one name do not collide. The
experiments of the study contain the path of a copy relative to the directory, so the directory can
be moved.

The stored sources are never executed. No part is needed to read the results of a study. For a
simulation, the user loads the same parts again with --part. The last line of `study.toml`, and of
each `experiment.toml`, is a checksum of the lines above.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from baldwinlab.core.errors import PartError
from baldwinlab.core.file_writing import write_exclusively
from baldwinlab.core.files import FileKind, is_local, quote_path, read_text, require_inside_study
from baldwinlab.core.names import CONDITION_NAME, read_stem
from baldwinlab.core.numbers import SEED_LIMIT
from baldwinlab.experiment import BaseExperiment, validate
from baldwinlab.experiment.added_parts import custom_choices
from baldwinlab.experiment.conditions import FACTOR_NAMES, STUDY_KINDS, SWEEP, Factors, StudyKind
from baldwinlab.experiment.file import File, iterate_file_tables, remember_path, require_files
from baldwinlab.studies.record_files import StudyError

# `parts.loading` is imported late: it loads slowly, and most studies have no third-party part.
if TYPE_CHECKING:
    from baldwinlab.parts.loading import Source

STUDY_FORMAT = 3
_CHECKSUM_PREFIX = "# SHA-256 of the lines above, as they were when the study was made: "

INPUT_FOLDER: Final = "inputs"
NAME_DIGITS: Final = 8


def require_format(content: Mapping[str, Any]) -> None:
    """Raise ValueError if `study.toml` has a format that this version does not read."""
    study_format = content.get("format")
    if study_format != STUDY_FORMAT:
        raise ValueError(
            f"it has format {study_format!r}, and this version reads only format {STUDY_FORMAT}; "
            "open it with the version that wrote it, or create the study again in another directory"
        )


def kind_and_factors(content: Mapping[str, Any]) -> tuple[StudyKind, dict[str, Factors]]:
    """Return the kind of a study and the factors by condition. Raise KeyError or ValueError."""
    kind = content["kind"]
    tables = content["factors"]
    if kind not in STUDY_KINDS:
        raise ValueError(f"kind = {kind!r} must be one of {', '.join(STUDY_KINDS)}")
    if not isinstance(tables, dict):
        raise ValueError(f"factors = {tables!r} must be a table")
    for name, table in tables.items():
        if not isinstance(table, dict) or {*map(type, table.values())} - {str}:
            raise ValueError(f"factors.{name} = {table!r} must be a table of texts")
        if unknown_factors := set(table) - {*FACTOR_NAMES}:
            allowed = ", ".join(FACTOR_NAMES)
            raise ValueError(
                f"factors.{name}: there is no factor {min(unknown_factors)!r}; there are {allowed}"
            )
    return kind, {name: Factors(**tables.get(name, {})) for name in content["conditions"]}


def add_checksum(text: str) -> str:
    """Append a line with the SHA-256 of the text."""
    return f"{text}{_CHECKSUM_PREFIX}{hashlib.sha256(text.encode()).hexdigest()}\n"


def require_checksum(text: str) -> None:
    """Raise ValueError if the last line of a text is not the checksum of the lines above."""
    text_above, _, digest = text.rpartition(_CHECKSUM_PREFIX)
    if hashlib.sha256(text_above.encode()).hexdigest() != digest.strip():
        raise ValueError(
            "it has been changed since the study was created, so it does not describe its runs; "
            "undo the change"
        )


def read_text_of_study(path: Path, kind: FileKind) -> str:
    """Read a text file of a study.

    Raises as `read_text` does, and ValueError for a link to another folder.
    """
    if is_local(path) and path.exists() and path.resolve().parent != path.parent.resolve():
        raise ValueError("it is a link to a file in another folder")
    return read_text(path, kind)


def require_valid_contents(seed: Any, names: Any) -> None:
    """Raise ValueError for an invalid seed, or for invalid names of conditions."""
    _require_number("seed", seed)
    if not isinstance(names, list) or not names:
        raise ValueError(f"conditions = {names!r} must be a list of at least one name")
    for name in names:
        if not isinstance(name, str) or not re.match(CONDITION_NAME, name):
            raise ValueError(f"conditions: {name!r} is no name of a condition")
    if len(set(names)) < len(names):
        raise ValueError("conditions: a name is listed twice; list each name once")


def read_changes(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the assignments that changed the model of the paper, or raise ValueError."""
    changes = content.get("changes", [])
    if not isinstance(changes, list) or not all(isinstance(change, str) for change in changes):
        raise ValueError(
            f'changes = {changes!r} must be a list of assignments, such as "lifetime.steps=100"'
        )
    return tuple(changes)


def read_first_run(content: Mapping[str, Any]) -> int:
    """Return the number of the first run, by default 0. Raises ValueError if it is invalid."""
    first_run: int = content.get("first_run", 0)
    _require_number("first_run", first_run)
    return first_run


def _require_number(name: str, value: Any) -> None:
    """Raise ValueError unless a value is valid as a seed and as the number of a run."""
    if type(value) is not int or not 0 <= value < SEED_LIMIT:
        raise ValueError(
            f"{name} = {value!r} must be a whole number, at least 0 and less than {SEED_LIMIT}"
        )


def describe_changes(changes: Sequence[str]) -> str:
    """Return a sentence about the changes of the model of a paper; "" without changes."""
    if not changes:
        return ""
    return f"Changed model: {', '.join(changes)}. No verdict here is about the model of the paper."


def format_study(
    names: Sequence[str],
    seed: int,
    kind: StudyKind,
    *,
    factors: Mapping[str, Factors],
    paper: str,
    changes: Sequence[str],
    sources: Sequence[Source],
    first_run: int = 0,
) -> str:
    """Return the text of `study.toml`."""
    # A TOML library takes a minute for thousands of conditions. JSON strings are valid TOML.
    lines = [
        f"format = {STUDY_FORMAT}",
        f'kind = "{kind}"',
        f"seed = {seed}",
        f"conditions = {json.dumps(names)}",
    ]
    if paper:
        lines.append(f"paper = {json.dumps(paper)}")
    if changes:
        lines.append(f"changes = {json.dumps(list(changes))}")
    if first_run:
        lines.append(f"first_run = {first_run}")
    lines += [*format_toml(sources), "", "[factors]"]
    # The points of a sweep have no factors.
    names_with_factors = () if kind == SWEEP else names
    for name in names_with_factors:
        condition_factors = factors.get(name, Factors())
        if not condition_factors.learner:
            condition_factors = condition_factors._replace(learner=name)
        lines.append(f'[factors."{name}"]')
        for key, value in zip(FACTOR_NAMES, condition_factors, strict=False):
            if value:
                lines.append(f"{key} = {json.dumps(value)}")
    return "".join(f"{line}\n" for line in lines)


def name_copies(experiments: Sequence[BaseExperiment]) -> list[Any]:
    """Replace the path of each data file in experiments by the path of the copy in a study."""
    renamed = []
    for experiment in experiments:
        tree = experiment.to_dict()
        tables = [table for _, table in iterate_file_tables(tree)]
        for table in tables:
            table["path"] = _name_copy(table)
        # `lenient`: the settings are valid already. Most experiments have no data file.
        renamed.append(validate(tree, lenient=True) if tables else experiment)
    return renamed


def _name_copy(table: dict[str, Any]) -> str:
    """Return the path of the copy of a data file in a study: inputs/worth-5e6f7a8b.txt."""
    path = PurePath(table["path"])
    ending = f"-{table['sha256'][:NAME_DIGITS]}"
    return f"{INPUT_FOLDER}/{read_stem(path).removesuffix(ending)}{ending}{path.suffix}"


def write_copies(directory: Path, experiments: Iterable[BaseExperiment]) -> None:
    """Write the data files of experiments, with the paths of `name_copies`, into a study."""
    for experiment in experiments:
        for _, table in iterate_file_tables(experiment.to_dict()):
            path = directory / table["path"]
            content = File(path=table["path"], sha256=table["sha256"]).read()
            if not _write_new(directory, path, content):
                raise StudyError(
                    f"{path} is there already and holds something else; choose another --out"
                )
            remember_path(table["sha256"], path)


def _write_new(directory: Path, path: Path, content: bytes) -> bool:
    """Write a file into a study. Return False if a file with other content exists already."""
    require_inside_study(path, directory)
    try:
        write_exclusively(path, content)
    except FileExistsError:
        return path.stat().st_size == len(content) and path.read_bytes() == content
    return True


class PartRecord(NamedTuple):
    """A third-party part of a study, as in `study.toml`."""

    kind: str
    name: str
    sha256: str


def read_part_records(content: Mapping[str, Any]) -> tuple[PartRecord, ...]:
    """Return the parts in the content of `study.toml`, or raise ValueError."""
    parts = content.get("parts", [])
    try:
        return tuple(
            PartRecord(str(part["kind"]), str(part["name"]), str(part["sha256"])) for part in parts
        )
    except (TypeError, KeyError):
        raise ValueError(
            f"parts = {parts!r} must be tables [[parts]], each with kind, name and sha256"
        ) from None


def collect_sources(experiments: Iterable[BaseExperiment]) -> tuple[Source, ...]:
    """Return the sources of third-party parts. Raises PartError if a part is not loaded."""
    custom_experiments = [
        experiment for experiment in experiments if any(custom_choices(experiment))
    ]
    if not custom_experiments:
        return ()
    from baldwinlab.parts.loading import sources_of

    return sources_of(custom_experiments)


def stored_source(directory: Path, kind: str, name: str) -> Path:
    """Return the path of the source of a part in a study."""
    return directory / "parts" / f"{kind.replace(' ', '-')}-{name}.py"


def save_sources(directory: Path, sources: Sequence[Source]) -> None:
    """Write the sources of parts into a study. Raises PartError if a file differs."""
    for source in sources:
        path = stored_source(directory, source.kind, source.name)
        if not _write_new(directory, path, source.text.encode()):
            raise PartError(f"{path} is there already and holds another part; choose another --out")


def format_toml(sources: Sequence[Source]) -> list[str]:
    """Return the lines about parts in `study.toml`."""
    lines: list[str] = []
    for source in sources:
        lines += [
            "[[parts]]",
            f'kind = "{source.kind}"',
            f'name = "{source.name}"',
            f'sha256 = "{source.sha256}"',
        ]
    return lines


def require_same_parts(
    directory: Path, stored: Sequence[PartRecord], experiments: Iterable[BaseExperiment]
) -> None:
    """Check that the parts and data files of experiments are available and unchanged."""
    experiments = list(experiments)
    parts = {choice for experiment in experiments for choice in custom_choices(experiment)}
    _require_parts(directory, stored, parts)
    for experiment in experiments:
        require_files(experiment, f" in {directory}")


def _require_parts(
    directory: Path, stored: Sequence[PartRecord], parts: set[tuple[str, str]]
) -> None:
    """Raise PartError if one of `parts` (kind, name) is not loaded or differs from `stored`."""
    if not parts:
        return
    from baldwinlab.parts.loading import source_of

    hashes = {(part.kind, part.name): part.sha256 for part in stored}
    for kind, name in sorted(parts):
        stored_hash = hashes.get((kind, name))
        part = f"the {kind} {name!r} of {directory}"
        copy = quote_path(stored_source(directory, kind, name))
        try:
            source = source_of(kind, name)
        except PartError:
            raise PartError(
                f"{part} is not loaded; load its file, which executes the code in it, for example "
                f"the copy in the study: --part {copy}"
            ) from None
        if stored_hash and source.sha256 != stored_hash:
            raise PartError(
                f"{part} differs from the loaded one; choose another --out, or load the original "
                "file, which executes the code in it, for example the copy in the study: "
                f"--part {copy}"
            )
