"""Test that the site is complete, has no dead links and works without a network."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

import baldwinlab
from baldwinlab import papers, parts
from baldwinlab.cli import COMMANDS
from baldwinlab.core import variables
from baldwinlab.core.assay_variables import ASSAY_VARIABLES
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import Experiment, registry, validate
from baldwinlab.experiment.class_builder import choosing_fields
from scripts import documentation, part_reference, reference
from tests.lab.conftest import open_offline_page

ROOT = Path(__file__).parent.parent
# MyST uses a name that a later version of Sphinx will remove.
pytestmark = [
    pytest.mark.filterwarnings("ignore:.*MystReferenceResolver.app"),
    # Sphinx needs a minute for the site.
    pytest.mark.nightly,
]
pytest.importorskip("furo", reason="the site needs the extra 'docs'")


class Links(HTMLParser):
    """The anchors of a page, its links and the files that it loads."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.anchors = set[str]()
        self.targets: list[str] = []
        self.loaded: list[str] = []
        self.feed(page.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.anchors.add(values.get("id", ""))
        if "src" in values or tag == "link":
            self.loaded.append(values.get("src") or values.get("href", ""))
        elif tag == "a" and "href" in values:
            self.targets.append(values["href"])


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("site")
    executed = tmp_path_factory.mktemp("executed")
    # A notebook links other pages in this way.
    link = '<a href="../docs/reference/file-formats.md#report">more</a>'
    (executed / "first-steps.html").write_text(f'<p id="result">42</p>{link}', "utf-8")
    assert documentation.build(out, executed), "Sphinx reported a warning, see above"
    return out


@pytest.fixture
def offline_page(browser: Browser) -> Iterator[Page]:
    """A browser page without a network; the test fails if the page requests any other host."""
    with open_offline_page(browser, 900) as (page, requests):
        yield page
    assert requests
    assert not [url for url in requests if not url.startswith(("data:", "blob:", "file:"))]


def text_of(site: Path, page: str) -> str:
    """Return the text of a page without its tags."""
    text = re.sub(r"<[^>]+>", "", (site / page).read_text("utf-8"))
    entities = {"&gt;": ">", "&lt;": "<", "&quot;": '"', "&#39;": "'", "&amp;": "&"}
    for entity, character in entities.items():
        text = text.replace(entity, character)
    return text


def test_no_link_is_dead_and_no_file_is_loaded_from_another_host(site: Path) -> None:
    pages = {page: Links(page) for page in site.rglob("*.html") if "laboratories" not in page.parts}
    assert len(pages) > 60
    for page, links in pages.items():
        for target in [*links.targets, *links.loaded]:
            url = urlsplit(target)
            if url.scheme in ("http", "https"):
                assert target not in links.loaded, (page, target)
                continue
            linked = page if not url.path else (page.parent / unquote(url.path)).resolve()
            assert linked.exists(), (page, target)
            if url.fragment and linked in pages:
                assert unquote(url.fragment) in pages[linked].anchors, (page, target)


@pytest.mark.parametrize(
    "fault",
    [
        "[a](missing.md)",
        "[a](index.md#missing)",
        "[a](#missing)",
        "![a](missing.png)",
        "## a\n\n#### b",
    ],
)
def test_a_dead_link_fails_the_build(
    tmp_path: Path, fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "source"
    source.mkdir()
    (source / "index.md").write_text("# First\n\n```{toctree}\nsecond\n```\n")
    (source / "second.md").write_text("# Second\n\n[a link](index.md#first)\n")
    assert documentation.run_sphinx(source, tmp_path / "out")
    assert not capsys.readouterr().err
    with (source / "second.md").open("a") as page:
        page.write(f"\n{fault}\n")
    assert not documentation.run_sphinx(source, tmp_path / "out")
    assert "WARNING" in capsys.readouterr().err


def test_every_page_is_in_a_section(site: Path) -> None:
    targets = {
        target.removesuffix(".html").removesuffix(".py")
        for target in Links(site / "index.html").targets
    }
    pages = [
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "baldwinlab" / "papers").glob("*/README.md"),
        *(ROOT / "notebooks").glob("*.*"),
    ]
    for page in pages:
        assert page.relative_to(ROOT).with_suffix("").as_posix() in targets, page


def test_sections_follow_diataxis(site: Path) -> None:
    captions = re.findall(
        r'class="caption-text">([^<]+)<', (site / "index.html").read_text("utf-8")
    )
    assert captions[:6] == [
        "Tutorials",
        "How-to",
        "Reference",
        "Explanation",
        "Papers",
        "Development",
    ]


def test_every_public_name_has_a_description(site: Path) -> None:
    python = text_of(site, "docs/reference/python.html")
    for name in baldwinlab.__all__:
        assert re.search(rf"^{name}¶$", python, re.MULTILINE), name
        summary = (getattr(baldwinlab, name).__doc__ or "").split("\n")[0].replace("`", "")
        assert name == "__version__" or (summary and summary in python), name


def test_every_command_is_on_its_page_with_its_options(site: Path) -> None:
    text = text_of(site, "docs/reference/commands.html")
    for command in COMMANDS:
        assert re.search(rf"^baldwinlab {command}¶$", text, re.MULTILINE), command
    for option in ("--runs", "--set", "--executor", "--part", "--force", "--quick", "--port"):
        assert option in text, option


def test_every_setting_is_on_its_page(site: Path) -> None:
    shared = text_of(site, "docs/reference/settings.html")
    experiment = Experiment(world={"food": [{"x": [0, 1], "y": [0, 1]}]})
    for path in leaves(experiment.model_dump()):
        assert path in shared, path
    for setting, kind, _ in choosing_fields(Experiment):
        page = part_reference.PAGES_OF_BUILT_IN_PARTS[kind].replace(".md", ".html")
        text = text_of(site, f"docs/reference/{page}")
        for name in registry.package_parts(kind):
            assert name in text, name
            for field in registry.find_class(kind, name).model_fields:
                path = f"{setting.rpartition('.')[0]}.{registry.table_name(name)}.{field}"
                assert path in text, path


def test_every_setting_of_a_model_is_on_its_page(site: Path) -> None:
    text = text_of(site, "docs/reference/models.html")
    for name in registry.package_parts("model"):
        if name != "miniworld":
            key = registry.table_name(name)
            settings = validate({"name": "x", "model": name}).model_dump()[key]
            for path in leaves(settings):
                assert f"{key}.{path}" in text, (name, path)


def leaves(tree: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """Yield the dotted path of every value, with N for the number of a table in a list."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{path}{name}.")
        elif isinstance(value, tuple) and value and isinstance(value[0], Mapping):
            yield from leaves(value[0], f"{path}{name}.N.")
        else:
            yield f"{path}{name}"


def test_a_setting_has_its_limits_default_and_meaning(site: Path) -> None:
    row = text_of(site, "docs/reference/settings.html").split("learning.rate\n")[1]
    assert re.match(r"\s*number, ≥ 0, ≤ 10\s+0.01\s+\w*earning rate, per step", row, re.IGNORECASE)


def test_every_recorded_variable_is_on_its_page(site: Path) -> None:
    text = text_of(site, "docs/reference/variables.html")
    for group in (
        variables.RUN_VARIABLES,
        variables.RECORD_VARIABLES,
        variables.TRACE_VARIABLES,
        *ASSAY_VARIABLES.values(),
    ):
        for name, variable in group.items():
            assert name in text and variable.meaning in text, name


def test_every_paper_is_on_its_page_with_its_presets(site: Path) -> None:
    text = text_of(site, "docs/reference/papers.html")
    for paper in papers.built_in().values():
        assert f"baldwinlab reproduce {paper.name}" in text and paper.metadata.citation in text
        for kind in ("conditions", "controls", "maps", "variants"):
            for name in paper.names(kind):
                description = paper.describe(kind, name).replace("`", "")
                assert name in text and description in text, (paper.name, name)


def test_examples_are_shown_in_full(site: Path) -> None:
    for path in (ROOT / "examples" / "parts").glob("*.py"):
        page = f"examples/parts/{path.name}.html"
        assert path.read_text("utf-8").strip() in text_of(site, page), path.name


def test_the_search_leads_to_a_page_with_the_word(site: Path, offline_page: Page) -> None:
    offline_page.goto((site / "index.html").as_uri())
    offline_page.get_by_role("textbox", name="Search").fill("Baldwin")
    offline_page.keyboard.press("Enter")
    offline_page.locator("ul.search li a").first.click()
    expect(offline_page.locator("article")).to_contain_text("Baldwin")


@pytest.mark.parametrize(
    "page", ["docs/tutorials/first-study.html", "baldwinlab/papers/le_2019/README.html"]
)
def test_a_laboratory_evolves_inside_its_page(site: Path, offline_page: Page, page: str) -> None:
    offline_page.goto((site / page).as_uri())
    offline_page.locator(".laboratory iframe").scroll_into_view_if_needed()
    frame = offline_page.frame_locator(".laboratory iframe")
    expect(frame.get_by_test_id("guide")).to_be_hidden()
    frame.get_by_test_id("pace").select_option("0")
    frame.get_by_test_id("setup-runs").fill("1")
    frame.get_by_test_id("start").click()
    expect(frame.get_by_text(re.compile(r"^([2-9]|\d\d+) of 100 generations$"))).to_be_visible()


@pytest.mark.parametrize(
    "page",
    [
        "index.html",
        "docs/tutorials/first-study.html",
        "docs/reference/settings.html",
        "docs/reference/papers.html",
        "docs/reference/parts/learning-rule.html",
    ],
)
def test_a_page_fits_a_phone(site: Path, offline_page: Page, page: str) -> None:
    offline_page.set_viewport_size({"width": 390, "height": 844})
    offline_page.goto((site / page).as_uri())
    assert offline_page.evaluate("document.documentElement.scrollWidth") <= 390


def test_the_text_of_a_notebook_links_its_results(site: Path, offline_page: Page) -> None:
    offline_page.goto((site / "notebooks" / "first-steps.html").as_uri())
    offline_page.get_by_role("link", name="with its results").click()
    expect(offline_page.locator("#result")).to_have_text("42")


def test_a_folder_with_other_files_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(RefusedError, match="contains files that are not a site"):
        documentation.build(tmp_path)
    assert (tmp_path / "mine.txt").read_text() == "mine"


PERCENT_NOTEBOOK = """# ---
# jupyter: x
# ---

# %% [markdown]
# # Title
#
# Words.

# %%
print(1)
"""
MYST_NOTEBOOK = "# Title\n\nWords.\n\n```{code-cell} python\n:tags: [one]\n\nprint(1)\n```\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [("notebook.py", PERCENT_NOTEBOOK), ("notebook.md", MYST_NOTEBOOK)],
)
def test_the_text_of_a_notebook_is_a_page(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    assert documentation.page_text(tmp_path / name).split() == [
        "#",
        "Title",
        "Words.",
        "```python",
        "print(1)",
        "```",
    ]


def test_the_label_of_a_paper_names_its_authors_and_year() -> None:
    assert (
        reference.short_citation(papers.load("nolfi-elman-parisi-1994"))
        == "Nolfi, Elman and Parisi 1994"
    )
    assert reference.short_citation(papers.load("le-2019")) == "Le 2019"


def test_every_public_name_of_parts_has_a_page(site: Path) -> None:
    helpers = text_of(site, "docs/reference/parts/helpers.html")
    kinds = {kind.__name__ for kind in part_reference.kinds()}
    for name in set(parts.__all__) - kinds:
        assert re.search(rf"^{name}¶$", helpers, re.MULTILINE), name
