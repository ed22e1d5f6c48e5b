"""Write the results of the study what-guides: page, figures, table, and an article in Markdown.

Every number is computed from stored cells. The quick form has no predictions and no verdicts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Final, NamedTuple

import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.analysis.atlas.claims import AtlasClaimResult
from baldwinlab.analysis.atlas.tables import estimate_mean
from baldwinlab.analysis.guidance.figures import draw_chain, draw_effects, draw_models
from baldwinlab.analysis.guidance.predictions import (
    CHAIN,
    CONTROL,
    LARGE,
    LEARNING,
    NK,
    add_effects,
    evaluate_predictions,
)
from baldwinlab.analysis.report.sections import ReportFigure, Section, render, save_and_inline
from baldwinlab.analysis.report.tables import Table, tabulate
from baldwinlab.analysis.results.numbers import replace_undefined
from baldwinlab.api.cells import CellsRequest, read_digests
from baldwinlab.api.guidance.run import choose_design, read_groups, require_same_design
from baldwinlab.api.publish.registered_claims import (
    describe_claims,
    publish_results,
    render_claims,
)
from baldwinlab.papers.guidance_design import DESIGN_FILE, GuidanceDesign, GuidanceGroup

PAGE_FILE: Final = "what-guides.html"
# Common generations of the tables, as in the fork assay of the other models.
NK_HORIZON: Final = 100
MODEL_HORIZON: Final = 20
STARTS: Final = {"population": "the population", "mode": "copies of the most frequent genotype"}
EQUAL: Final = "equal in every run"
QUICK_NOTE: Final = "This is the quick form: it has too few runs for verdicts, and shows none."


class ReportPart(NamedTuple):
    """Groups that the page and the article show together, after the same common generations."""

    title: str
    names: Sequence[str]
    horizon: int


@dataclass(frozen=True)
class GuidanceResults:
    """The results that the page and the article show."""

    design: GuidanceDesign
    groups: Mapping[str, xr.Dataset]  # Cells with effects, by name of the group.
    predictions: Sequence[AtlasClaimResult]
    digest: str  # SHA-256 of the design at the first start.
    seed: int

    @property
    def summary(self) -> str:
        """Sentences with the verdicts, or the note of the quick form."""
        return describe_claims(self.predictions) or QUICK_NOTE

    def find_group(self, name: str) -> GuidanceGroup:
        """Return the design of a group."""
        return next(group for group in self.design.groups if group.name == name)

    def list_parts(self) -> list[ReportPart]:
        """Return the NK landscapes, the groups with a law, and the other models."""
        names = [*self.groups]
        landscapes = [name for name in names if name in (NK, LARGE)]
        others = [name for name in names if name not in (NK, LARGE, CHAIN)]
        return [
            ReportPart("NK landscapes", landscapes, NK_HORIZON),
            ReportPart(self.find_group(CHAIN).title, [CHAIN], NK_HORIZON),
            ReportPart("Other models", others, MODEL_HORIZON),
        ]


def read_results(request: CellsRequest) -> GuidanceResults:
    """Return the results of a finished study."""
    require_same_design(request.directory)
    design = choose_design(request)
    cells = read_groups(request, design)
    groups = {
        group.name: add_effects(cells[group.name], is_relative=group.is_relative)
        for group in design.groups
    }
    predictions = evaluate_predictions(design.predictions, groups, design.least_runs)
    digest = read_digests(request.directory)[DESIGN_FILE]
    return GuidanceResults(design, groups, predictions, digest, request.seed)


def publish_guidance(request: CellsRequest) -> None:
    """Write the page, the figures, the table, the verdicts and the article."""
    results = read_results(request)
    publish_results(
        request.directory / PAGE_FILE,
        results.design.title,
        results.summary,
        [row for name, cells in results.groups.items() for row in list_rows(name, cells)],
        results.predictions,
        render_article(results),
        _list_sections(results, request.directory / "figures"),
    )


def list_rows(name: str, cells: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield a row per cell, arm, start and horizon: the mean with its interval."""
    effects = cells["effect"].drop_sel(arm=CONTROL)
    labels = ("cell", "arm", "start", "horizon")
    for values in product(*(effects[label].values.tolist() for label in labels)):
        key = dict(zip(labels, values, strict=True))
        predicted = None
        if "predicted" in cells and key["arm"] == LEARNING:
            expected = cells["predicted"].sel(cell=key["cell"], horizon=key["horizon"]).mean("run")
            predicted = float(expected.sel(history=LEARNING) - expected.sel(history=CONTROL))
        interval = replace_undefined(estimate_mean(effects.sel(key))._asdict())
        yield {"group": name, **key, **interval, "predicted": predicted}


