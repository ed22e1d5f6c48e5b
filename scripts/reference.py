"""Generate the reference pages of the documentation from the code that they describe."""

from __future__ import annotations

import ast
import json
import re
import textwrap
from pathlib import Path
from typing import Any, Final, get_args

import baldwinlab
from baldwinlab import papers
from baldwinlab.cli.options import app
from baldwinlab.core import variables
from baldwinlab.core.assay_variables import ASSAY_VARIABLES
from baldwinlab.experiment import Experiment, registry
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.papers.claims import COMMON_MEASURES, RULES
from baldwinlab.papers.paper import CARD_FILE, PRESET_KINDS, Paper
from baldwinlab.papers.texts import Assay, Figure
from scripts import part_reference
from scripts.described import (
    capitalized,
    fields_of,
    format_name,
    prose,
    table,
    table_of_fields,
    table_of_variables,
)

ROOT: Final = Path(__file__).parents[1]


def pages() -> dict[str, str]:
    """Return the Markdown of every generated page, by its path on the site."""
    examples = sorted((ROOT / "examples").rglob("*.py"))
    return {
        "docs/reference/commands.md": commands(),
        "docs/reference/settings.md": settings(),
        "docs/reference/python.md": python(),
        "docs/reference/variables.md": recorded_variables(),
        "docs/reference/models.md": models(),
        "docs/reference/claims.md": claims(),
        "docs/reference/papers.md": list_of_papers(),
        "docs/reference/citation.md": citation(),
        **part_reference.pages(),
        **{f"{path.relative_to(ROOT).as_posix()}.md": example(path) for path in examples},
    }


def commands() -> str:
    """Return the page of the commands and their options."""
    text = str(app.generate_docs(output_format="markdown", recursive=True))
    # The navigation of the site shows the same table of contents.
    text = re.sub(r"^## Table of Contents\n\n(- .*\n)+\n", "", text, flags=re.MULTILINE)
    return text.replace("# baldwinlab\n", "# Commands\n", 1)


def python() -> str:
    """Return the page of the public names of the package."""
    names = sorted(baldwinlab.__all__, key=_sort_key)
    return """# Python

Every public name of `import baldwinlab as bl`, in alphabetical order.
[Use baldwinlab from Python](../how-to/python.md) shows examples.

""" + "\n".join(format_name(name, getattr(baldwinlab, name)) for name in names)


def settings() -> str:
    """Return the page of the settings of an experiment with foragers."""
    text = """# Settings

Every setting of an experiment with foragers, by its dotted path.
`--set PATH=VALUE` changes a setting, and `baldwinlab show EXPERIMENT` prints all of them.

- N is the number of a region, from 0.
- A part can have settings of its own, in a table of its name.
  The page of each kind lists them: [learning rules](learning-rules.md), [senses and bodies](senses-and-bodies.md),
  [networks](networks.md), [world features](worlds.md), [reproduction](breeding.md).
- Experiments of other [models](models.md) have the tables `population`, `evolution` and `record` of this page,
  and one table of the model.
"""
    tables: dict[str, list[tuple[str, object]]] = {}
    for path, node in fields_of(Experiment):
        title = path.partition(".")[0] if "." in path else "The experiment"
        tables.setdefault(title, []).append((path, node))
    return text + "".join(
        f"\n## {title}\n\n{table_of_fields(rows)}" for title, rows in tables.items()
    )


def insert_tables(text: str) -> str:
    """Return the text of a page with the lists of parts that it requests.

    A fenced block `{parts}` contains the name of a kind of part, for example "learning rule".
    """
    return re.sub(
        r"^```\{parts\}\n(.+)\n```$",
        lambda block: parts_of_kind(block[1]),
        text,
        flags=re.MULTILINE,
    )


