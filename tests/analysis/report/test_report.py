"""Report of a study: sentences, figures, a self-contained page, and its layout in a browser."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import pytest
import xarray as xr
from playwright.sync_api import Browser

from baldwinlab import papers
from baldwinlab.analysis import statistics
from baldwinlab.analysis.claim_results import Finding
from baldwinlab.analysis.claims import evaluate_claims
from baldwinlab.analysis.report.content import format_timing, read_experiment_texts, title_worlds
from baldwinlab.analysis.report.data import ReportData, emergence_generations
from baldwinlab.analysis.report.figures.boxes import describe_p_values
from baldwinlab.analysis.report.figures.fitness import draw_measures
from baldwinlab.analysis.report.setup import (
    describe_fitness,
    describe_variant,
    describe_variants,
    format_setting,
    select_open_choices,
    summarize_setup,
)
from baldwinlab.analysis.report.study import compose_headline, draw_report, write_report
from baldwinlab.analysis.report.tables import describe_comparison, describe_finding
from baldwinlab.analysis.results.numbers import format_number, format_p_value
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import from_toml
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.papers.claims import ClaimComparison
from baldwinlab.papers.presets import factors, load
from tests.analysis.report.browsing import errors_and_width
from tests.analysis.results.studies import AS_THE_PAPER, compare_conditions, study, trace
from tests.axe import find_violations

PAPER = papers.load()
SETUP_FIGURES = ("networks", "senses", "maps")
LOOKS = {"evo/A": describe_appearance(load("evo/A")).to_dict()}
FORAGERS = "evo+self-taught/B"
FACTS = {
    "seed": 7,
    "versions": {"NumPy": "9.9"},
    "platform": "A machine",
    "seconds": 10,
    "agent_steps": 2_000_000_000,
    "workers": [2],
}


def report_data(data: xr.Dataset, folder: Path, **fields: Any) -> ReportData:
    """Return a study and its results."""
    experiments = {
        name: from_toml(text, name) for name, text in read_experiment_texts(data).items()
    }
    variants = describe_variants(experiments, fields.get("paper"))
    return ReportData(folder, data, experiments, variants=variants, **fields)


def report_of(
    data: xr.Dataset,
    folder: Path,
    traces: list[xr.Dataset] | None = None,
    provenance: dict[str, Any] | None = None,
) -> Path:
    """Write the report on the paper's claims."""
    report = report_data(
        data,
        folder,
        results=evaluate_claims(data),
        traces=traces or [],
        provenance=provenance or {},
        paper=PAPER,
        appearances=LOOKS,
        contrasts=compare_conditions(data),
    )
    return write_report(folder, draw_report(report), folder / "report.html")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    data = study({**AS_THE_PAPER, "self-taught/A": range(80, 88)})
    traces = [trace(FORAGERS, generation) for generation in emergence_generations(12)]
    return report_of(data, tmp_path_factory.mktemp("study"), traces, FACTS)


def test_the_page_states_what_was_run_and_the_results(page: Path) -> None:
    text = page.read_text("utf-8")
    for needed in (
        *("C1", "C9", "holds", "undecided", "about 40 items more", "A12", "95&nbsp;%", "Nam Le"),
        *("standard except for", "A machine", "9.9", "200.0 million per second", "workers: 2"),
        *("[evolution]", "generations = 12"),
    ):
        assert needed in text
    assert "9 claims of the paper: 7 hold, 1 is undecided, 1 does not hold." in text
    assert "This study has 8 runs per condition, and the paper has 30." in text
    # Where it differs from the paper it names the open choices.
    section = page.read_text("utf-8").split('id="differences"')[1].split("<h2")[0]
    assert "C6" in section and "C2" not in section
    assert "senses.visual_radius</code> is 40" in section
    # It needs nothing but itself.
    assert not re.search(
        r"""(src|href)\s*=\s*["'](?!data:|#|figures/|http://127\.0\.0\.1:8642/)|@import|url\((?!"data:|#)"""
        r"""|<script|<link(?! rel="icon")""",
        text,
    )
    assert page.stat().st_size < 4_000_000
    # Its contents lead to every section.
    contents = text.split('aria-label="Contents"')[1].split("</nav>")[0]
    assert re.findall(r'href="#([^"]+)"', contents) == re.findall(r'<h2 id="([^"]+)"', text)
    # The first figure has a heading without an entry.
    assert text.count("<h2") - 1 == text.count('<h2 id="') == contents.count("<li>") > 5


