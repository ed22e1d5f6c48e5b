"""Sources of third-party parts, stored in a study for documentation and never executed.

    DIR/parts/model-bit-strings.py    source of a part when the study was created
    DIR/study.toml                    [[parts]]: kind, name and SHA-256 of each part

Reading the results of a study needs none of its parts. A simulation of the study needs them: the
user loads the same files again with --part.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from baldwinlab.core.errors import PartError
from baldwinlab.core.file_writing import write_exclusively
from baldwinlab.core.files import PART_FILE, quote_path, read_text, require_inside_study
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.added_parts import custom_choices
from baldwinlab.experiment.file import require_files

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
        require_inside_study(path, directory)
        try:
            write_exclusively(path, source.text.encode())
        except FileExistsError:
            if read_text(path, PART_FILE) != source.text:
                raise PartError(
                    f"{path} is there already and holds another part; choose another --out"
                ) from None


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
