"""Foreign parts of a study: their sources are kept with it, and nothing that is found there is ever executed.

    DIR/parts/model-bit-strings.py    the source of a part as it was when the study was made, for people to read
    DIR/study.toml                    [[parts]]: kind, name and SHA-256 of each

Who only reads a study needs none of its parts. Who lives lives of it gives them again, and they must be the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from baldwinlab.core.errors import PartError
from baldwinlab.core.files import require_inside_study, write_exclusively
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.base import custom_choices
from baldwinlab.experiment.file import require_files

if TYPE_CHECKING:  # to load it takes a while, and where there is no foreign part nobody needs it
    from baldwinlab.parts.loading import Source

DIGITS = 12  # of a hash, in sentences


class PartRecord(NamedTuple):
    """A foreign part that a study was made with."""

    kind: str
    name: str
    sha256: str


def read_part_records(facts: Mapping[str, Any]) -> tuple[PartRecord, ...]:
    """Those that `study.toml` names. Raises KeyError where it is not what is written."""
    return tuple(
        PartRecord(str(part["kind"]), str(part["name"]), str(part["sha256"]))
        for part in facts.get("parts", [])
    )


def collect_sources(experiments: Iterable[BaseExperiment]) -> tuple[Source, ...]:
    """The foreign parts that experiments choose. Raises PartError for one that is not here."""
    if not (
        choosing := [experiment for experiment in experiments if any(custom_choices(experiment))]
    ):
        return ()
    from baldwinlab.parts.loading import sources_of

    return sources_of(choosing)


def save_sources(directory: Path, sources: Sequence[Source]) -> None:
    """Write the sources of parts into the folder of their study. Raises PartError where another source lies there."""
    for source in sources:
        path = directory / "parts" / f"{source.kind.replace(' ', '-')}-{source.name}.py"
        require_inside_study(path, directory)
        try:
            write_exclusively(path, source.text.encode())
        except FileExistsError:
            if path.read_bytes() != source.text.encode():
                raise PartError(
                    f"{path} is there already and holds another part; choose another --out"
                ) from None


def format_toml(sources: Sequence[Source]) -> list[str]:
    """What `study.toml` says of parts."""
    said = [
        ("[[parts]]", f'kind = "{one.kind}"', f'name = "{one.name}"', f'sha256 = "{one.sha256}"')
        for one in sources
    ]
    return [line for part in said for line in part]


def require_same_parts(
    where: Path, stored: Sequence[PartRecord], experiments: Iterable[BaseExperiment]
) -> None:
    """Raise PartError where a part or a data file of experiments of a study is not here, or is another."""
    known = list(experiments)
    _require_parts(
        where, stored, {choice for experiment in known for choice in custom_choices(experiment)}
    )
    for experiment in known:
        require_files(experiment, f" in {where}")


def _require_parts(where: Path, stored: Sequence[PartRecord], chosen: set[tuple[str, str]]) -> None:
    if not chosen:
        return
    from baldwinlab.parts.loading import source_of

    hashes = {(part.kind, part.name): part.sha256 for part in stored}
    for kind, name in sorted(chosen):
        there = hashes.get((kind, name))
        kept = f" of {where} (SHA-256 {there[:DIGITS]}...)" if there else f" of {where}"
        try:
            here = source_of(kind, name).sha256
        except PartError:
            raise PartError(
                f"the {kind} {name!r}{kept} is not here; give its file by --part FILE"
            ) from None
        if there and here != there:
            raise PartError(
                f"the {kind} {name!r}{kept} is another than the one given here ({here[:DIGITS]}...): "
                "give the file that the study was made with, or make another study by another --out"
            )
