"""Text of `study.toml`, and the checksum line at the end of it and of each `experiment.toml`."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from baldwinlab.core.files import FileKind, is_local, read_text
from baldwinlab.core.names import CONDITION_NAME
from baldwinlab.core.numbers import SEED_LIMIT
from baldwinlab.experiment.conditions import STUDY_KINDS, SWEEP, Factors, StudyKind
from baldwinlab.studies.input_files import format_toml

if TYPE_CHECKING:
    from baldwinlab.parts.loading import Source

STUDY_FORMAT = 3
_CHECKSUM_PREFIX = "# SHA-256 of the lines above, as they were when the study was made: "


def require_format(content: Mapping[str, Any]) -> None:
    """Raise ValueError if `study.toml` has another format than that of this version."""
    study_format = content.get("format")
    if study_format != STUDY_FORMAT:
        raise ValueError(
            f"it has format {study_format!r}, and this version reads only format {STUDY_FORMAT}; "
            "open it with the version that wrote it, or create the study again in another directory"
        )


def kind_and_factors(content: Mapping[str, Any]) -> tuple[StudyKind, dict[str, Factors]]:
    """Return the kind and the factors in `study.toml`. Raise KeyError or ValueError."""
    kind = content["kind"]
    tables = content["factors"]
    if kind not in STUDY_KINDS:
        raise ValueError(f"kind = {kind!r} must be one of {', '.join(STUDY_KINDS)}")
    for name in tables:
        if unknown_factors := set(tables[name]) - set(Factors._fields):
            allowed = ", ".join(Factors._fields)
            raise ValueError(
                f"factors.{name}: there is no factor {min(unknown_factors)!r}; there are {allowed}"
            )
    return kind, {name: Factors(**tables.get(name, {})) for name in content["conditions"]}


def add_checksum(text: str) -> str:
    """Append a line with the SHA-256 of the text."""
    return f"{text}{_CHECKSUM_PREFIX}{hashlib.sha256(text.encode()).hexdigest()}\n"


def require_checksum(text: str) -> None:
    """Raise ValueError if a text differs from its checksum, or has none."""
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
    if type(seed) is not int or not 0 <= seed < SEED_LIMIT:
        raise ValueError(
            f"seed = {seed!r} must be a whole number, at least 0 and less than {SEED_LIMIT}"
        )
    if not isinstance(names, list):
        raise ValueError(f"conditions = {names!r} must be a list of names")
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
    """Return the number of the first run. Raises ValueError if it is not a number of a run."""
    first_run = content.get("first_run", 0)
    if type(first_run) is not int or not 0 <= first_run < SEED_LIMIT:
        raise ValueError(
            f"first_run = {first_run!r} must be a whole number, at least 0 and less than "
            f"{SEED_LIMIT}"
        )
    return first_run


def describe_changes(changes: Sequence[str]) -> str:
    """Return the sentence about a changed model; "" if nothing is changed."""
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
    # A TOML library takes a minute for thousands of conditions. A JSON string is valid TOML.
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
        for key, value in condition_factors._asdict().items():
            if value:
                lines.append(f"{key} = {json.dumps(value)}")
    return "".join(f"{line}\n" for line in lines)
