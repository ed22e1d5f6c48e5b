"""Copies in a study of its data files and of the sources of its third-party parts.

    DIR/inputs/evo-A-generation-99-1a2b3c4d.nc    genomes of founders
    DIR/inputs/worth-5e6f7a8b.txt                 data file of a part
    DIR/parts/model-bit-strings.py                source of a part when the study was created
    DIR/study.toml                                [[parts]]: kind, name and SHA-256 of each part

A study therefore needs no file outside of its directory. The name of a data file ends in the first
digits of its SHA-256, so two files with one name do not collide. The experiments of the study name
a copy by its path in the directory, and it is found by its content wherever the directory is.

Sources are never executed. Reading the results of a study needs none of its parts. A simulation
needs them: the user loads the same files again with --part.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from baldwinlab.core.errors import PartError
from baldwinlab.core.file_writing import write_exclusively
from baldwinlab.core.files import quote_path, require_inside_study
from baldwinlab.experiment import BaseExperiment, validate
from baldwinlab.experiment.added_parts import custom_choices
from baldwinlab.experiment.file import File, iterate_file_tables, remember_path, require_files
from baldwinlab.studies.record_files import StudyError

INPUT_FOLDER: Final = "inputs"
NAME_DIGITS: Final = 8


def name_copies(experiments: Sequence[BaseExperiment]) -> list[Any]:
    """Return experiments whose data files have the paths of their copies in a study."""
    renamed = []
    for experiment in experiments:
        tree = experiment.to_dict()
        tables = [table for _, table in iterate_file_tables(tree)]
        for table in tables:
            table["path"] = _name_copy(table)
        # The settings are valid already, and few experiments have data files.
        renamed.append(validate(tree, lenient=True) if tables else experiment)
    return renamed


def _name_copy(table: dict[str, Any]) -> str:
    """Return the path of the copy of a data file, relative to the directory of the study."""
    path = PurePath(table["path"])
    ending = f"-{table['sha256'][:NAME_DIGITS]}"
    return f"{INPUT_FOLDER}/{path.stem.removesuffix(ending)}{ending}{path.suffix}"


def write_copies(directory: Path, experiments: Iterable[BaseExperiment]) -> None:
    """Write the data files of experiments, which `name_copies` has named, into a study."""
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
    """Write a file into a study. Return False, without a change, if it has another content."""
    require_inside_study(path, directory)
    try:
        write_exclusively(path, content)
    except FileExistsError:
        return path.stat().st_size == len(content) and path.read_bytes() == content
    return True


# Loading takes long, and a study without third-party parts does not need it.
if TYPE_CHECKING:
    from baldwinlab.parts.loading import Source


class PartRecord(NamedTuple):
    """A third-party part of a study, as in `study.toml`."""

    kind: str
    name: str
    sha256: str


def read_part_records(content: Mapping[str, Any]) -> tuple[PartRecord, ...]:
    """Return the parts in the content of `study.toml`. Raises KeyError for a missing key."""
    return tuple(
        PartRecord(str(part["kind"]), str(part["name"]), str(part["sha256"]))
        for part in content.get("parts", [])
    )


def collect_sources(experiments: Iterable[BaseExperiment]) -> tuple[Source, ...]:
    """Return the third-party parts of experiments. Raises PartError if one is not loaded."""
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
                f"{part} is not loaded; load its file, for example the copy in the study: "
                f"--part {copy}"
            ) from None
        if stored_hash and source.sha256 != stored_hash:
            raise PartError(
                f"{part} differs from the loaded one; choose another --out, or load the original "
                f"file, for example the copy in the study: --part {copy}"
            )
