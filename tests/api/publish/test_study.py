"""A study's report has a section for what else is stored of it, and none for what is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab.api.publish.plan import plan_report
from baldwinlab.api.publish.study import publish_study
from baldwinlab.core import console
from baldwinlab.studies.assays.results import encode_assay
from tests.analysis.assays.artificial_assays import (
    AGENTS,
    GENERATIONS,
    assign_to_study,
    constant,
    innate,
    rising,
)
from tests.small_studies import ignore_message, make_small_study, shorten_preset

A = "evo+self-taught/A"


@pytest.mark.nightly  # two reports with assays
def test_stored_assays_add_a_section_and_nothing_stored_adds_none(tmp_path: Path) -> None:
    experiment = shorten_preset(A).replace(
        population={"size": AGENTS}, evolution={"generations": GENERATIONS}
    )
    study, page = make_small_study(tmp_path / "study", [experiment], 2), tmp_path / "page.html"
    publish_study(plan_report(study, page), ignore_message, console.progress)
    assert "Baldwin effect?" not in page.read_text("utf-8")
    path = study.directory / "assays" / "innate" / f"{A}.nc"
    path.parent.mkdir(parents=True)
    assay = assign_to_study(innate(A, off=constant(1), on=rising(1, 9)), study, A)
    path.write_bytes(encode_assay(assay))
    publish_study(plan_report(study, page), ignore_message, console.progress)
    assert '<h2 id="baldwin">Is there a Baldwin effect?</h2>' in page.read_text("utf-8")
    assert '<h2 id="trait-changes">' in page.read_text("utf-8")
    assert (study.directory / "trait-changes.csv").exists()
    assert (study.directory / "baldwin.csv").exists() and (
        study.directory / "baldwin.json"
    ).exists()
    path.write_bytes(path.read_bytes()[:99])
    with pytest.raises(ValueError, match=r"A\.nc is damaged"):
        publish_study(plan_report(study, page), ignore_message, console.progress)
