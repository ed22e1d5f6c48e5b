"""Run the examples of the documentation, page by page, and compare their outputs with the page."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from baldwinlab.papers import built_in
from scripts import outputs
from scripts.outputs import read_blocks

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
ALL_PAGES = [
    *PAGES,
    *sorted(ROOT.glob("C*.md")),
    *sorted((ROOT / "notebooks").glob("*.md")),
    *sorted((ROOT / "benchmarks").glob("*.md")),
    *sorted((ROOT / "baldwinlab" / "papers").glob("*/README.md")),
]
HOW_TO_PAGES = sorted(DOCS.glob("how-to/*.md"))
# Each page takes more than 5 seconds.
SLOW_PAGES = {
    "docs/explanation/assays.md",
    "docs/explanation/atlas.md",
    "docs/explanation/controls.md",
    "docs/explanation/gallery.md",
    "docs/explanation/multiverse.md",
    "docs/explanation/species.md",
    "docs/explanation/what-guides.md",
    "docs/how-to/births-and-deaths.md",
    "docs/how-to/clusters.md",
    "docs/how-to/experiment-file.md",
    "docs/how-to/external-optimizers.md",
    "docs/how-to/fitness-by-behavior.md",
    "docs/how-to/genes.md",
    "docs/how-to/invasion.md",
    "docs/how-to/large-worlds.md",
    "docs/how-to/own-world.md",
    "docs/how-to/papers.md",
    "docs/how-to/predators-and-prey.md",
    "docs/how-to/reinforcement-learning.md",
    "docs/how-to/replay.md",
    "docs/how-to/rule-in-one-expression.md",
    "docs/how-to/sense-with-rays.md",
    "docs/reference/breeding.md",
    "docs/reference/built-in-parts.md",
    "docs/reference/learning-rules.md",
    "docs/reference/networks.md",
    "docs/reference/sweeps.md",
    "docs/reference/worlds.md",
    "docs/tutorials/first-study.md",
    "docs/tutorials/learning-rule.md",
    "docs/tutorials/paper.md",
}
# In lines, on a how-to page.
LONGEST_SNIPPET = 30


def has_examples(page: Path) -> bool:
    return any(block.is_run for block in read_blocks(page))


EXAMPLES = [
    pytest.param(
        page,
        id=page.relative_to(ROOT).as_posix(),
        marks=[pytest.mark.nightly] * (page.relative_to(ROOT).as_posix() in SLOW_PAGES),
    )
    for page in PAGES
    if has_examples(page)
]


@pytest.mark.parametrize("page", EXAMPLES)
def test_the_examples_of_a_page_run_in_their_order_and_show_their_outputs(
    page: Path, tmp_path: Path
) -> None:
    """`python -m scripts.outputs PAGE` writes the outputs of a page again."""
    text = page.read_text("utf-8")
    results = outputs.run_page(page, tmp_path)
    if page in outputs.PAGES:
        assert outputs.insert_outputs(text, results) == text
        for path, file in outputs.read_pictures(text):
            shown = np.asarray(Image.open(page.parent / path).convert("RGB"), dtype=float)
            drawn = np.asarray(outputs.draw_picture(tmp_path / file).convert("RGB"), dtype=float)
            # Other versions of the libraries draw letters differently.
            assert np.abs(shown - drawn).mean() < 2, path


@pytest.mark.parametrize("page", outputs.PAGES, ids=lambda page: page.stem)
def test_each_example_shows_its_output_or_why_it_is_not_run(page: Path) -> None:
    assert outputs.count_blocks(page)["without"] == 0


@pytest.mark.parametrize("page", outputs.PAGES, ids=lambda page: page.stem)
def test_a_sentence_follows_each_output(page: Path) -> None:
    text = page.read_text("utf-8")
    blocks = [match for match in outputs.BLOCK.finditer(text) if match["output"]]
    following = [text[match.end() :].lstrip() for match in blocks]
    # A sentence that only announces the next block says nothing about the output.
    others = ("```", "#", "|", "!", "The next block")
    assert [words[:60] for words in following if words.startswith(others)] == []


SCRIPTS = [
    pytest.param(block.code, id=f"{page.relative_to(ROOT).as_posix()}-{number}")
    for page in PAGES
    for number, block in enumerate(read_blocks(page))
    if block.language == "bash"
]


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_shell_script_is_valid_and_its_command_lines_are_accepted(script: str) -> None:
    from baldwinlab.cli.options import app

    syntax = subprocess.run(["bash", "-n"], input=script, capture_output=True, text=True)
    assert syntax.returncode == 0, syntax.stderr
    for line in re.sub(r"\\\n", " ", script).splitlines():
        match = re.search(r"(?:^|[\s/])baldwinlab (?!doctor)(.*)", line)
        if match and not line.lstrip().startswith("#"):
            # An object store needs an account.
            line = re.sub(r"\$\{?\w+\}?", "4", match[1]).replace("s3://", "memory://")
            app.parse_args(shlex.split(line), print_error=False, exit_on_error=False)


def test_dask_accepts_the_configuration_of_the_page_on_clusters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A job creates the folder of its logs.
    monkeypatch.chdir(tmp_path)
    slurm = pytest.importorskip("dask_jobqueue.slurm", reason="it needs the extra cluster")
    import dask
    import yaml

    blocks = read_blocks(DOCS / "how-to" / "clusters.md")
    (text,) = [block.code for block in blocks if block.file == "jobqueue.yaml"]
    settings = yaml.safe_load(text)["jobqueue"]["slurm"]
    assert settings.keys() <= dask.config.get("jobqueue.slurm").keys()
    with dask.config.set({f"jobqueue.slurm.{key}": value for key, value in settings.items()}):
        script = slurm.SLURMJob("tcp://127.0.0.1:8786", name="worker").job_script()
    for option in ("-p normal", "-A PROJECT", "-t 02:00:00", "--cpus-per-task=16", "--qos=normal"):
        assert f"#SBATCH {option}\n" in script


def test_a_snippet_of_a_how_to_page_is_short() -> None:
    long_snippets = [
        (page.name, block.code[:60])
        for page in HOW_TO_PAGES
        for block in read_blocks(page)
        if block.code.count("\n") > LONGEST_SNIPPET and not block.file.endswith((".sh", ".yaml"))
    ]
    assert long_snippets == []


def test_every_how_to_page_is_two_clicks_from_the_front_page() -> None:
    index = DOCS / "how-to" / "index.md"
    assert index in links(ROOT / "README.md")
    assert {*HOW_TO_PAGES} - links(index) == {index}


def links(page: Path) -> set[Path]:
    """Return the files that a page links to."""
    targets = re.findall(r"\]\((?!https?:)([^)#\s]+)", page.read_text("utf-8"))
    return {(page.parent / target).resolve() for target in targets}


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_of_a_page_lead_to_files(page: Path) -> None:
    assert {path for path in links(page) if not path.exists()} == set()


def test_the_terms_of_the_glossary_are_unique_and_in_alphabetical_order() -> None:
    text = (DOCS / "reference" / "glossary.md").read_text("utf-8")
    terms = [term.lower() for term in re.findall(r"^## (.+)$", text, re.MULTILINE)]
    assert len(terms) > 20
    assert terms == sorted(set(terms))


def read_row(page: Path, title: str) -> list[str]:
    """Return the cells of the first row with a title in a table of a page."""
    line = re.search(rf"^\| {title} \| (.+) \|$", page.read_text("utf-8"), re.MULTILINE)
    assert line
    return line[1].split(" | ")


def test_the_front_page_has_the_counts_of_the_gallery() -> None:
    gallery = DOCS / "explanation" / "gallery.md"
    front = (ROOT / "README.md").read_text("utf-8")
    measured, equal, not_measurable, _, _, *verdicts = read_row(gallery, "`fork-history`")
    assert (
        f"| {measured} | in {not_measurable} it is not measurable, and in {equal} all runs are "
        "equal | better in {}, worse in {}, equivalent in {}, undecided in {} |".format(*verdicts)
    ) in front
    measured, equal, not_measurable, _, impossible, *verdicts = read_row(gallery, "`assimilation`")
    assert (
        f"| {measured} | in {impossible} it is impossible by the design of the model, in "
        f"{not_measurable} it is not measurable, and in {equal} all runs are equal | further in "
        "{}, less far in {}, equivalent in {}, undecided in {} |".format(*verdicts)
    ) in front
    compared, repeated, share, _ = read_row(gallery, "all questions")
    assert f"{repeated} of the {compared} have the same verdict with both seeds ({share})" in front
    compared, repeated, _, opposite = read_row(gallery, "claims of the papers")
    assert (
        f"Of {compared} claims of the papers, {repeated} have the same verdict with both seeds, "
        f"and {opposite} have the opposite one." in front
    )


def test_the_front_page_counts_the_verdicts_on_the_pages_of_the_papers() -> None:
    front = (ROOT / "README.md").read_text("utf-8")
    verdicts: list[str] = []
    papers = set()
    for name, paper in built_in().items():
        page = (paper.folder / "README.md").read_text("utf-8")
        for claim in paper.claims:
            if claim.kind == "paper":
                row = re.search(rf"^\| {claim.id}: .* \| ([^|]+) \|$", page, re.MULTILINE)
                assert row, (name, claim.id)
                verdicts.append(row[1])
                papers.add(name)
    hold, fail, undecided = (
        sum(verdict.startswith(word) for verdict in verdicts)
        for word in ("holds", "does not hold", "undecided")
    )
    assert hold + fail + undecided == len(verdicts)
    assert (
        f"Of {len(verdicts)} claims of {len(papers)} papers, {hold} hold, {fail} do not hold and "
        f"{undecided} are undecided." in front
    )


# Everyday words with a special sense, and words of this project.
PROJECT_TERMS = (
    *("assay", "claim", "condition", "engine", "hook", "innate", "lane", "oracle", "part"),
    *("preset", "SIMD block", "variant", "verdict"),
)
TUTORIALS = [page for page in sorted(DOCS.glob("tutorials/*.md")) if page.name != "index.md"]


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_links_its_terms_to_the_glossary(page: Path) -> None:
    # The next steps at the end of a page name other pages.
    text = page.read_text("utf-8").partition("## Next steps")[0]
    prose = re.sub(r"```.*?```|^#.*?$|`[^`]*`", "", text, flags=re.DOTALL | re.MULTILINE)
    used = [term for term in PROJECT_TERMS if re.search(rf"\b{term}s?\b", prose)]
    linked = [f"glossary.md#{term.lower().replace(' ', '-')})" for term in used]
    assert used
    assert [link for link in linked if link not in text] == []


def test_every_page_is_two_clicks_from_the_front_page() -> None:
    """A page of the repository is a target of the README, or of a page that the README links."""
    first = links(ROOT / "README.md")
    second = {target for page in first if page.suffix == ".md" for target in links(page)}
    assert {page for page in ALL_PAGES if page.name != "README.md"} - first - second == set()


@pytest.mark.nightly
def test_the_optimizer_that_needs_jax_improves_on_the_founders(tmp_path: Path) -> None:
    """Its code continues the first block of its page."""
    pytest.importorskip("evosax", reason="it needs the extra bench")
    blocks = list(read_blocks(DOCS / "how-to" / "external-optimizers.md"))
    first = next(block.code for block in blocks if block.language == "python")
    jax = [block.code for block in blocks if block.language == "py"]
    code = "\n".join([first, *jax, "assert -state.best_fitness > results.fitness.max()"])
    python = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert python.returncode == 0, python.stderr
    assert re.fullmatch(r"evosax: \d+\.\d items", python.stdout.splitlines()[-1])


def test_every_example_of_a_part_is_linked_from_its_how_to_page() -> None:
    page = DOCS / "how-to" / "write-a-part.md"
    examples = set((ROOT / "examples" / "parts").glob("*.py"))
    assert examples - links(page) == set()
