"""The documentation's site: whole, searchable and alive, from a disk and without a network."""

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
from baldwinlab import papers, parts, variables
from baldwinlab.cli import COMMANDS
from baldwinlab.errors import RefusedError
from baldwinlab.experiment import Experiment, choices, validate
from baldwinlab.experiment.classes import choosing_fields
from scripts import documentation, reference
from tests.lab.conftest import offline

ROOT = Path(__file__).parent.parent
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*MystReferenceResolver.app"
)  # of MyST, for a Sphinx that is to come
pytest.importorskip("furo", reason="the site needs the extra 'docs'")


class Links(HTMLParser):
    """What a page refers to, what it loads, and the places in it that can be referred to."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.places, self.targets, self.loaded = set[str](), list[str](), list[str]()
        self.feed(page.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.places.add(given.get("id", ""))
        if "src" in given or tag == "link":
            self.loaded.append(given.get("src") or given.get("href", ""))
        elif tag == "a" and "href" in given:
            self.targets.append(given["href"])


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out, executed = tmp_path_factory.mktemp("site"), tmp_path_factory.mktemp("executed")
    linked = '<p id="gave">42</p><a href="../docs/results.md#claims-and-statistics">more</a>'  # as a notebook links
    (executed / "first-steps.html").write_text(linked, "utf-8")
    assert documentation.build(out, executed), "Sphinx has complained, see above"
    return out


@pytest.fixture
def lonely(browser: Browser) -> Iterator[Page]:
    """A page from a disk, without a network; its test fails if it has a fault, or asks for anything from elsewhere."""
    with offline(browser, 900) as (page, asked):
        yield page
    assert asked and not [url for url in asked if not url.startswith(("data:", "blob:", "file:"))]


def words(site: Path, page: str) -> str:
    """The text of a page."""
    text = re.sub(r"<[^>]+>", "", (site / page).read_text("utf-8"))
    return (
        text.replace("&gt;", ">")
        .replace("&lt;", "<")
        .replace("&quot;", '"')
        .replace("&amp;", "&")
        .replace("&#39;", "'")
    )


def test_no_link_is_dead_and_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    pages = {page: Links(page) for page in site.rglob("*.html") if "laboratories" not in page.parts}
    assert len(pages) > 60
    for page, links in pages.items():
        for target in [*links.targets, *links.loaded]:
            parts_of = urlsplit(target)
            if parts_of.scheme in ("http", "https"):
                assert target not in links.loaded, (page, target)
                continue
            there = page if not parts_of.path else (page.parent / unquote(parts_of.path)).resolve()
            assert there.exists(), (page, target)
            if parts_of.fragment and there in pages:
                assert unquote(parts_of.fragment) in pages[there].places, (page, target)


@pytest.mark.parametrize(
    "fault",
    [
        "[a](nowhere.md)",
        "[a](index.md#nowhere)",
        "[a](#nowhere)",
        "![a](none.png)",
        "## a\n\n#### b",
    ],
)
def test_whatever_leads_nowhere_is_a_fault(
    tmp_path: Path, fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "source").mkdir()
    (tmp_path / "source" / "index.md").write_text("# Here\n\n```{toctree}\nother\n```\n")
    (tmp_path / "source" / "other.md").write_text("# There\n\n[well](index.md#here)\n")
    assert (
        documentation.is_made(tmp_path / "source", tmp_path / "out") and not capsys.readouterr().err
    )
    with (tmp_path / "source" / "other.md").open("a") as page:
        page.write(f"\n{fault}\n")
    assert not documentation.is_made(tmp_path / "source", tmp_path / "out")
    assert "WARNING" in capsys.readouterr().err


def test_every_page_of_the_documentation_stands_in_a_section(site: Path) -> None:
    there = Links(site / "index.html").targets
    pages = [
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "baldwinlab" / "papers").glob("*/README.md"),
        *(ROOT / "notebooks").glob("*.*"),
    ]
    for page in pages:
        assert page.relative_to(ROOT).with_suffix(".html").as_posix().removesuffix(".html") in [
            target.removesuffix(".html").removesuffix(".py") for target in there
        ], page


def test_every_public_name_is_on_its_page(site: Path) -> None:
    python, own = words(site, "reference/python.html"), words(site, "reference/kinds.html")
    for name in baldwinlab.__all__:
        assert re.search(rf"^{name}¶$", python, re.MULTILINE), name
        said = (getattr(baldwinlab, name).__doc__ or "").split("\n")[0].replace("`", "")
        assert name == "__version__" or (said and said in python), name
    for name in parts.__all__:
        assert re.search(rf"^{name}¶$", own, re.MULTILINE), name


def test_every_command_is_on_its_page_with_its_options(site: Path) -> None:
    told = words(site, "reference/commands.html")
    for command in COMMANDS:
        assert re.search(rf"^baldwinlab {command}¶$", told, re.MULTILINE), command
    for option in (
        "--runs",
        "--set",
        "--executor",
        "--variant",
        "--part",
        "--force",
        "--quick",
        "--port",
    ):
        assert option in told, option


def test_every_field_is_on_its_page(site: Path) -> None:
    """As experiments have them, made of each part in turn."""
    foragers = words(site, "reference/fields.html")
    full = Experiment(world={"food": [{"x": [0, 1], "y": [0, 1]}]})
    for path in leaves(full.model_dump()):
        assert path in foragers, path
    library = words(site, "reference/parts.html")
    for field, kind, _ in choosing_fields(Experiment):
        for name in choices.packaged(kind):
            assert re.search(rf"^{name}¶$", library, re.MULTILINE), name
            for each in choices.find(kind, name).model_fields:
                assert f"{field.partition('.')[0]}.{choices.key_of(name)}.{each}" in library, (
                    name,
                    each,
                )
    models = words(site, "reference/models.html")
    for name in choices.packaged("model"):
        if name != "miniworld":
            own = validate({"name": "one", "model": name}).model_dump()[choices.key_of(name)]
            for path in leaves(own):
                assert f"{choices.key_of(name)}.{path}" in models, (name, path)


def leaves(tree: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """The dotted path of every value, with N for the number of a table in a list."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{path}{name}.")
        elif isinstance(value, tuple) and value and isinstance(value[0], Mapping):
            yield from leaves(value[0], f"{path}{name}.N.")
        else:
            yield f"{path}{name}"


