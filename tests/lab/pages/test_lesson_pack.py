"""Tests of the teaching pack: its pages are complete, and have what the lessons name."""

from __future__ import annotations

import posixpath
import re
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.lab.pages import explorable
from baldwinlab.lab.pages.lesson_pack import LECTURER_TEXTS, LESSONS, find_texts, render_lesson_pack
from tests.axe import find_violations
from tests.commands import Command
from tests.lab.client import open_offline_page

TUTORIAL = find_texts().parent / "tutorials" / "lesson.md"
LESSON_TEXTS = [find_texts() / f"{name}.md" for name in LESSONS]
# A row of a worksheet that changes a number of the explorable, such as "| 1 | food 10 |".
DIAL_ROW = re.compile(r"^\| (?P<step>\d) \| (?P<name>[a-z ]+?) (?P<value>[\d.]+) \|", re.MULTILINE)
# A label that students press or read, in a list of steps.
LABEL = re.compile(r"(?<!\*)\*([^*]+)\*(?!\*)")


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the pack and return its folder."""
    folder = tmp_path_factory.mktemp("pack")
    for path, content in render_lesson_pack().items():
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).write_bytes(content)
    return folder


@pytest.fixture
def laboratory(offline_page: Page, pack: Path) -> Page:
    offline_page.goto((pack / "students/learners.html").as_uri())
    offline_page.get_by_test_id("start").wait_for()
    return offline_page


def list_labels(text: str) -> Iterator[str]:
    """Yield the labels that the steps of a lesson name."""
    for line in re.findall(r"^\d\. .*$", text, re.MULTILINE):
        yield from LABEL.findall(line)


def test_each_link_leads_to_a_page_and_a_heading_of_the_pack(pack: Path) -> None:
    n_links = 0
    for page in pack.rglob("*.html"):
        if page.name in ("baldwin.html", "learners.html"):
            continue
        for link in re.findall(r'href="([^"]+)"', page.read_text("utf-8")):
            if link != "data:,":
                target, _, anchor = link.partition("#")
                text = (page.parent / posixpath.normpath(target)).read_text("utf-8")
                assert not anchor or f'id="{anchor}"' in text, (page.name, link)
                n_links += 1
    assert n_links > 40


def test_students_get_no_answers(pack: Path) -> None:
    given = {path.stem for path in (pack / "students").iterdir()}
    assert not given & (set(LECTURER_TEXTS) - {"index"})
    assert {f"worksheet-{number}" for number in range(1, 5)} < given
    for path in (pack / "students").glob("*.html"):
        assert "../" not in "".join(re.findall(r'href="([^"]+)"', path.read_text("utf-8")))


def test_the_laboratory_has_each_preset_of_the_lessons(laboratory: Page) -> None:
    texts = [path.read_text("utf-8") for path in (*LESSON_TEXTS, TUTORIAL)]
    named = set(re.findall(r"`([\w+-]+/[AB])", "\n".join(texts)))
    assert "evo+motor-noise/B" in named
    options = laboratory.get_by_test_id("preset").locator("option").all_inner_texts()
    assert named <= set(options)


def test_lesson_2_can_be_done_in_the_laboratory(laboratory: Page) -> None:
    labels = set(list_labels(LESSON_TEXTS[1].read_text("utf-8")))
    assert labels == {"Start", "show each run", "Change and run again", "none"}
    laboratory.get_by_test_id("setup-runs").fill("2")
    laboratory.get_by_test_id("setup-seed").fill("0")
    laboratory.get_by_test_id("pace").select_option("0")
    laboratory.get_by_role("button", name="Start", exact=True).click()
    laboratory.get_by_label("show each run").check()
    laboratory.get_by_role("button", name="Change and run again").click()
    rule = laboratory.get_by_label("Learning rule", exact=True).first
    rule.select_option("none")
    laboratory.get_by_role("button", name="Start", exact=True).click()
    expect(laboratory.get_by_label("show each run")).to_be_visible()


def test_each_label_of_lesson_4_is_in_its_pages(laboratory: Page, pack: Path) -> None:
    labels = set(list_labels(LESSON_TEXTS[3].read_text("utf-8")))
    assert labels == {"Agents learn", "Run", "Copy a link to this map", "Start"}
    expect(laboratory.get_by_role("button", name="Start", exact=True)).to_be_visible()
    laboratory.goto((pack / "students/baldwin.html").as_uri())
    step = laboratory.locator("#yours")
    expect(step.get_by_label("Agents learn")).to_be_attached()
    for name in ("Run", "Copy a link to this map"):
        expect(step.get_by_role("button", name=name, exact=True)).to_be_attached()


def test_each_number_of_a_worksheet_can_be_set_in_its_step() -> None:
    strings = tomllib.loads(explorable.STRINGS_FILE.read_text("utf-8"))
    rows = [row for path in LESSON_TEXTS for row in DIAL_ROW.finditer(path.read_text("utf-8"))]
    assert len(rows) == 6
    names = {label.lower(): name for name, label in strings["dials"].items()}
    for row in rows:
        name = next(name for label, name in names.items() if label.startswith(row["name"]))
        dial = explorable.DIALS[name]
        steps = (float(row["value"]) - dial.minimum) / dial.step
        assert dial.minimum <= float(row["value"]) <= dial.maximum, row[0]
        assert steps == pytest.approx(round(steps)), row[0]
        assert f"{{{name}}}" in "".join(strings["steps"][int(row["step"]) - 1]["text"]), row[0]


@pytest.mark.parametrize("width", [320, 1280])
def test_pages_are_accessible_and_fit_the_window(browser: Browser, pack: Path, width: int) -> None:
    with open_offline_page(browser, 800) as (page, _):
        page.set_viewport_size({"width": width, "height": 800})
        for name in ("index", "answers", "students/index", "students/worksheet-2"):
            page.goto((pack / f"{name}.html").as_uri())
            assert page.evaluate("document.documentElement.scrollWidth") <= width, name
            assert not find_violations(page), name


def test_the_command_writes_the_pack_and_refuses_other_folders(
    command: Command, pack: Path, tmp_path: Path
) -> None:
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "text.txt").write_text("mine")
    refused = command("export", "--format", "lesson", "--out", "thesis")
    assert refused.code == 2 and "contains files that this command did not write" in refused.err
    assert [path.name for path in (tmp_path / "thesis").iterdir()] == ["text.txt"]
    shutil.copytree(pack, tmp_path / "lessons")
    first_page = tmp_path / "lessons" / "index.html"
    first_page.write_text("of an older version: baldwinlab export")
    written = command("export", "--format", "lesson")
    assert written.code == 0 and "lessons/students" in written.out
    assert first_page.read_bytes() == (pack / "index.html").read_bytes()
