"""Cache of the results that the lab shows, in `results.json` next to the report.

Reading a large study takes seconds. The cache is valid only for the version of baldwinlab and the
format that wrote it, and only for the same stored records.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any, Final

from baldwinlab._version import __version__
from baldwinlab.api.publish.lab_results import compute_results
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import RESULTS_FILE, read_text
from baldwinlab.studies.status import digest_records
from baldwinlab.studies.store import StudyStore

CACHE_FILE: Final = "results.json"
FORMAT: Final = 3
"""Number of the format of the results. It changes with their keys."""
MAX_CONDITIONS: Final = 1000
"""Larger studies have no cache, because the file would be slow to load."""


def cache_results(study: StudyStore, data: xr.Dataset | None = None) -> None:
    """Write the results of a study to its cache, unless it has too many conditions.

    `data`: the runs as `open_runs` returns them, if they are already loaded.
    """
    if len(study.experiments) > MAX_CONDITIONS:
        return
    record = {
        "version": __version__,
        "format": FORMAT,
        "records": digest_records(study),
        "results": compute_results(study, data),
    }
    text = json.dumps({"checksum": _checksum(record), **record})
    write_atomically(study.directory / CACHE_FILE, text.encode())


def load_cached_results(study: StudyStore) -> dict[str, Any] | None:
    """Return the cached results, or None if the cache is missing, damaged or out of date."""
    try:
        record = json.loads(read_text(study.directory / CACHE_FILE, RESULTS_FILE))
        checksum = record.pop("checksum")
        is_valid = (
            record["version"] == __version__
            and record["format"] == FORMAT
            and record["records"] == digest_records(study)
            and checksum == _checksum(record)
        )
        return dict(record["results"]) if is_valid else None
    # The file is missing, or another program wrote it.
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _checksum(record: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record).encode()).hexdigest()