def _list_sections(results: GuidanceResults, figures: Path) -> Iterator[Section]:
    """Yield a section for each part of the report, and one for the predictions."""
    for part, figure in zip(results.list_parts(), _draw_parts(results), strict=True):
        body = render(
            "guidance/section.html",
            descriptions=[results.find_group(name).description for name in part.names],
            figure=save_and_inline(figure, figures),
            tables=list_tables(results, part),
        )
        yield Section(figure.name, part.title, body)
    if results.predictions:
        files = {"claims_file": DESIGN_FILE, "digest": results.digest}
        body = render_claims("Predictions", results.predictions, **files)
        yield Section("predictions", "Predictions", body)


def _draw_parts(results: GuidanceResults) -> list[ReportFigure]:
    """Return the figure of each part."""
    landscapes, chain, models = results.list_parts()
    return [
        ReportFigure(
            name="effects",
            title=landscapes.title,
            caption="Innate fitness of an arm minus that of the control, with the 95 % interval of "
            "the mean over landscapes. The axes that a panel does not show are at K = 5, 30 "
            "trials, 100 agents and 100 common generations.",
            alternative="Effects of learning, noise and time by K, trials, agents and generations.",
            figure=draw_effects([results.groups[name] for name in landscapes.names]),
        ),
        ReportFigure(
            name="chain",
            title=chain.title,
            caption="Effect of learning with the 95 % interval over landscapes (points), and the "
            "prediction of the Markov chain for the same landscapes (line). Nothing is fitted.",
            alternative="Measured effect of learning and the Markov chain, by generations.",
            figure=draw_chain(results.groups[CHAIN]),
        ),
        ReportFigure(
            name="models",
            title=models.title,
            caption=f"Effect after {models.horizon} common generations, divided by the higher "
            "innate fitness of arm and control, with the 95 % interval over runs.",
            alternative="Relative effects of learning, noise and time in the other models.",
            figure=draw_models(
                {results.find_group(name).title: results.groups[name] for name in models.names},
                models.horizon,
            ),
        ),
    ]


def list_tables(results: GuidanceResults, part: ReportPart) -> list[Table]:
    """Return a table per start of the common generations, with the arms of any of the groups."""
    cells_of_groups = [results.groups[name] for name in part.names]
    arms = dict.fromkeys(arm for cells in cells_of_groups for arm in cells["arm"].values.tolist())
    del arms[CONTROL]
    tables = []
    for start, words in STARTS.items():
        rows = [
            [name, *[_format_effect(cells, name, arm, start, part.horizon) for arm in arms]]
            for cells in cells_of_groups
            for name in cells["cell"].values.tolist()
            if start in cells["start"]
        ]
        if rows:
            caption = f"{part.title}, {part.horizon} common generations from {words}"
            tables.append(tabulate(caption, ["Cell"], arms, rows)._replace(caption=caption))
    return tables


def _format_effect(cells: xr.Dataset, name: str, arm: str, start: str, horizon: int) -> str:
    if arm not in cells["arm"]:
        return "–"
    effects = cells["effect"].sel(cell=name, arm=arm, start=start, horizon=horizon)
    return EQUAL if bool((effects == 0).all()) else str(estimate_mean(effects))


def render_article(results: GuidanceResults) -> str:
    """Return the article as Markdown."""
    return render(
        "guidance/article.md",
        design=results.design,
        summary=results.summary,
        results=results.predictions,
        tables=[table for part in results.list_parts() for table in list_tables(results, part)],
        seed=results.seed,
        digest=results.digest,
        version=__version__,
    )