def test_curves_of_a_learner_and_its_control_have_labels_in_words(tmp_path: Path) -> None:
    data = study({name: AS_THE_PAPER[name] for name in ("evo/A", "evo+self-taught/A")})
    learns = {name: name != "evo/A" for name in data["condition"].values}
    contrasts = replace(compare_conditions(data), learns=learns)
    drawn = draw_measures(report_data(data, tmp_path, contrasts=contrasts), ["mean"])
    labels = [text.get_text() for text in drawn.figure.axes[0].texts]
    assert sorted(labels) == ["agents that\ndo not learn", "agents that\nlearn"]
    # Other figures and tables have the names.
    assert "evo+self-taught: agents that learn; evo: agents that do not learn." in drawn.caption
    assert {row["condition"] for row in drawn.table} == {"evo/A", "evo+self-taught/A"}


def test_every_figure_is_numbered_and_has_its_files_a_text_and_a_lifetime_to_watch(
    page: Path,
) -> None:
    text = page.read_text("utf-8")
    names = ["fitness", "networks", "senses", "maps", "final-fitness", "emergence"]
    numbered = [(name, str(number)) for number, name in enumerate(names, 1)]
    assert re.findall(r'href="#figure-([\w-]+)">Figure\xa0(\d)</a>', text) == numbered
    files = re.findall(r'href="(figures/[^"]+)"', text)
    assert {"figures/emergence.svg", "figures/emergence.png", "figures/emergence.csv"} < set(files)
    assert all((page.parent / file).is_file() for file in files)
    arguments = "--condition evo+self-taught/B --run 0 --generation 11 --out life.mp4"
    assert f"baldwinlab replay . {arguments}" in text
    # The numbers of a curve are those of its file.
    first, *rows = (page.parent / "figures" / "fitness.csv").read_text().splitlines()
    assert first == "condition,measure,generation,median,low,high"
    assert any(row.startswith("evo/A,best,0,83.5,") for row in rows)
    # Every figure is kept and has a text in its place.
    assert {path.name for path in (page.parent / "figures").iterdir() if path.suffix != ".csv"} == {
        f"{name}{end}" for name in names for end in (".svg", ".pdf", ".png")
    }
    alternatives = re.findall(r'role="img" aria-label="([^"]+)"', page.read_text("utf-8"))
    assert len(alternatives) == len(names) and all(len(text) > 30 for text in alternatives)
    # Every figure has its data and every result a lifetime to watch.
    parts = page.read_text("utf-8").split('<figure id="figure-')[1:]
    for part in parts:
        name, text = part.split('"')[0], part.split("</figure>")[0]
        assert all(f"figures/{name}.{ending}" in text for ending in ("svg", "pdf", "png", "csv")), (
            name
        )
        assert ("http://127.0.0.1:8642/#/world?" in text) == (name not in SETUP_FIGURES), name


@pytest.mark.usefixtures("placeholder_figures")
def test_a_page_in_another_folder_links_to_the_figures(tmp_path: Path) -> None:
    folder = tmp_path / "a study"
    out = tmp_path / "pages" / "report.html"
    write_report(folder, draw_report(report_data(study(AS_THE_PAPER), folder)), out)
    assert 'href="../a%20study/figures/fitness.csv"' in out.read_text("utf-8")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_accessibility_error(
    browser: Browser, page: Path, scheme: Literal["light", "dark"]
) -> None:
    with browser.new_context(color_scheme=scheme) as context:
        opened = context.new_page()
        opened.goto(page.as_uri())
        opened.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
        assert find_violations(opened) == []


@pytest.mark.usefixtures("placeholder_figures")
def test_the_same_study_gives_the_same_page(tmp_path: Path) -> None:
    data = study({"evo/A": [1, 2], "evo+self-taught/A": [3, 4]}, generations=3)
    one, two = (report_of(data, tmp_path / name).read_bytes() for name in ("one", "two"))
    assert one == two


# Tests of the figures draw odd studies.
@pytest.mark.usefixtures("placeholder_figures")
@pytest.mark.parametrize(
    "data",
    [
        study({"my-rule": [3]}, generations=1, agents=1),
        study({"evo/A": [1, 2], "evo/B": [float("nan"), float("nan")]}),
        study({name: [0] for name in AS_THE_PAPER}),
    ],
    ids=["custom condition", "condition without values", "no meals"],
)
def test_odd_studies_have_a_report_too(data: xr.Dataset, tmp_path: Path) -> None:
    text = report_of(data, tmp_path).read_text("utf-8")
    reasons = ("is about conditions of this study", "not evaluated", "too few runs")
    assert any(reason in text for reason in reasons)
    assert "nan" not in re.sub(r'"data:[^"]*"', "", text).lower()


