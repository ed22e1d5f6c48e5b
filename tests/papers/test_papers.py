"""A paper is a folder: valid and invalid folders, and custom papers from folder to report."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import get_args

import pytest

from baldwinlab import papers
from baldwinlab.analysis.assays.criteria import load_criteria
from baldwinlab.analysis.statistics.fitness import MEASURES
from baldwinlab.api.reproduce import select_assays
from baldwinlab.core.names import list_names
from baldwinlab.papers import PaperError, check_paper, presets
from baldwinlab.papers.claims import COMMON_MEASURES, UNSEEN_MAPS_MEASURE
from baldwinlab.papers.paper import PRESET_KINDS, Inference
from baldwinlab.studies.assays.catalog import list_default_assays
from baldwinlab.studies.store import StudyStore
from tests.commands import Command

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

PAPER = """
name = "tiny"
title = "On being tiny"
authors = ["A. Reader", "B. Writer"]
year = 2026
citation = "A. Reader and B. Writer, On being tiny, 2026"
description = "two kinds of tiny life"
runs = 2
"""
PLAIN = 'description = "evolution alone"\n[learning]\nrule = "none"\n'
TAUGHT = 'description = "agents that teach themselves"\n[learning]\nrule = "self-taught"\n'
NEAR = (
    'description = "food at the start of the agents"\n'
    "[[world.food]]\nx = [120, 200]\ny = [120, 200]\ncount = 50\n"
)
STANDARD = 'description = "short lives"\n[lifetime]\nsteps = 60\n[evolution]\ngenerations = 2\n'
CLAIMS = """
[choices]
T1 = { field = "senses.visual_radius", text = "how far an agent sees" }
[[claims]]
id = "T1"
title = "The taught eat more"
claim = "The average agent that teaches itself eats more."
rule = "greater"
paper = "more"
choices = ["T1"]
comparisons = [{ a = "taught/near", b = "plain/near", measure = "mean" }]
[[claims]]
id = "T2"
title = "Agents eat"
claim = "Some agents eat at the end."
rule = "at_least"
paper = "nearly all"
comparisons = [
    { a = "taught/near", measure = "share", bound = 0.01 },
    { a = "taught/near", b = "first", measure = "best", rule = "greater" },
]
"""
FILES = {
    "paper.toml": PAPER,
    "conditions/plain.toml": PLAIN,
    "conditions/taught.toml": TAUGHT,
    "maps/near.toml": NEAR,
    "variants/standard.toml": STANDARD,
    "claims.toml": CLAIMS,
    "words.toml": 'heading = "Tiny, again"\n[captions]\nfitness = "The paper has it smaller."\n',
    "README.md": "Tiny.\n",
}


def write_paper(paper_folder: Path, *without: str, **changed: str) -> Path:
    """Write the folder of a paper without some files.

    `changed` is the content of files by their name without folder and suffix.
    """
    for name, text in FILES.items():
        path = paper_folder / name
        if not name.startswith(without):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(changed.get(path.stem, text))
    return paper_folder


def test_every_claim_of_a_built_in_paper_declares_its_kind() -> None:
    for name in papers.built_in():
        claims = papers.load(name).claims
        assert all("kind" in claim.model_fields_set for claim in claims), name
        # A statement of a paper has a source, and a question of this project has none.
        assert all(
            claim.paper not in ("", "not stated") for claim in claims if claim.kind == "paper"
        )


def test_the_front_page_states_the_source_of_each_paper_and_the_claims_with_a_number() -> None:
    page = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
    published = [paper for paper in papers.built_in().values() if paper.metadata.text_source]
    for source in ("full text", "abstract", "memory"):
        names = [paper.name for paper in published if paper.metadata.text_source == source]
        (row,) = re.findall(rf"^\| {source} \| (\d+) \| (.*) \|$", page, re.MULTILINE)
        assert (row[0], {*re.findall(r"`([^`]+)`", row[1])}) == (str(len(names)), {*names})
    claims = {
        paper.name: stated
        for paper in published
        if (stated := [claim for claim in paper.claims if claim.kind == "paper"])
    }
    numbers = {
        name: sum(claim.paper_value is not None for claim in of_paper)
        for name, of_paper in claims.items()
    }
    total = sum(map(len, claims.values()))
    assert f"Of {total} claims of {len(claims)} papers, " in page
    assert (
        f"{sum(numbers.values())} of the {total} claims, in {sum(map(bool, numbers.values()))} "
        "papers, have a published number"
    ) in page


def test_a_claim_without_a_kind_is_of_the_paper_if_the_paper_states_it(tmp_path: Path) -> None:
    text = CLAIMS.replace('paper = "nearly all"\n', "")
    claims = papers.load(write_paper(tmp_path, claims=text)).claims
    assert [claim.kind for claim in claims] == ["paper", "own"]


def test_the_default_paper_is_valid_and_complete() -> None:
    paper = check_paper(papers.load())
    assert list(papers.built_in()) == [
        papers.DEFAULT_PAPER,
        *sorted({*papers.built_in()} - {papers.DEFAULT_PAPER}),
    ]
    assert [claim.id for claim in paper.claims] == [f"C{number}" for number in range(1, 10)]
    assert paper.experiments("literal") == presets.paper("literal")
    assert "arXiv 1906.08854" in paper.metadata.citation
    assert (paper.folder / "README.md").exists()
    assert all(paper.names(kind) for kind in PRESET_KINDS)


def test_papers_can_name_all_measures_assays_and_criteria() -> None:
    assert set(COMMON_MEASURES) == {*MEASURES, "most", UNSEEN_MAPS_MEASURE}
    assert set(get_args(Inference.model_fields["question"].annotation)) == {
        criterion.id for criterion in load_criteria()
    }


def test_a_folder_is_a_paper_with_presets_in_the_order_of_the_paper(tmp_path: Path) -> None:
    paper_folder = write_paper(tmp_path / "tiny")
    assert papers.load(paper_folder).study_names() == ["plain/near", "taught/near"]
    experiment = presets.load(f"{paper_folder}:taught/near")
    assert (experiment.name, experiment.lifetime.steps) == ("taught/near", 60)
    assert experiment.learning.rule == "self-taught"
    assert presets.load("le-2019:evo/A") == presets.load("evo/A")
    paper = papers.load(write_paper(tmp_path, paper=PAPER + 'conditions = ["taught", "plain"]\n'))
    assert paper.study_names() == ["taught/near", "plain/near"]


def test_a_paper_can_have_no_maps_and_no_claims(
    tmp_path: Path,
) -> None:
    paper = papers.load(write_paper(tmp_path, "maps", "claims", "words", "README", "variants"))
    assert [experiment.name for experiment in paper.experiments()] == ["plain", "taught"]
    assert paper.claims == ()
    assert not paper.texts.heading


GREATER, SAME = 'rule = "greater"\npaper', 'a = "taught/near", b = "plain/near"'
NO_TRUTH_VALUE = "true and false are not allowed here"
NO_FIELD = "there is no such field"
# By file: a text of it or "" for its end, the new text, and the message without the file.
INVALID = {
    "paper.toml": [
        ("year = 2026\n", "", "year: is missing"),
        ("", "pages = 8\n", "pages: there is no such field; there are: name, "),
        ("", 'maps = ["nera"]\n', "maps 'nera', which does not exist (did you mean 'near'?)"),
        ("", 'emergence = "taught"\n', "emergence 'taught', which does not exist"),
        ('"tiny"', '"le-2019"', "name 'le-2019' is that of a paper of baldwinlab"),
        ('"tiny"', '"a tiny paper"', "name = 'a tiny paper': must be letters, digits, _ . and -,"),
        ('"tiny"', '"con"', "name: 'con' cannot be the name of a paper: Windows reserves 'con'"),
        ("", 'conditions = ["plain", "plain"]\n', "conditions: 'plain' is listed twice; list each"),
        ("2026\ncitation", "true\ncitation", f"year: {NO_TRUTH_VALUE}"),
        ("runs = 2", "runs = true", f"runs: {NO_TRUTH_VALUE}"),
        ("runs = 2", f"runs = {10**20}", f"runs = {10**20}: input should be less than or equal to"),
        (
            "2026\ncitation",
            "20260\ncitation",
            "year = 20260: input should be less than or equal to",
        ),
        ("", 'link = "javascript:alert(1)"\n', "link: 'javascript:alert(1)' must be an address"),
    ],
    "conditions/plain.toml": [(PLAIN, "[learning]\n", "description is missing")],
    "maps/near.toml": [(NEAR, 'name = "far"\n' + NEAR, "name: a preset has no such key")],
    "claims.toml": [
        ("taught/near", "taugt/near", "T1 names a condition 'taugt/near', which does not exist"),
        ('"mean"', '"weight"', "T1: a measure of plain/near 'weight', which does not exist"),
        (GREATER, 'rule = "wins"\npaper', "claims.0.rule: 'wins' is not a rule; allowed are great"),
        (GREATER, "paper", "claims.0.comparisons.0.rule: is missing"),
        (", bound = 0.01", "", "claims.1.comparisons.0: the rule 'at_least' needs a bound"),
        (
            *('rule = "at_least"', 'rule = "within"'),
            "claims.1.comparisons.0: the rule 'within' needs a bound of two numbers, the lower "
            "first, and no b",
        ),
        (
            *("bound = 0.01", 'rule = "mean_within", bound = [0.9, 0.1]'),
            "claims.1.comparisons.0: the rule 'mean_within' needs a bound of two numbers",
        ),
        (
            *("bound = 0.01", "paired = true, bound = 0.01"),
            "claims.1.comparisons.0: paired runs need a and b",
        ),
        (
            *(GREATER, 'rule = "survives_longer"\npaper'),
            "claims.0.comparisons.0: the rule 'survives_longer' needs a and b, a measure of the "
            "model, and runs that are not paired",
        ),
        ('["T1"]', '["T9"]', "claims.0.choices: there is no choice 'T9'; there are T1"),
        ('"senses.v', '"sense.v', "T1, choice T1: sense.visual_radius: there is no 'sense'"),
        ('"T2"', '"T1"', "two claims have the id 'T1'"),
        (CLAIMS, "claims = 3\n", "claims = 3: input should be a list"),
        *(
            ("bound = 0.01", f"bound = {bound}", f"claims.1.comparisons.0.bound: {NO_TRUTH_VALUE}")
            for bound in ("true", "[0.1, true]")
        ),
        (
            *('measure = "mean" }', 'measure = "mean", bound = 3.0 }'),
            "claims.0.comparisons.0: the rule 'greater' uses no bound; leave bound out, or take "
            "one of close",
        ),
        (
            *('b = "plain/near"', 'b = "taught/near"'),
            "claims.0.comparisons.0: a and b are the same condition, 'taught/near'",
        ),
        (
            *(SAME, 'a = "first", b = "plain/near"'),
            "claims.0.comparisons.0.a: 'first' is allowed for b only; a must name a condition",
        ),
        (
            *(SAME, 'a = "", b = "plain/near"'),
            "claims.0.comparisons.0.a = '': string should have at least 1 character",
        ),
    ],
}


def require_refusal(paper_folder: Path, message: str) -> None:
    """Require an error of one sentence."""
    with pytest.raises(PaperError, match=re.escape(message.format(paper_folder))) as refusal:
        papers.load(paper_folder)
    assert len(str(refusal.value).splitlines()) == 1


def write_changed_paper(paper_folder: Path, file: str, old: str, new: str) -> Path:
    text = FILES[file]
    assert old in text
    changed = text.replace(old, new) if old else text + new
    return write_paper(paper_folder, **{Path(file).stem: changed})


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [(file, *change) for file, changes in INVALID.items() for change in changes],
)
def test_an_invalid_paper_is_refused_in_one_sentence(
    tmp_path: Path, file: str, old: str, new: str, message: str
) -> None:
    folder = write_changed_paper(tmp_path / "tiny", file, old, new)
    require_refusal(folder, f"{{}}/{file}: {message}")


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("paper.toml", PAPER, "name = ", "{}/paper.toml is not TOML: Invalid value (at end of"),
        (
            *("conditions/plain.toml", "", "speed = 3\n"),
            "{}: conditions/plain.toml with maps/near.toml with variants/standard.toml: "
            f"learning.speed: {NO_FIELD}",
        ),
        (
            *("variants/standard.toml", "", "rate = 3\n"),
            f"with variants/standard.toml: evolution.rate: {NO_FIELD}",
        ),
    ],
)
def test_an_invalid_file_of_several_is_named(
    tmp_path: Path, file: str, old: str, new: str, message: str
) -> None:
    require_refusal(write_changed_paper(tmp_path / "tiny", file, old, new), message)


@pytest.mark.parametrize(
    ("without", "message"),
    [
        ("paper", "there is no {}/paper.toml"),
        ("conditions", "{}/conditions contains no condition: a TOML file with changes of the"),
    ],
)
def test_an_incomplete_paper_is_refused_in_one_sentence(
    tmp_path: Path, without: str, message: str
) -> None:
    require_refusal(write_paper(tmp_path / "tiny", without), message)


def test_reserved_names_of_controls_and_conditions_are_refused(tmp_path: Path) -> None:
    """A control has another name than each condition, and claims use the name "first"."""
    paper_folder = write_paper(tmp_path / "tiny", "maps", "claims")
    (paper_folder / "controls").mkdir()
    for path, message in (
        (
            "controls/plain.toml",
            "{}/controls/plain.toml: 'plain' is also the name of a condition; "
            "choose another name for the control",
        ),
        (
            "conditions/first.toml",
            "no condition can be named 'first', because claims use this name for the first "
            "generations",
        ),
    ):
        (paper_folder / path).write_text(TAUGHT)
        require_refusal(paper_folder, message)
        (paper_folder / path).unlink()


def test_a_link_can_have_the_scheme_http_or_https(tmp_path: Path) -> None:
    for link in ("http://example.org/a", "https://example.org/?q=1", "HTTPS://EXAMPLE.ORG"):
        paper = papers.load(write_paper(tmp_path, paper=f'{PAPER}link = "{link}"\n'))
        assert paper.metadata.link == link


def test_claims_about_survival_need_a_measure_with_censored_runs(tmp_path: Path) -> None:
    shutil.copytree(papers.load("ackley-littman-1991").folder, tmp_path / "mine")
    for name, old, new in (
        ("paper", '"ackley-littman-1991"', '"mine"'),
        ("claims", 'b = "E", measure = "survived"', 'b = "E", measure = "born"'),
    ):
        file = tmp_path / "mine" / f"{name}.toml"
        file.write_text(file.read_text().replace(old, new))
    message = "A1: the rule 'survives_longer' needs a measure with censored runs, and 'born' of E"
    require_refusal(tmp_path / "mine", f"{message} has none")


def test_an_unknown_paper_is_refused_with_the_most_similar_names(
    command: Command, tmp_path: Path
) -> None:
    result = command("reproduce", "le-2091")
    message = (
        "there is no paper 'le-2091' (did you mean 'le-2019'?); "
        f"{list_names('le-2091', papers.built_in())}, and any folder with a paper.toml"
    )
    assert (result.code, result.err) == (2, f"baldwinlab: {message}\n")
    result = command("reproduce", str(write_paper(tmp_path / "tiny")), "--variant", "literal")
    assert (result.code, result.err) == (
        2,
        "baldwinlab: there is no variant 'literal'; there are standard\n",
    )
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("changed", "place"),
    [
        ({"paper": PAPER + 'figures = ["pie"]\n'}, "tiny/paper.toml: figures"),
        ({"words": "[captions]\npie = 'x'\n"}, "tiny/words.toml: captions"),
    ],
)
def test_an_unknown_figure_is_refused_before_the_simulation(
    command: Command, tmp_path: Path, changed: dict[str, str], place: str
) -> None:
    folder = write_paper(tmp_path / "tiny", **changed)
    result = command("reproduce", str(folder), "--out", "mine")
    assert result.code == 2
    assert f"{place} 'pie', which does not exist" in result.err
    assert "there are clocks, emergence, " in result.err and result.out == ""
    assert not Path("mine").exists()


def test_list_papers_describes_each_paper(command: Command) -> None:
    result = command("list", "papers")
    assert result.code == 0
    assert re.search(r"^le-2019 +Nam Le, Evolving Self-taught", result.out, re.MULTILINE)
    assert "conditions: 6, claims: 9 (full text), https://" in result.out
    assert "claims: 80\n" in result.out
    assert "1987, guessing, guessing-100, guessing-10000, all-set, never-guessing\n" in result.out
    assert "command: baldwinlab reproduce hinton-nowlan-1987\n" in result.out
    assert re.search(r"2026, evo/A, .* and 74 more\n", result.out)


def test_the_report_of_custom_questions_does_not_name_a_paper(
    command: Command, tmp_path: Path
) -> None:
    claims = CLAIMS[CLAIMS.index("[[claims]]") : CLAIMS.index('[[claims]]\nid = "T2"')]
    questions = claims.replace('paper = "more"\nchoices = ["T1"]\n', "")
    write_paper(
        tmp_path / "tiny",
        paper=PAPER + 'figures = ["final-fitness"]\nassays = []\n',
        claims=questions,
    )
    result = command("reproduce", "./tiny")
    assert result.code == 0, result.err
    assert "Claims and our results" in result.out
    assert "the paper" not in result.out
    page = (tmp_path / "results/tiny/report.html").read_text()
    assert 'id="figure-final-fitness"' in page.split('<h2 id="setup"')[0]
    assert 'id="differences"' not in page
    assert ">Paper</th>" not in page


def test_a_custom_paper_is_reproduced_and_its_report_does_not_need_its_folder(
    command: Command,
    tmp_path: Path,
) -> None:
    paper_folder = write_paper(tmp_path / "tiny", paper=PAPER + 'assays = ["innate"]\n')
    result = command("reproduce", "./tiny")
    assert result.code == 0, result.err
    out = tmp_path / "results/tiny"
    assert StudyStore(out).paper == "tiny"
    assert StudyStore(out).runs("taught/near") == [0, 1]
    record = json.loads((out / "claims.json").read_text())["claims"][1]
    assert (record["id"], record["publication"]) == ("T2", "tiny")
    page = (out / "report.html").read_text()
    for text in (
        "<h1>Tiny, again</h1>",
        "A. Reader, B. Writer, <cite>On being tiny</cite>",
        "smaller.",
        "how far an agent sees",
    ):
        assert text in page
    assert "Nam Le" not in page
    assert "The paper infers" not in page
    assert (out / "paper/claims.toml").read_text() == CLAIMS
    for path in sorted(paper_folder.rglob("*"), reverse=True):
        path.unlink() if path.is_file() else path.rmdir()
    assert command("report", "results/tiny").code == 0
    assert (out / "report.html").read_text() == page


@pytest.mark.parametrize(
    "name",
    [
        # Its eighty conditions take ten seconds.
        pytest.param(name, marks=[pytest.mark.nightly] * (name == "worlds-and-minds"))
        for name in papers.built_in()
    ],
)
def test_excessive_requests_for_a_paper_are_refused_before_the_simulation(
    command: Command, tmp_path: Path, name: str
) -> None:
    result = command("reproduce", name, "--runs", "1000000")
    assert result.code != 0
    assert "runs: " in result.err
    assert "--force" in result.err
    assert "Traceback" not in result.err
    assert not list(tmp_path.iterdir())


# The test draws a report, as the previous test does.
@pytest.mark.nightly
def test_without_claims_the_report_compares_the_conditions(
    command: Command, tmp_path: Path
) -> None:
    write_paper(
        tmp_path / "tiny",
        "maps",
        "claims",
        "words",
        paper=PAPER + 'figures = ["final-fitness", "fitness"]\n',
    )
    result = command("reproduce", "tiny", "--runs", "1", "--out", "mine")
    assert result.code == 0, result.err
    page = (tmp_path / "mine/report.html").read_text()
    assert "<h1>On being tiny: a reproduction</h1>" in page
    assert "<h2>The claims" not in page
    assert "Comparison of the conditions" in page
    assert page.index("Fitness in the last") < page.index("Fitness over generations")
    assert "What an agent senses" not in page
    assert json.loads((tmp_path / "mine/claims.json").read_text())["claims"] == []


def test_reproduce_measures_the_assays_of_a_paper_or_the_default_assays(
    command: Command, tmp_path: Path
) -> None:
    assert select_assays(papers.load(write_paper(tmp_path / "all"))) == list_default_assays()
    write_paper(tmp_path / "tiny", paper=PAPER + 'assays = ["innate", "taste"]\n')
    result = command("reproduce", "./tiny")
    assert result.code == 2
    assert "tiny/paper.toml: assays: there is no assay 'taste'; there are descent," in result.err
    assert not (tmp_path / "results").exists()


def test_a_study_belongs_to_the_paper_that_created_it(command: Command, tmp_path: Path) -> None:
    one_assay = PAPER + 'assays = ["innate"]\n'
    write_paper(tmp_path / "tiny", "claims", paper=one_assay)
    write_paper(tmp_path / "other", "claims", paper=one_assay.replace("tiny", "other"))
    assert command("reproduce", "tiny", "--runs", "1", "--out", "mine").code == 0
    result = command("reproduce", "other", "--runs", "1", "--out", "mine")
    assert result.err == (
        "baldwinlab: mine holds another study: it is of the paper tiny, not other; "
        "choose another --out\n"
    )
    for path in (tmp_path / "mine/paper").rglob("*.toml"):
        path.unlink()
    result = command("report", "mine")
    assert (result.code, result.err) == (
        2,
        "baldwinlab: mine is a study of the paper 'tiny', "
        "but mine/paper contains no copy of this paper\n",
    )


def test_claims_about_long_controls_are_evaluated_on_a_separate_study(
    command: Command, tmp_path: Path
) -> None:
    paper = papers.load("stanley-miikkulainen-2002")
    both = [f"{paper.name}:{control}" for control in ("poles", "poles-without-velocities")]
    settings = ("population.size=20", "evolution.generations=2")
    short_run = ("--set", *settings, "--runs", "2", "--out", "poles")
    assert command("run", *both, *short_run).code == 0
    claims = str(paper.folder / "claims-of-poles.toml")
    result = command("report", "poles", "--claims", claims, "--out", "verdicts.json")
    assert result.code == 0
    verdicts = json.loads((tmp_path / "verdicts.json").read_text())
    # No run has solved the task.
    expected = dict.fromkeys(("P1", "P2"), "undecided")
    assert {claim["id"]: claim["verdict"] for claim in verdicts} == expected
