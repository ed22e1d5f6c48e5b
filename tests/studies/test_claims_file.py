"""Claims are read only if the report wrote them about the stored runs."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.studies.claims_file import CLAIMS_FILE, read_claims, write_claims
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, shorten_preset

VERDICTS: list[dict[str, Any]] = [
    {"id": "C1", "verdict": "undecided", "effect": 1.5},
    {"id": "C2", "verdict": "holds", "effect": None},
]


@pytest.fixture
def study(tmp_path: Path) -> StudyStore:
    return make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=2)


def test_claims_are_read_as_they_were_written(study: StudyStore) -> None:
    assert read_claims(study) == []
    write_claims(study, VERDICTS)
    assert read_claims(study) == VERDICTS


def test_a_manually_changed_file_is_refused(study: StudyStore) -> None:
    write_claims(study, VERDICTS)
    path = study.directory / CLAIMS_FILE
    stored = json.loads(path.read_text())
    for changed in (
        stored | {"claims": [VERDICTS[0] | {"verdict": "holds"}, VERDICTS[1]]},
        stored | {"claims": [VERDICTS[0] | {"effect": 2.5}, VERDICTS[1]]},
        stored | {"claims": [*VERDICTS, VERDICTS[0]]},
        stored | {"records": "0" * 64},
        *(5, {}, {"claims": 5}, {"claims": [5]}, None, "claims", VERDICTS),
    ):
        path.write_text(json.dumps(changed))
        message = r"claims\.json was not written by a report; `baldwinlab report .*` makes it"
        with pytest.raises(StudyError, match=message):
            read_claims(study)


def test_claims_about_different_runs_are_refused(study: StudyStore, tmp_path: Path) -> None:
    write_claims(study, VERDICTS)
    grown = make_small_study(study.directory, [shorten_preset("evo/A")], runs=3)
    second = make_small_study(tmp_path / "other", [shorten_preset("evo/A")], runs=3, seed=6)
    write_claims(second, VERDICTS)
    for path in (grown.directory / CLAIMS_FILE, second.directory / CLAIMS_FILE):
        (grown.directory / CLAIMS_FILE).write_bytes(path.read_bytes())
        message = "was decided by other runs than those that are stored now"
        with pytest.raises(StudyError, match=message):
            read_claims(grown)


def test_huge_claims_are_refused_before_they_are_read(study: StudyStore) -> None:
    (study.directory / CLAIMS_FILE).touch()
    os.truncate(study.directory / CLAIMS_FILE, 20 * 10**9)
    with pytest.raises(
        StudyError,
        match="cannot be read: it has 20,000,000,000 bytes, and a JSON file of results may",
    ):
        read_claims(study)
