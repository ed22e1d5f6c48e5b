"""Write and read the file of a multiverse, `multiverse.json`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from baldwinlab.analysis.multiverse.analysis import (
    compute_shares,
    find_decisive_choices,
    find_nearest,
    select_claims,
    variants_with_most_claims,
    variants_with_paper_effects,
)
from baldwinlab.analysis.multiverse.records import Multiverse
from baldwinlab.analysis.results.verdicts import FAILS, HOLDS, UNDECIDED
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import RESULTS_FILE, read_bytes


def summarize(multiverse: Multiverse) -> dict[str, Any]:
    """Return the results that the report describes in sentences, for JSON."""
    nearest = find_nearest(multiverse)
    shares = compute_shares(multiverse) if multiverse.has_combinations else None
    return {
        "hold_under_every_variant": select_claims(multiverse, HOLDS),
        "refuted_under_no_variant": select_claims(multiverse, HOLDS, UNDECIDED),
        "hold_under_no_variant": select_claims(multiverse, UNDECIDED, FAILS),
        "depends_on": {
            claim.id: find_decisive_choices(multiverse, claim.id) for claim in multiverse.claims
        },
        "nearest": nearest
        and {"variant": nearest.name, "distance": nearest.distance, "held": nearest.held},
        "intervals_contain_the_figures": [
            variant.name for variant in variants_with_paper_effects(multiverse)
        ],
        "most_held": [variant.name for variant in variants_with_most_claims(multiverse)],
        "shares": None if shares is None else [share._asdict() for share in shares],
    }


def write_multiverse(multiverse: Multiverse, path: Path) -> Path:
    """Write a multiverse as JSON, atomically, with null for undefined numbers."""
    record = {
        "checksum": _checksum(multiverse),
        "summary": summarize(multiverse),
        **multiverse.model_dump(mode="json"),
    }
    text = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False)
    return write_atomically(path, f"{text}\n".encode())


def read_multiverse(path: Path) -> Multiverse:
    """Read a file of `write_multiverse`."""
    raw = _read_bytes(path)
    try:
        record = json.loads(raw)
        multiverse = Multiverse.model_validate(record)
    except ValidationError as error:
        key = ".".join(str(part) for part in error.errors()[0]["loc"]) or "it is not an object"
        raise ValueError(f"{path} is not a file of `baldwinlab multiverse`: {key}") from None
    except (ValueError, RecursionError):
        raise ValueError(f"{path} is not a file of `baldwinlab multiverse`: not JSON") from None
    if not _is_unchanged(multiverse, record):
        raise ValueError(
            f"{path} was changed after `baldwinlab multiverse` wrote it. Run that command again."
        )
    return multiverse


def _is_unchanged(multiverse: Multiverse, record: Mapping[str, Any]) -> bool:
    """Return whether a file has the content that was written."""
    has_checksum = record.get("checksum") == _checksum(multiverse)
    return bool(has_checksum and record.get("summary") == summarize(multiverse))


def _read_bytes(path: Path) -> bytes:
    try:
        return read_bytes(path, RESULTS_FILE)
    except ValueError as error:
        raise ValueError(f"{path} cannot be read: {error}") from None


def _checksum(multiverse: Multiverse) -> str:
    """Return the SHA-256 of a multiverse. The file's summary is not part of it."""
    return hashlib.sha256(multiverse.model_dump_json().encode()).hexdigest()
