"""The claims of a study as its report has decided them: written, and read back while they fit the stored runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

from baldwinlab.core.files import RESULTS_FILE, parse_json, read_text, write_atomically
from baldwinlab.core.netcdf import stored_checksum
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

CLAIMS: Final = "claims.json"
CHECKSUM_BYTES: Final = 65536  # bytes of a record among which its checksum stands


def write_claims(study: StudyStore, claims: Sequence[Mapping[str, Any]]) -> None:
    """Write the claims of a study, with a checksum and a digest of the runs that decided them. Raises OSError."""
    found = {"records": digest_records(study), "claims": list(claims)}
    text = json.dumps(
        {"checksum": _checksum(found), **found}, indent=2, ensure_ascii=False, allow_nan=False
    )
    write_atomically(study.directory / CLAIMS, f"{text}\n".encode())


def read_claims(study: StudyStore) -> list[dict[str, Any]]:
    """Read the claims of a study, each with `id` and `verdict` as text.

    Returns
    -------
    list of dict
        What `write_claims` was given; empty where no report has been made yet.

    Raises
    ------
    StudyError
        If the file is damaged, was changed, was written by an older version, or was decided by
        other runs than those that are stored now.
    """
    path = study.directory / CLAIMS
    again = f"`baldwinlab report {study.directory}` makes it again"
    if not path.exists():
        return []
    try:
        found = parse_json(read_text(path, RESULTS_FILE))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path} cannot be read: {error}; {again}") from None
    if isinstance(found, list):
        raise StudyError(
            f"{path} was written by an older version, and does not say of which runs it is; {again}"
        )
    if not _is_sound(found):
        raise StudyError(f"{path} is not what a report has written; {again}")
    if found["records"] != digest_records(study):
        raise StudyError(
            f"{path} was decided by other runs than those that are stored now; {again}"
        )
    claims: list[dict[str, Any]] = found["claims"]
    return claims


def digest_records(study: StudyStore) -> str:
    """Return a hash of the stored records: the condition, run, size and checksum of each."""
    digest = hashlib.sha256(f"{study.seed}\n".encode())
    for name in study.experiments:
        for run in study.runs(name):
            path = study.path(name, run)
            with path.open("rb") as file:
                checksum = stored_checksum(file.read(CHECKSUM_BYTES))
            digest.update(f"{name} {run} {path.stat().st_size} {checksum}\n".encode())
    return digest.hexdigest()


def _is_sound(found: Any) -> bool:
    """Whether it is what was written, with claims that can be shown."""
    if not isinstance(found, dict) or not isinstance(found.get("claims"), list):
        return False
    return found.pop("checksum", None) == _checksum(found) and all(map(_is_claim, found["claims"]))


def _is_claim(one: Any) -> bool:
    return isinstance(one, dict) and all(
        isinstance(one.get(name), str) for name in ("id", "verdict")
    )


def _checksum(found: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(found).encode()).hexdigest()
