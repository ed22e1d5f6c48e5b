"""The parts that a stored study needs and this lab has not loaded, and the command that loads them.

The results of such a study can be read. Its lifetimes cannot be simulated.
"""

from __future__ import annotations

import shlex
from hashlib import sha256
from typing import Final

from baldwinlab.core.errors import BaldwinLabError, PartError
from baldwinlab.lab import Lab
from baldwinlab.lab.study_access import require_inside
from baldwinlab.studies.input_files import PartRecord, stored_source
from baldwinlab.studies.store import StudyStore

# Placeholder of a file whose path only the user knows.
UNKNOWN_FILE: Final = "FILE"


def describe_missing_parts(lab: Lab, study: StudyStore) -> str:
    """Return why lifetimes of a study cannot be simulated, and the remedy; "" if they can."""
    try:
        study.require_parts()
    except BaldwinLabError as error:
        missing = [part for part in study.parts if not _is_loaded(part)]
        return _format_remedy(lab, study, missing) if missing else str(error)
    return ""


def _format_remedy(lab: Lab, study: StudyStore, missing: list[PartRecord]) -> str:
    # A file can define several parts. The study has a copy of the file for each of them.
    files = {part.sha256: _find_source(lab, study, part) for part in missing}
    options = [word for file in files.values() for word in ("--part", file)]
    names = " and ".join(f"the {part.kind} {part.name}" for part in missing)
    verb = "is" if len(missing) == 1 else "are"
    hint = f" ({UNKNOWN_FILE} is the file with {names})" if UNKNOWN_FILE in options else ""
    return (
        f"{names[0].upper()}{names[1:]} of this study {verb} not loaded. To watch its lifetimes,"
        f" close the lab and start it with this command{hint}:"
        f" {shlex.join([*lab.command, *options])}"
    )


def _is_loaded(part: PartRecord) -> bool:
    """Return whether a part of a study is loaded, with the same source."""
    # This import takes time, and a study without custom parts does not need it.
    from baldwinlab.parts.loading import source_of

    try:
        return source_of(part.kind, part.name).sha256 == part.sha256
    except PartError:
        return False


def _find_source(lab: Lab, study: StudyStore, part: PartRecord) -> str:
    """Return the path of the copy of a part's file in its study, or FILE without a copy."""
    path = stored_source(study.directory, part.kind, part.name)
    try:
        require_inside(lab.root, path)
        is_copy = sha256(path.read_bytes()).hexdigest() == part.sha256
    except (BaldwinLabError, OSError):
        is_copy = False
    return str(path) if is_copy else UNKNOWN_FILE