def parts_of_kind(kind: str) -> str:
    """Return the built-in parts of a kind as Markdown: a table, and the settings of each part."""
    paths = {kind: path for path, kind, _ in choosing_fields(Experiment)}
    parts = {name: registry.find_class(kind, name) for name in registry.package_parts(kind)}
    rows = [(f"`{name}`", *_effect_and_source(part)) for name, part in sorted(parts.items())]
    text = f"Setting: `{paths[kind]}`.\n\n{table((kind, 'effect', 'source'), rows)}"
    fields = [
        field
        for name, part in sorted(parts.items())
        for field in fields_of(
            part, f"{paths[kind].rpartition('.')[0]}.{registry.table_name(name)}"
        )
    ]
    return f"{text}\nSettings of these parts:\n\n{table_of_fields(fields)}" if fields else text


def _effect_and_source(part: Any) -> tuple[str, str]:
    """Return the first paragraphs of a docstring, and the source that it names."""
    text = prose(part.__doc__)
    body, _, references = text.partition("**References**")
    effect, _, source = body.partition("Source: ")
    return (
        " ".join(effect.split()),
        " ".join((source or references).split()).rstrip(".") or "baldwinlab",
    )


def models() -> str:
    """Return the page of the models other than the foragers."""
    text = """# Models

A model defines what a lifetime is.
The setting `model` chooses it; the default is `miniworld`, the foragers that the page [Settings](settings.md) describes.
The [papers](papers.md) have presets of all models.
"""
    for name in registry.package_parts("model"):
        if name != "miniworld":
            text += _model(name)
    return text


def _model(name: str) -> str:
    model = registry.find_class("model", name)
    text = f"\n## {name}\n\n{prose(model.__doc__)}\n\n"
    text += table_of_fields(fields_of(model, registry.table_name(name)))
    defaults = [
        f"`{section}.{field} = {json.dumps(value)}`"
        for section, fields in model.defaults.items()
        for field, value in fields.items()
    ]
    text += f"\nDefaults of shared settings: {', '.join(defaults)}.\n" if defaults else ""
    measures = {name: measure.meaning for name, measure in model().all_measures().items()}
    shares = {name: share.meaning for name, share in model.shares.items()}
    views = {name: view.description for name, view in model.views.items()}
    lists = {
        "Measures of a run, for claims": measures,
        "Shares of the population, drawn by generation": shares,
        "Views of a generation in the lab": views,
    }
    for title, entries in lists.items():
        lines = "".join(f"- `{key}`: {meaning}\n" for key, meaning in entries.items())
        text += f"\n{title}:\n\n{lines}" if lines else ""
    if model.records:
        text += f"\nRecorded in addition to fitness ({model.payoff}):\n\n"
        text += table_of_variables(model.records)
    return text


def recorded_variables() -> str:
    """Return the page of the variables of runs, traces and assays."""
    text = f"""# Recorded variables

The variables of the datasets that baldwinlab returns and stores.
[File formats](file-formats.md) describes the files.
The page [Models](models.md) lists the variables that a model records in addition.

Order of the weights: {variables.WEIGHT_ORDER}.

## Run

`bl.simulate` returns these variables.

{table_of_variables(variables.RUN_VARIABLES)}
## Record

A record is a run in a file. It contains only the genomes that are stored.

{table_of_variables(variables.RECORD_VARIABLES)}
## Trace

`bl.replay` returns these variables.

{table_of_variables(variables.TRACE_VARIABLES)}
If agents can die, a trace has `alive`. With [species](../explanation/species.md), it has `species`,
`NAME_eaten` for each species that others eat, and the names in the attribute `species_names`.

{table_of_variables({"alive": variables.ALIVE_IN_STEP, "species": variables.SPECIES_IN_TRACE})}"""
    for assay, measured in ASSAY_VARIABLES.items():
        text += f"""
## Assay {assay}

`bl.open_assay` returns these variables. [Assays](../explanation/assays.md) explains them.

{table_of_variables(measured)}"""
    return text


