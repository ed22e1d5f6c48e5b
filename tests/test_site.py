"""Test that `make docs` describes all public names, and that the site works without a network."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

import baldwinlab
from baldwinlab import parts
from baldwinlab.cli import COMMANDS
from baldwinlab.core import variables
from baldwinlab.experiment import Experiment, registry
from scripts.site_extension import list_fields
from tests.lab.client import open_offline_page

ROOT = Path(__file__).parent.parent
REFERENCE = "docs/reference"
# Sphinx needs minutes for the site.
pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site, without the executed notebooks. A warning, for example a dead link, fails."""
    out = tmp_path_factory.mktemp("site")
    doctrees = tmp_path_factory.mktemp("doctrees")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", str(doctrees)]
    done = subprocess.run([*command, "-c", "docs", ".", str(out)], cwd=ROOT, text=True)
    assert done.returncode == 0, "Sphinx reported a warning, see above"
    return out


@pytest.fixture
def offline_page(browser: Browser) -> Iterator[Page]:
    """A browser page without a network; the test fails if the page requests any other host."""
    with open_offline_page(browser, 900) as (page, requests):
        yield page
    assert requests
    assert not [url for url in requests if not url.startswith(("data:", "blob:", "file:"))]


def read_page(site: Path, page: str) -> str:
    return (site / f"{page}.html").read_text("utf-8")


def text_of(site: Path, page: str) -> str:
    """Return the text of a page without its tags."""
    return unescape(re.sub(r"<[^>]+>", "", read_page(site, page)))


def test_every_page_is_in_the_navigation(site: Path) -> None:
    targets = set(re.findall(r'href="([^"#]+\.html)"', read_page(site, "README")))
    pages = [
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "baldwinlab" / "papers").glob("*/README.md"),
        *(ROOT / "notebooks").glob("*.md"),
    ]
    names = {page.relative_to(ROOT).with_suffix(".html").as_posix() for page in pages}
    assert names - targets == set()


def test_every_public_name_is_described(site: Path) -> None:
    python = read_page(site, f"{REFERENCE}/python")
    names = set(baldwinlab.__all__) - {"__version__"}
    assert [name for name in names if f'id="baldwinlab.{name}"' not in python] == []
    assert 'id="baldwinlab.Study.data"' in python
    kinds = read_page(site, f"{REFERENCE}/parts")
    names = {name for name in parts.__all__ if f'id="baldwinlab.parts.{name}"' not in kinds}
    # Constants are in a table.
    assert [name for name in names if f'<span class="pre">{name}' not in kinds] == []


def test_every_command_and_option_is_described(site: Path) -> None:
    text = text_of(site, f"{REFERENCE}/commands")
    assert [name for name in COMMANDS if not re.search(rf"\b{name}¶", text)] == []
    assert [name for name in ("--runs", "--set", "--part", "--quick") if name not in text] == []


def test_every_setting_part_and_variable_is_described(site: Path) -> None:
    settings = text_of(site, f"{REFERENCE}/settings")
    assert [path for path, _ in list_fields(Experiment) if path not in settings] == []
    pages = ("senses-and-bodies", "networks", "learning-rules", "worlds", "breeding", "models")
    text = "".join(text_of(site, f"{REFERENCE}/{page}") for page in pages)
    named = [(kind, name) for kind in registry.BUILT_IN for name in registry.package_parts(kind)]
    for kind, name in set(named) - {("model", "miniworld")}:
        assert name in text, name
        for field in registry.find_class(kind, name).model_fields:
            assert f"{registry.table_name(name)}.{field}" in text, (name, field)
    recorded = text_of(site, f"{REFERENCE}/variables")
    assert [name for name in variables.RECORD_VARIABLES if name not in recorded] == []


def test_the_search_leads_to_a_page_with_the_word(site: Path, offline_page: Page) -> None:
    offline_page.goto((site / "README.html").as_uri())
    offline_page.get_by_role("textbox", name="Search").fill("Baldwin")
    offline_page.keyboard.press("Enter")
    offline_page.locator("ul.search li a").first.click()
    expect(offline_page.locator("article")).to_contain_text("Baldwin")


def test_a_laboratory_evolves_inside_its_page(site: Path, offline_page: Page) -> None:
    offline_page.goto((site / "docs/tutorials/first-study.html").as_uri())
    offline_page.locator(".laboratory iframe").scroll_into_view_if_needed()
    frame = offline_page.frame_locator(".laboratory iframe")
    frame.get_by_test_id("pace").select_option("0")
    frame.get_by_test_id("setup-runs").fill("1")
    frame.get_by_test_id("start").click()
    expect(frame.get_by_text(re.compile(r"^([2-9]|\d\d+) of 100 generations$"))).to_be_visible()
