"""The reference pages of the documentation, as Markdown: made of the code that they are about, and not written by hand."""

from __future__ import annotations

import ast
import inspect
import json
import re
import textwrap
from pathlib import Path
from typing import Final, get_args

import baldwinlab
from baldwinlab import papers, parts, variables
from baldwinlab.cli.common import app
from baldwinlab.experiment import Experiment, choices
from baldwinlab.experiment.classes import choosing_fields
from baldwinlab.papers.claims import OF_ALL, RULES
from baldwinlab.papers.paper import CARD, KINDS, Paper
from baldwinlab.papers.words import Assay, Figure
from baldwinlab.parts import evolution, kinds
from baldwinlab.parts.kinds import Part, hook_names
from scripts.described import (
    capital,
    fields_of,
    function,
    name,
    prose,
    table,
    table_of_fields,
    table_of_variables,
)

ROOT: Final = Path(__file__).parents[1]


def pages() -> dict[str, str]:
    """Every page, by its path on the site."""
    return {
        "reference/commands.md": commands(),
        "reference/python.md": python(),
        "reference/fields.md": fields(),
        "reference/parts.md": library(),
        "reference/models.md": models(),
        "reference/variables.md": recorded(),
        "reference/claims.md": claims(),
        "reference/papers.md": catalogue(),
        "reference/kinds.md": kinds_of_part(),
        "reference/citation.md": citation(),
        **{
            f"{path.relative_to(ROOT).as_posix()}.md": example(path)
            for path in sorted((ROOT / "examples").rglob("*.py"))
        },
    }


def commands() -> str:
    """Every command with its options."""
    told = str(app.generate_docs(output_format="markdown", recursive=True))
    told = re.sub(
        r"^## Table of Contents\n\n(- .*\n)+\n", "", told, flags=re.MULTILINE
    )  # the list of commands is one, too
    return told.replace("# baldwinlab\n", "# Commands\n", 1)


def python() -> str:
    """Every public name of the package."""
    return """# Python

Every public name of `import baldwinlab as bl`; [whole studies in Python](../docs/how-to/python.md) shows how they are used.

""" + "\n".join(
        name(each, getattr(baldwinlab, each)) for each in sorted(baldwinlab.__all__, key=_caseless)
    )


def fields() -> str:
    """Every field of an experiment of foragers."""
    text = """# Fields of an experiment

Every field of an experiment of foragers, by its dotted path, as `--set` takes it; `baldwinlab show` prints those of any
experiment. N is the number of a region, from 0. Where a field chooses a part, the [part's own fields](parts.md) stand in a table
of its name beside it. Experiments of other [models](models.md) have `name`, `model`, `population`, `evolution` and `record` of
these, and a table of the model's own.
"""
    tables: dict[str, list[tuple[str, object]]] = {}
    for path, node in fields_of(Experiment):
        tables.setdefault(path.partition(".")[0] if "." in path else "The experiment", []).append(
            (path, node)
        )
    return text + "".join(
        f"\n## {title}\n\n{table_of_fields(rows)}" for title, rows in tables.items()
    )


def library() -> str:
    """Every part that comes with the package but models, which have a page of their own."""
    text = "# Parts\n\nEvery part that comes with the package, by the field that chooses it, and the fields that it brings.\n"
    for path, kind, _ in choosing_fields(Experiment):
        text += f"\n## {capital(kind)}: `{path}`\n"
        for each in choices.packaged(kind):
            part = choices.find(kind, each)
            own = fields_of(part, f"{path.rpartition('.')[0]}.{choices.key_of(each)}")
            text += f"\n### {each}\n\n{prose(part.__doc__)}\n\n{table_of_fields(own)}"
    return text


def models() -> str:
    """Every model but the foragers."""
    text = """# Models

Lives of another kind than foraging, each chosen by `model`; the [papers](papers.md) have presets of them. Fields that every
experiment has are [here](fields.md); where a model has other defaults of them, they are given.
"""
    for each in choices.packaged("model"):
        if each == "miniworld":
            continue
        model = choices.find("model", each)
        text += f"\n## {each}\n\n{prose(model.__doc__)}\n\n{table_of_fields(fields_of(model, choices.key_of(each)))}"
        other = [
            f"`{of}.{field} = {json.dumps(value)}`"
            for of, some in model.defaults.items()
            for field, value in some.items()
        ]
        text += f"\nOther defaults: {', '.join(other)}.\n" if other else ""
        for title, told in (
            ("Measures of a run, for claims", model.measures),
            ("Drawn as shares", model.shares),
            ("Views", model.views),
        ):
            text += (
                f"\n{title}:\n\n"
                + "".join(f"- `{one}`: {what.meaning}\n" for one, what in told.items())
                if told
                else ""
            )
        text += (
            f"\nRecorded beside fitness ({model.payoff}):\n\n{table_of_variables(model.records)}"
            if model.records
            else ""
        )
    return text


def recorded() -> str:
    """Every variable that is recorded."""
    text = f"""# Recorded variables

What the arrays hold that baldwinlab gives and stores; [results on disk](../docs/results.md) says where. Models that are not
foragers [record more](models.md).

Weights are in this order: {variables.WEIGHT_ORDER}.

## A run

Of `simulate`.

{table_of_variables(variables.RUN)}
## A record

A run as it is stored: genomes that are not kept take no room.

{table_of_variables(variables.RECORD)}
## A trace

Of `replay`.

{table_of_variables(variables.TRACE)}"""
    for assay, measured in variables.ASSAYS.items():
        text += f"\n## The assay {assay}\n\nOf `open_assay`; see [assays](../docs/explanation/assays.md).\n\n"
        text += table_of_variables(measured)
    return text