@pytest.mark.usefixtures("placeholder_figures")
def test_names_are_text_and_not_markup(tmp_path: Path) -> None:
    text = report_of(
        study({"mine": [1, 2]}), tmp_path, provenance={"platform": "<script>alert(1)</script>"}
    ).read_text("utf-8")
    assert "<script>" not in text


def test_generations_of_the_panel_are_the_denser_the_earlier_with_both_ends() -> None:
    assert emergence_generations(100) == [0, 1, 3, 10, 31, 99]
    assert emergence_generations(6) == [0, 1, 2, 3, 4, 5]
    assert emergence_generations(2) == [0, 1]
    assert emergence_generations(1) == [0]


def test_the_variant_is_named_or_spelt_out() -> None:
    assert describe_variant(load("evo/A"), PAPER) == "standard"
    assert describe_variant(load("evo/A", "literal"), PAPER) == "literal"
    shorter = load("evo/A").replace(lifetime={"steps": 9})
    text = "evo/A is standard except for lifetime.steps = 9"
    assert describe_variant(shorter, PAPER) == text
    mine = load("evo/A").replace(name="mine")
    assert describe_variant(mine, PAPER) == "mine is not a condition of the paper"
    # Its variants cannot all be laid over every condition.
    paper = papers.load("worlds-and-minds")
    described = {describe_variant(experiment, paper) for experiment in paper.experiments()}
    assert described == {"standard"}
    both = {"a": load("evo/A"), "b": load("evo/A", "literal")}
    assert format_setting("senses.visual_radius", both) == "40 or 4"


@pytest.mark.usefixtures("placeholder_figures")
def test_senses_are_not_drawn_without_the_looks_of_agents(tmp_path: Path) -> None:
    data = study(AS_THE_PAPER)
    contents = draw_report(report_data(data, tmp_path))
    write_report(tmp_path, contents, tmp_path / "report.html")
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert names == {"fitness", "final-fitness", "maps"}


def test_maps_are_titled_by_what_tells_them_apart() -> None:
    paper = {name: load(name) for name in AS_THE_PAPER}
    assert list(title_worlds(paper, factors())) == ["Map A", "Map B"]
    moved = load("evo/A").replace(world={"start": {"x": 100}})
    experiments = {"one/A": load("evo/A"), "two/A": moved}
    named = {"one/A": Factors("one", "A"), "two/A": Factors("two", "A")}
    assert list(title_worlds(experiments, named)) == ["one/A", "two/A"]


def test_facts_may_be_absent() -> None:
    assert format_timing({}) == ""
    setup = dict(summarize_setup(study({"mine": [1]}), {"mine": load("evo/A")}, {}, {}))
    assert setup["seed"] == "7"
    assert select_open_choices([], {}) == []


def test_numbers_have_three_digits_and_probabilities_are_never_nought() -> None:
    numbers = {0: "0", 286.4: "286", -9.75: "−9.75", 12345.6: "12,346", 0.001: "0.00100"}
    assert [format_number(value) for value in numbers] == [*numbers.values()]
    probabilities = {1e-9: "1.0e-09", 0.0312: "0.031", 0.24: "0.24", 1: "1.00"}
    assert [format_p_value(p) for p in probabilities] == [*probabilities.values()]
    assert format_number(float("nan")) == format_p_value(float("nan")) == "–"


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)], ids=["desk", "phone"])
def test_a_browser_shows_it_without_errors_or_horizontal_scrolling(
    browser: Browser, page: Path, width: int, height: int
) -> None:
    assert errors_and_width(browser, page, width, height) == ([], width)


def test_fitness_is_said_in_its_unit() -> None:
    assert describe_fitness([load("evo/A")]).endswith(
        "; an item gives 1, so fitness is the number of eaten items"
    )
    costly = load("evo+self-taught/A").replace(learning={"cost_per_step": 0.1})
    assert describe_fitness([costly]).endswith(
        "in its lifetime, minus the cost of learning; an item gives 1"
    )
    assert describe_fitness([]) == ""
    distance = load("evo/A").replace(evolution={"fitness": "distance"})
    assert describe_fitness([distance]) == "evolution.fitness = 'distance'"


