"""Tests of the access to studies in the folder of a lab."""

from __future__ import annotations

import shutil
from pathlib import Path

from baldwinlab.lab import Lab
from baldwinlab.lab.sources.live import Live
from baldwinlab.lab.sources.study_access import find_study, list_study_names
from baldwinlab.studies.creation import create_study
from tests.small_studies import shorten_preset


def test_a_study_can_be_the_folder_itself_or_be_in_another_study(tmp_path: Path) -> None:
    create_study(tmp_path, [shorten_preset()], 1)
    create_study(tmp_path / "variants" / "deep", [shorten_preset()], 2)
    assert list(list_study_names(tmp_path)) == [".", "variants/deep"]
    lab = Lab(tmp_path, Live())
    assert find_study(lab, ".").seed == 1
    assert find_study(lab, "variants/deep").seed == 2


def test_a_missing_folder_has_no_studies(tmp_path: Path) -> None:
    assert list(list_study_names(tmp_path / "results")) == []


def test_a_replaced_study_is_read_again(tmp_path: Path) -> None:
    lab = Lab(tmp_path, Live())
    create_study(tmp_path / "it", [shorten_preset()], 1)
    assert find_study(lab, "it").seed == 1
    shutil.rmtree(tmp_path / "it")
    create_study(tmp_path / "it", [shorten_preset()], 2)
    assert find_study(lab, "it").seed == 2