def test_limits_defaults_and_meanings_are_those_of_the_fields(site: Path) -> None:
    told = words(site, "reference/fields.html").split("learning.rate\n")[1]
    assert told.split("\n")[:4] != [] and re.match(
        r"\s*number, ≥ 0, ≤ 10\s+0.01\s+learning rate, per step", told
    )


def test_every_recorded_variable_and_every_paper_s_presets_are_on_their_pages(site: Path) -> None:
    recorded = words(site, "reference/variables.html")
    for declared in (variables.RUN, variables.RECORD, variables.TRACE, *variables.ASSAYS.values()):
        for name, one in declared.items():
            assert name in recorded and one.meaning in recorded, name
    told = words(site, "reference/papers.html")
    for paper in papers.built_in().values():
        assert f"baldwinlab reproduce {paper.name}" in told and paper.about.citation in told
        for kind in ("conditions", "controls", "maps", "variants"):
            for name in paper.names(kind):
                assert name in told and paper.describe(kind, name).replace("`", "") in told, (
                    paper.name,
                    name,
                )


def test_examples_are_shown_in_full(site: Path) -> None:
    for path in (ROOT / "examples" / "parts").glob("*.py"):
        assert path.read_text("utf-8").strip() in words(site, f"examples/parts/{path.name}.html"), (
            path.name
        )


def test_a_word_is_found_and_the_hit_leads_to_it(site: Path, lonely: Page) -> None:
    lonely.goto((site / "index.html").as_uri())
    lonely.get_by_role("textbox", name="Search").fill("Baldwin")
    lonely.keyboard.press("Enter")
    hits = lonely.locator("ul.search li a")
    hits.first.click()
    expect(lonely.locator("article")).to_contain_text("Baldwin")


@pytest.mark.parametrize("page", ["docs/start.html", "baldwinlab/papers/le_2019/README.html"])
def test_a_laboratory_evolves_inside_its_page(site: Path, lonely: Page, page: str) -> None:
    lonely.goto((site / page).as_uri())
    lonely.locator(".laboratory iframe").scroll_into_view_if_needed()
    inside = lonely.frame_locator(".laboratory iframe")
    expect(inside.get_by_test_id("guide")).to_be_hidden()
    inside.get_by_test_id("pace").select_option("0")
    inside.get_by_test_id("setup-runs").fill("1")
    inside.get_by_test_id("start").click()
    expect(inside.get_by_text(re.compile(r"^([2-9]|\d\d+) of 100 generations$"))).to_be_visible()


@pytest.mark.parametrize(
    "page", ["index.html", "docs/start.html", "reference/fields.html", "reference/papers.html"]
)
def test_a_page_fits_a_phone(site: Path, lonely: Page, page: str) -> None:
    lonely.set_viewport_size({"width": 390, "height": 844})
    lonely.goto((site / page).as_uri())
    assert lonely.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_notebook_s_text_leads_to_what_its_cells_gave(site: Path, lonely: Page) -> None:
    lonely.goto((site / "notebooks" / "first-steps.html").as_uri())
    lonely.get_by_role("link", name="what its cells give").click()
    expect(lonely.locator("#gave")).to_have_text("42")


def test_a_folder_that_holds_anything_else_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(RefusedError, match="holds something else than the site"):
        documentation.build(tmp_path)
    assert (tmp_path / "mine.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "one.py",
            "# ---\n# jupyter: x\n# ---\n\n# %% [markdown]\n# # Title\n#\n# Words.\n\n# %%\nprint(1)\n",
        ),
        ("one.md", "# Title\n\nWords.\n\n```{code-cell} python\n:tags: [one]\n\nprint(1)\n```\n"),
    ],
)
def test_a_notebook_s_text_is_a_page(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    assert documentation.markdown_of(tmp_path / name).split() == [
        "#",
        "Title",
        "Words.",
        "```python",
        "print(1)",
        "```",
    ]


def test_papers_are_named_as_one_cites_them() -> None:
    assert reference.short(papers.load("nolfi-elman-parisi-1994")) == "Nolfi, Elman and Parisi 1994"
    assert reference.short(papers.load("le-2019")) == "Le 2019"