def test_on_paper_no_page_is_empty(browser: Browser, page: Path) -> None:
    opened = browser.new_page()
    opened.goto(page.as_uri())
    opened.emulate_media(media="print")
    heights = opened.evaluate(
        "[...document.querySelectorAll('figure')].map(one => one.getBoundingClientRect().height)"
    )
    assert max(heights) < 265 * 96 / 25.4  # what A4 leaves between its margins, in CSS pixels
    # All settings of six conditions take about five pages.
    assert opened.pdf(format="A4").count(b"/Type /Page\n") <= 20
    n_hidden = opened.evaluate(
        "[...document.querySelectorAll('main details *')]"
        ".filter(part => !part.closest('figure') && !part.checkVisibility()).length"
    )
    assert n_hidden == 0
    opened.close()


def text_of(page: Path) -> str:
    """The words of a page, without pictures and styles."""
    return re.sub(r'"data:[^"]*"|<style>.*?</style>', "", page.read_text("utf-8"), flags=re.DOTALL)


def own_report(data: xr.Dataset, folder: Path) -> str:
    """The report of a study that no paper made."""
    traces = [trace(str(data["condition"].values[0]), int(data["generation"][-1]))]
    report = report_data(
        data,
        folder,
        traces=traces,
        provenance=FACTS,
        appearances=LOOKS,
        contrasts=compare_conditions(data),
    )
    return text_of(write_report(folder, draw_report(report), folder / "report.html"))


@pytest.mark.usefixtures("placeholder_figures")
def test_claims_that_are_asked_for_and_concern_no_condition_are_left_out(tmp_path: Path) -> None:
    text = report_of(study({"mine": range(8)}), tmp_path).read_text("utf-8")
    assert "<h1>Evolution and lifetime learning: mine</h1>" in text
    assert "No claim of Nam Le" in text and "is about conditions of this study." in text
    assert "not evaluated" not in text
    assert ">Claims</h2>" not in text


@pytest.mark.usefixtures("placeholder_figures")
@pytest.mark.parametrize(
    "names", [("mine", "yours"), ("evo/A", "evo+self-taught/A"), ("evo+self-taught/B", "short")]
)
def test_a_study_of_no_paper_is_reported_without_a_word_on_papers(
    names: tuple[str, str], tmp_path: Path
) -> None:
    text = own_report(study({names[0]: range(8), names[1]: range(20, 28)}), tmp_path)
    assert f"<h1>Evolution and lifetime learning: {names[0]}, {names[1]}</h1>" in text
    # Without experiments and names of styles.
    words = re.sub(r"<pre.*?</pre>|class=\"[^\"]*\"", "", text, flags=re.DOTALL)
    assert not re.search(r"paper|claim|bracket|reproduction", words, re.IGNORECASE)


@pytest.mark.usefixtures("placeholder_figures")
def test_the_comparison_of_the_conditions_stands_first(tmp_path: Path) -> None:
    text = own_report(study({"evo/A": range(8), "evo+drift/A": range(20, 28)}), tmp_path)
    assert re.findall(r'<h2 id="([^"]+)"', text)[0] == "compared"
    section = text.split('id="compared"')[1].split("<h2")[0]
    assert "Each condition is compared with evo/A." in section
    assert section.count("</span> higher</span>") == 2  # in the average and in the best agent
    for text in ("<strong>+20.0 [", '<td class="plain" data-label="Runs">8, 8</td>'):
        assert text in section


@pytest.mark.usefixtures("placeholder_figures")
def test_a_study_with_too_few_runs_says_so(tmp_path: Path) -> None:
    text = own_report(study({"evo/A": range(4), "evo+drift/A": range(20, 24)}), tmp_path)
    assert (
        "With 4 runs and 2 tests, the smallest corrected p-value is 0.057. "
        "At least 5 runs are needed." in text
    )
    assert text.count("</span> too few runs</span>") == 2 and "</span> undecided</span>" not in text
    # Claims of too few runs say so.
    few = {name: list(values)[:3] for name, values in AS_THE_PAPER.items()}
    text = text_of(report_of(study(few), tmp_path))
    assert re.search(
        r"With 3 runs and \d+ tests, the smallest corrected p-value is 1\. "
        r"At least \d+ runs are needed\.",
        text,
    )
    assert "</span> too few runs</span>" in text


@pytest.mark.usefixtures("placeholder_figures")
def test_many_comparisons_are_folded(tmp_path: Path) -> None:
    text = own_report(
        study({f"own-{number}": range(8) for number in range(22)}, generations=2, agents=2),
        tmp_path,
    )
    assert "<details><summary>All comparisons of conditions</summary>" in text