def claims() -> str:
    """What the claims and the page of a paper can be made of."""
    return f"""# Claims, figures and assays

What a paper's `claims.toml` and `paper.toml` may name; [papers](../docs/papers.md) shows how.

## Rules

By which a verdict falls.

{table(("rule", "verdict"), [(f"`{rule}`", words) for rule, words in RULES.items()])}
## Measures

Of any model {_listed(OF_ALL)}; a model has [measures of its own](models.md).

## Figures

{_listed(get_args(Figure))}.

## Assays

{_listed(get_args(Assay))}: see [assays](../docs/explanation/assays.md).
"""


def catalogue() -> str:
    """Every paper with its claims, presets and variants."""
    text = "# Claims, presets and variants\n\nOf every paper that comes with baldwinlab, by year.\n"
    return text + "\n".join(_paper(paper) for paper in by_year())


def by_year() -> list[Paper]:
    return sorted(papers.built_in().values(), key=lambda paper: (paper.about.year, paper.name))


def short(paper: Paper) -> str:
    """Such as Nolfi and Parisi 1993."""
    *others, last = (author.split()[-1] for author in paper.about.authors)
    return f"{', '.join(others)}{' and ' * bool(others)}{last} {paper.about.year}"


def _paper(paper: Paper) -> str:
    page = Path("..") / (paper.folder / "README.md").relative_to(ROOT)
    card = f"![]({(page.parent / CARD).as_posix()})" if (paper.folder / CARD).exists() else ""
    text = f"""
## {paper.about.title}

{card}

{capital(paper.about.description)}. [What was found]({page.as_posix()}).

    baldwinlab reproduce {paper.name}

Source: {paper.about.citation}

"""
    text += (
        table(("claim", "what"), [(one.id, f"{one.title}: {one.text}") for one in paper.claims])
        if paper.claims
        else ""
    )
    for kind in KINDS:
        rows = [(f"`{each}`", paper.describe(kind, each)) for each in paper.names(kind)]
        text += "\n" + table((kind.removesuffix("s"), "what it is"), rows) if rows else ""
    return text


def kinds_of_part() -> str:
    """The kinds of part, what each declares, its hooks; and what else a file with a part may use."""
    text = f"""# Kinds of part and their hooks

What a part of one's own may be and do. [Changing the model](../docs/changing-the-model.md) teaches it, and each example is a page
beside this one.

{prose(kinds.__doc__)}

{prose(evolution.__doc__)}
"""
    of_part = {
        each: kind
        for each, kind in vars(parts).items()
        if isinstance(kind, type) and issubclass(kind, Part)
    }
    order = ["", *choices.BUILT_IN]  # a part is of no kind
    for each, kind in sorted(of_part.items(), key=lambda item: order.index(item[1].kind)):
        text += f"\n## {each}\n\n{prose(kind.__doc__)}\n\n```py\n{_declared(kind)}\n```\n"
        for hook in hook_names(kind) if kind is not Part else ():
            text += f"\n### {each}.{hook}\n\n{function(getattr(kind, hook), hook)}"
    text += "\n## What else a file may use\n\nAll other names of `baldwinlab.parts`.\n"
    others = sorted(set(parts.__all__) - set(of_part), key=_caseless)
    return text + "".join("\n" + name(each, getattr(parts, each), "###") for each in others)


def _declared(kind: type[Part]) -> str:
    """What a kind declares, as it is written, without its docstring, its hooks, and how Python makes a class of it."""
    source = inspect.getsource(kind).replace(f'    """{kind.__doc__}"""\n\n', "", 1)
    source = re.sub(
        r"^(    @classmethod\n)?    def __\w+__.*\n(        .*\n|\n)*",
        "",
        source,
        flags=re.MULTILINE,
    )
    return re.sub(
        r"^    \w+: ClassVar\[Any\] = staticmethod.*\n", "", source, flags=re.MULTILINE
    ).strip()


def citation() -> str:
    """How to cite, from CITATION.cff and the papers."""
    source = (ROOT / "CITATION.cff").read_text("utf-8")
    said = dict(re.findall(r'^(\w+): "?(.*?)"?$', source, re.MULTILINE))
    authors = ", ".join(re.findall(r'^  - name: "(.*)"$', source, re.MULTILINE))
    listed = "\n".join(
        f"- {paper.about.citation}" for paper in by_year() if paper.about.authors != ("baldwinlab",)
    )
    return f"""# How to cite

{said["message"]}

> {authors}: *{said["title"]}*, version {said["version"]}.

For programs, `CITATION.cff`:

```yaml
{source}```

## The papers

{listed}
"""


def example(path: Path) -> str:
    """An example in full, under what it says of itself."""
    source = path.read_text("utf-8")
    title, _, more = (ast.get_docstring(ast.parse(source)) or "").partition("\n")
    paragraphs = (
        re.sub("  +", " ", textwrap.dedent(each)) for each in more.strip("\n").split("\n\n")
    )
    more = "\n\n".join(
        f"```console\n{each}\n```" if each.startswith("baldwinlab ") else each
        for each in paragraphs
    )
    return f"""# {capital(path.stem.replace("_", " "))}

{title}

{more}

The file is `{path.relative_to(ROOT).as_posix()}`:

```py
{source}```
"""


def _caseless(name: str) -> str:
    return name.strip("_").lower()


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(f"`{each}`" for each in names)