def claims() -> str:
    """Return the page of the rules, measures, figures and assays that a paper can name."""
    rules = table(
        ("rule", "verdict"),
        [(f"`{rule}`", text.replace("{bound}", "`bound`")) for rule, text in RULES.items()],
    )
    return f"""# Claims, figures and assays

The names that the files `claims.toml` and `paper.toml` of a paper can use.
[Papers](../how-to/papers.md) shows how to write a paper.

## Rules

A rule decides the verdict of a claim.

{rules}
## Measures

Every model has the measures {_code_list(COMMON_MEASURES)}.
A model can have [further measures](models.md).

## Figures

{_code_list(get_args(Figure))}.

## Assays

{_code_list(get_args(Assay))}. See [assays](../explanation/assays.md).
"""


def list_of_papers() -> str:
    """Return the page of the papers with their claims, presets and variants."""
    text = """# Claims, presets and variants

The built-in papers, by year, with their claims, presets and variants.
"""
    return text + "\n".join(_paper(paper) for paper in papers_by_year())


def papers_by_year() -> list[Paper]:
    """Return the built-in papers in the order of their years."""
    return sorted(papers.built_in().values(), key=lambda paper: (paper.metadata.year, paper.name))


def short_citation(paper: Paper) -> str:
    """Return the authors and the year of a paper, for example "Nolfi and Parisi 1993"."""
    *first, last = (author.split()[-1] for author in paper.metadata.authors)
    conjunction = " and " if first else ""
    return f"{', '.join(first)}{conjunction}{last} {paper.metadata.year}"


def _paper(paper: Paper) -> str:
    page = Path("../..") / (paper.folder / "README.md").relative_to(ROOT)
    card = (
        f"![]({(page.parent / CARD_FILE).as_posix()})"
        if (paper.folder / CARD_FILE).exists()
        else ""
    )
    text = f"""
## {paper.metadata.title}

{card}

{capitalized(paper.metadata.description)}. [Results]({page.as_posix()}).

    baldwinlab reproduce {paper.name}

Source: {paper.metadata.citation}

"""
    if paper.claims:
        rows = [(claim.id, f"{claim.title}: {claim.text}") for claim in paper.claims]
        text += table(("claim", "text"), rows)
    for kind in PRESET_KINDS:
        rows = [(f"`{name}`", paper.describe(kind, name)) for name in paper.names(kind)]
        text += "\n" + table((kind.removesuffix("s"), "description"), rows) if rows else ""
    return text


def citation() -> str:
    """Return the page of the citations, from CITATION.cff and the papers."""
    source = (ROOT / "CITATION.cff").read_text("utf-8")
    fields = dict(re.findall(r'^(\w+): "?(.*?)"?$', source, re.MULTILINE))
    authors = ", ".join(re.findall(r'^  - name: "(.*)"$', source, re.MULTILINE))
    cited = [paper for paper in papers_by_year() if paper.metadata.authors != ("baldwinlab",)]
    entries = "\n".join(f"- {paper.metadata.citation}" for paper in cited)
    return f"""# How to cite

{fields["message"]}

> {authors}: *{fields["title"]}*, version {fields["version"]}.

The same as `CITATION.cff`, for programs:

```yaml
{source}```

## Papers

{entries}
"""


def example(path: Path) -> str:
    """Return the page of an example: its docstring, then its source."""
    source = path.read_text("utf-8")
    title, _, more = (ast.get_docstring(ast.parse(source)) or "").partition("\n")
    paragraphs = [
        re.sub("  +", " ", textwrap.dedent(paragraph))
        for paragraph in more.strip("\n").split("\n\n")
    ]
    body = "\n\n".join(
        f"```console\n{paragraph}\n```" if paragraph.startswith("baldwinlab ") else paragraph
        for paragraph in paragraphs
    )
    return f"""# {capitalized(path.stem.replace("_", " "))}

{title}

{body}

File `{path.relative_to(ROOT).as_posix()}`:

```py
{source}```
"""


def _sort_key(name: str) -> str:
    return name.strip("_").lower()


def _code_list(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{name}`" for name in names)
