"""The HTML of a study in a notebook."""

from __future__ import annotations

import base64
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from baldwinlab.analysis.figures.style import choose_style
from baldwinlab.api.study import Study, open_study
from tests.small_studies import make_small_study, shorten_preset


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    directory = tmp_path_factory.mktemp("inline") / "<b>small"
    make_small_study(directory, runs=2)
    return open_study(directory)


def drawings(page: str) -> list[ElementTree.Element]:
    return [
        ElementTree.fromstring(base64.b64decode(code))
        for code in re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page)
    ]


def test_a_study_shows_its_content_and_a_curve_per_condition(study: Study) -> None:
    page = study._repr_html_()
    assert "evo+self-taught/A: 2 runs" in page
    (drawing,) = drawings(page)
    styles = " ".join(element.get("style", "") for element in drawing.iter())
    strokes = [f"stroke: {choose_style(number).color.lower()}" for number in range(3)]
    assert [stroke in styles for stroke in strokes] == [True, True, False]
    assert "<b>" not in page
    assert len(page) < 150_000
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", page)


def test_only_its_first_conditions_are_drawn(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    full_length = len(study._repr_html_())
    monkeypatch.setattr("baldwinlab.api.study.MAX_LISTED_CONDITIONS", 1)
    page = study._repr_html_()
    assert "and 1 more conditions" in page
    assert len(page) < full_length


def test_a_study_without_runs_or_with_a_damaged_record_has_no_curves(
    tmp_path: Path, study: Study
) -> None:
    make_small_study(tmp_path / "new", [shorten_preset("evo/A")], runs=0)
    page = open_study(tmp_path / "new")._repr_html_()
    assert "evo/A: 0 runs" in page
    assert not drawings(page)
    make_small_study(tmp_path / "hurt", [shorten_preset("evo/A")], runs=1)
    (record,) = (tmp_path / "hurt").rglob("*.nc")
    record.write_bytes(record.read_bytes()[:-1])
    page = open_study(tmp_path / "hurt")._repr_html_()
    assert record.name in page
    assert not drawings(page)
