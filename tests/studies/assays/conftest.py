"""A study with all assays. The tests of this folder only read the study."""

from __future__ import annotations

import pytest

from baldwinlab.studies.store import StudyStore
from tests.studies.assays.studies import make_small_study_with_assays


@pytest.fixture(scope="package")
def study(tmp_path_factory: pytest.TempPathFactory) -> StudyStore:
    return make_small_study_with_assays(tmp_path_factory.mktemp("assays") / "study")