def test_a_bounded_measure_of_the_average_agent_is_not_a_share() -> None:
    comparison = ClaimComparison(a="taught", measure="mean", rule="mean_within", bound=(75.0, 98.8))
    numbers = statistics.Comparison(5, 0, 80.0, *[float("nan")] * 7)._replace(effect=81.5)
    text = describe_finding(Finding(comparison, numbers, "holds"))
    assert text == "taught: average agent, mean over runs: 81.5"


def test_survival_is_reported_as_restricted_means_because_medians_can_differ_in_sign() -> None:
    """A few long lifetimes outweigh many lifetimes that are somewhat shorter."""
    comparison = ClaimComparison(a="ERL", b="B", measure="survived", rule="survives_longer")
    numbers = statistics.Comparison(
        100, 100, 6001.5, 8343.0, 304397.5, 215251.4, 395110.5, 3.14, 0.0017, 0.485
    )
    finding = Finding(comparison, numbers, "holds", "steps that the population survives")
    steps = "steps that the population survives"
    mean = f"{steps}, restricted mean: +304,398 in ERL compared with B"
    assert describe_finding(finding) == mean
    assert describe_comparison(finding) == f"ERL 6,002, B 8,343 ({steps}; medians)"


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)], ids=["desk", "phone"])
def test_the_first_screen_has_question_answer_effect_and_a_link_to_watch(
    browser: Browser, page: Path, width: int, height: int
) -> None:
    opened = browser.new_page(viewport={"width": width, "height": height})
    opened.goto(page.as_uri())
    for part in (
        ".question",
        ".lead",
        ".lead + .soft",
        ".first > div > .watch a",
        ".first figure h2",
    ):
        bottom = opened.evaluate(
            "part => document.querySelector(part).getBoundingClientRect().bottom", part
        )
        assert bottom <= height, part
    if width == 1280:
        image = "document.querySelector('.first .image').getBoundingClientRect().bottom"
        assert opened.evaluate(image) <= height
    assert opened.evaluate("document.documentElement.scrollHeight") <= 6000
    opened.close()


def test_the_contents_stay_in_sight_and_are_folded_on_a_phone(browser: Browser, page: Path) -> None:
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    opened.goto(page.as_uri())
    opened.evaluate("scrollTo(0, 900)")
    link = opened.get_by_role("link", name="Experiments", exact=True)
    assert opened.evaluate("scrollY") > 300
    assert 0 < link.bounding_box()["y"] < 800  # type: ignore[index]
    opened.set_viewport_size({"width": 390, "height": 844})
    assert not link.is_visible()
    opened.get_by_role("button", name="Contents").click()
    link.click()
    # A link opens its topic.
    assert opened.get_by_text("All settings of each condition.").is_visible()
    opened.close()


def test_on_a_phone_a_figure_has_one_panel_per_row(browser: Browser, page: Path) -> None:
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    opened.goto(page.as_uri())
    shape = (
        "(box => box.width / box.height)"
        "(document.querySelector('.first .image').getBoundingClientRect())"
    )
    # Two rows of two panels, then four rows.
    assert opened.evaluate(shape) > 1
    opened.set_viewport_size({"width": 390, "height": 844})
    assert opened.evaluate(shape) < 0.5
    opened.close()


def test_the_first_screen_of_a_custom_study_states_its_comparison_or_its_fitness(
    tmp_path: Path,
) -> None:
    data = study({"mine": range(8), "yours": range(20, 28)})
    contrasts = compare_conditions(data)
    headline = compose_headline(report_data(data, tmp_path, contrasts=contrasts))
    assert headline["question"] == "Do mine and yours differ in fitness?"
    (answer,) = headline["answer"]
    assert answer.startswith("The fitness of agents of yours is 20.0 higher than that of agents of")
    assert "medians over 8 runs" in headline["statistic"]
    assert headline["commands"] == [
        f"baldwinlab replay . --condition {name} --run 3 --generation 11 --out life.mp4"
        for name in ("yours", "mine")
    ]
    headline = compose_headline(report_data(study({"mine": range(8)}), tmp_path))
    assert headline["question"] == "How fit do the agents of mine become?"
    assert "3.50 in 8 runs of mine." in headline["answer"][0] and headline["statistic"] == ""


def test_a_caption_describes_only_the_p_values_that_the_figure_has() -> None:
    data = study(AS_THE_PAPER)
    assert describe_p_values(data, evaluate_claims(data)).startswith("Brackets show ")
    assert describe_p_values(data, []) == ""
    custom = study({"mine": range(8), "yours": range(8)})
    assert describe_p_values(custom, evaluate_claims(data)) == ""
