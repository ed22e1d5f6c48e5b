"""Stored verdicts on the claims of a study, with a digest of the runs that decided them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import RESULTS_FILE, parse_json, quote_path, read_text
from baldwinlab.core.netcdf import CHECKSUM_BYTES, stored_checksum
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

CLAIMS_FILE: Final = "claims.json"


def write_claims(study: StudyStore, claims: Sequence[Mapping[str, Any]]) -> None:
    """Write the claims of a study, with a checksum and a digest of its runs. Raises OSError."""
    content = {"records": digest_records(study), "claims": list(claims)}
    content_with_checksum = {"checksum": _checksum(content), **content}
    text = json.dumps(content_with_checksum, indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(study.directory / CLAIMS_FILE, f"{text}\n".encode())


def read_claims(study: StudyStore) -> list[dict[str, Any]]:
    """Read the claims of a study, each with `id` and `verdict`; none if no report exists yet."""
    path = study.directory / CLAIMS_FILE
    remedy = f"`baldwinlab report {quote_path(study.directory)}` makes it again"
    if not path.exists():
        return []
    try:
        content = parse_json(read_text(path, RESULTS_FILE))
    except (OSError, ValueError) as error:
        raise StudyError(f"{path} cannot be read: {error}; {remedy}") from None
    if not _verify_content(content):
        raise StudyError(f"{path} was not written by a report; {remedy}")
    if content["records"] != digest_records(study):
        raise StudyError(
            f"{path} was decided by other runs than those that are stored now; {remedy}"
        )
    claims: list[dict[str, Any]] = content["claims"]
    return claims


def digest_records(study: StudyStore) -> str:
    """Return a hash of the files of records: the condition, runs, size and checksum of each."""
    digest = hashlib.sha256(f"{study.seed}\n".encode())
    for condition in study.experiments:
        for file in study.files(condition):
            with file.path.open("rb") as stream:
                checksum = stored_checksum(stream.read(CHECKSUM_BYTES))
            runs = f"{file.first}-{file.last}" if file.is_batch else str(file.first)
            size = file.path.stat().st_size
            digest.update(f"{condition} {runs} {size} {checksum}\n".encode())
    return digest.hexdigest()


def _verify_content(content: Any) -> bool:
    """Remove the checksum of the content, and return whether form and checksum are valid."""
    if not isinstance(content, dict) or not isinstance(content.get("claims"), list):
        return False
    checksum = content.pop("checksum", None)
    return checksum == _checksum(content) and all(map(_is_claim, content["claims"]))


def _is_claim(claim: Any) -> bool:
    return isinstance(claim, dict) and all(
        isinstance(claim.get(name), str) for name in ("id", "verdict")
    )


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()
