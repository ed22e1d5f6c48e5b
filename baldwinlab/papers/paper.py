"""A paper: a folder of data, and the experiments, claims and words that it declares.

    paper.toml                             name, title, authors, what it runs: the fields of `About`
    conditions/*.toml                      each laid over the defaults of an experiment
    maps/*.toml, variants/*.toml           laid over a condition; controls/*.toml: conditions that are not the paper's own
    claims.toml, words.toml, README.md     what it claims; what the report says of it; its page
    card.png                               a small picture of it, twice as wide as it is high

An experiment is named CONDITION/MAP, or CONDITION where the paper has no maps. All but paper.toml and conditions/ may be left
out. Nothing in the folder is code.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, get_args

from pydantic import Field, field_validator

from baldwinlab.core.suggestions import list_names, suggest
from baldwinlab.experiment import Experiment, ExperimentError, merge, validate
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.renamed import upgrade
from baldwinlab.papers.claims import FIRST, OF_ALL, Claim, read_claims
from baldwinlab.papers.loading import Declared, PaperError, declared, read
from baldwinlab.papers.texts import FIGURES, Assay, Figure, Words, read_words

KINDS = ("conditions", "controls", "maps", "variants")
OLD_FOLDERS = {"variants": "readings"}  # papers of version 0.1 have these
CARD = "card.png"
MOST_RUNS = 2**31  # as many as a study can hold
STANDARD = "standard"  # the variant taken unless another is named


class About(Declared):
    """What `paper.toml` declares."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
    title: str
    authors: tuple[str, ...] = Field(min_length=1)
    year: int = Field(ge=1, le=9999)
    published: str = ""  # where, such as "AISB 2019"
    citation: str
    link: str = ""  # of http or https
    description: str
    conditions: tuple[str, ...] = ()  # that it runs, in order; all that there are unless given
    maps: tuple[str, ...] = ()
    runs: int = Field(30, ge=1, le=MOST_RUNS)  # of each condition
    figures: tuple[Figure, ...] = FIGURES
    assays: tuple[Assay, ...] = get_args(Assay)  # that are done when it is reproduced
    emergence: str = (
        ""  # the experiment whose lives the figure of that name shows; the first unless given
    )
    compared: tuple[
        str, ...
    ] = ()  # experiments that stand for it beside other papers; all that learn unless given

    @field_validator("link")
    @classmethod
    def _is_web_address(cls, link: str) -> str:
        if link and not re.fullmatch(r"https?://\S+", link, re.IGNORECASE):
            raise ValueError(f"{link!r} must be an address that begins with http:// or https://")
        return link

    @field_validator("conditions", "maps", "figures", "assays", "compared")
    @classmethod
    def _lists_each_once(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if repeated := [name for name in names if names.count(name) > 1]:
            raise ValueError(f"{repeated[0]!r} is listed twice; list each name once")
        return names

    @property
    def source(self) -> str:
        """Authors, title and place, in a line."""
        published = f" ({self.published})" if self.published else ""
        return f"{', '.join(self.authors)}, {self.title}{published}"


@dataclass(frozen=True)
class Paper:
    folder: Path
    about: About
    is_stored: bool = False  # a copy in a study, whose presets may have old names

    @property
    def name(self) -> str:
        return self.about.name

    @cached_property
    def claims(self) -> tuple[Claim, ...]:
        return read_claims(self.folder / "claims.toml")

    @cached_property
    def words(self) -> Words:
        return read_words(self.folder / "words.toml")

    @cached_property
    def _named(self) -> dict[str, list[str]]:
        return {
            kind: sorted(path.stem for path in self.preset_folder(kind).glob("*.toml"))
            for kind in KINDS
        }

    def preset_folder(self, kind: str) -> Path:
        """Return the folder of the presets of a kind, under its old name where only that one exists."""
        folder = self.folder / kind
        old = self.folder / OLD_FOLDERS.get(kind, kind)
        return old if old.is_dir() and not folder.is_dir() else folder

    def names(self, kind: str) -> list[str]:
        """The presets of a kind (one of `KINDS`), the standard variant first."""
        return sorted(self._named[kind], key=lambda name: name != STANDARD)

    def describe(self, kind: str, name: str) -> str:
        """What a preset is, in a line."""
        return str(self.layer(kind, name)["description"])

    def changes(self, kind: str, name: str) -> dict[str, Any]:
        """The fields that a preset sets, as `Experiment.replace` takes them."""
        return {
            part: fields for part, fields in self.layer(kind, name).items() if part != "description"
        }

    def layer(self, kind: str, name: str) -> dict[str, Any]:
        """A preset's file. Raises ExperimentError where there is none, PaperError for one that does not say what it is."""
        known = self.names(kind)
        if name not in known:
            if (kind, name) == ("variants", STANDARD):
                return {"description": "the paper as it stands"}
            raise ExperimentError(
                f"there is no {kind.removesuffix('s')} {name!r}{suggest(name, known)}"
            )
        path = self.preset_folder(kind) / f"{name}.toml"
        layer = read(path)
        if not isinstance(layer.get("description"), str):
            raise PaperError(f"{path}: description is missing, a line that says what it is")
        if "name" in layer:
            raise PaperError(f"{path}: name: a preset has no such key, it is named by its file")
        return layer

    def factors(self) -> dict[str, Factors]:
        """Learner and map of all that it can name, its own conditions first."""
        learners, maps = [*self.names("conditions"), *self.names("controls")], self.names("maps")
        if not maps:
            return {learner: Factors(learner) for learner in learners}
        return {
            f"{learner}/{place}": Factors(learner, place) for learner in learners for place in maps
        }

    def experiment_names(self) -> list[str]:
        """All that it can name, its own conditions first."""
        return list(self.factors())

    def experiment(self, name: str, variant: str = STANDARD) -> Experiment:
        """One by name, under a variant.

        Raises ExperimentError where there is none of that name, and PaperError where its files make none.
        """
        condition, slash, place = name.rpartition("/") if self.names("maps") else (name, "/", "")
        if not slash:
            if self.lacks_map(name):
                raise self.missing_map(name)
            raise ExperimentError(
                f"there is no preset {name!r}{suggest(name, self.experiment_names())}"
            )
        first = "controls" if condition in self.names("controls") else "conditions"
        layers = [(first, condition), *([("maps", place)] if place else []), ("variants", variant)]
        tree: dict[str, Any] = {"name": name}
        for layer in layers:
            tree = merge(tree, self.changes(*layer))
        try:
            made: Experiment = validate(upgrade(tree) if self.is_stored else tree)
            return made
        except ExperimentError as error:
            files = " with ".join(
                f"{kind}/{one}.toml" for kind, one in layers if one in self.names(kind)
            )
            raise PaperError(f"{self.folder}: {files}: {str(error).splitlines()[0]}") from None

    def lacks_map(self, name: str) -> bool:
        """Return whether a name is that of a condition alone, in a paper whose experiments name a map, too."""
        return bool(self.names("maps")) and name in (
            *self.names("conditions"),
            *self.names("controls"),
        )

    def missing_map(self, name: str) -> ExperimentError:
        """Return the error for a name that `lacks_map`."""
        maps = self.about.maps or self.names("maps")
        return ExperimentError(
            f"{name} names no map; {list_names(name, maps)}: write {name}/{maps[0]}"
        )

    def measures(self, name: str) -> Mapping[str, Any] | None:
        """The measures of the model of one of its experiments, next to `OF_ALL`; None where its parts are not loaded."""
        try:
            model = self.experiment(name).loaded_model
        except (ExperimentError, PaperError):
            return None
        return {} if model is None else model.measures

    def own(self) -> list[str]:
        """Of the experiments it can name, those that it runs, in its order."""
        conditions = self.about.conditions or self.names("conditions")
        maps = self.about.maps or self.names("maps")
        return (
            [f"{condition}/{place}" for place, condition in product(maps, conditions)]
            if maps
            else list(conditions)
        )

    def experiments(self, variant: str = STANDARD) -> list[Experiment]:
        """Those that it runs, in its order."""
        return [self.experiment(name, variant) for name in self.own()]


def open_paper(folder: Path, is_stored: bool = False) -> Paper:
    """The paper in a folder, as far as its paper.toml says. Raises PaperError."""
    path = folder / "paper.toml"
    return Paper(folder, declared(About, read(path), path), is_stored)


def check(paper: Paper) -> Paper:
    """Read all that is in the folder, and give it back. Raises PaperError with the first fault."""
    if not paper.names("conditions"):
        raise PaperError(
            f"{paper.folder / 'conditions'} holds no condition: a TOML file laid over an experiment's defaults"
        )
    _require_distinct_names(paper)
    for kind, listed in (("conditions", paper.about.conditions), ("maps", paper.about.maps)):
        _require(listed, paper.names(kind), f"{paper.folder / 'paper.toml'}: {kind}")
    known = paper.experiment_names()
    experiments = [paper.experiment(name) for name in known]
    for variant in paper.names("variants"):
        paper.experiment(known[0], variant)
    for key, named in (
        ("emergence", filter(None, [paper.about.emergence])),
        ("compared", paper.about.compared),
    ):
        _require(named, known, f"{paper.folder / 'paper.toml'}: {key}")
    require_known(paper.claims, paper.folder / "claims.toml", known, paper.measures)
    for claim in paper.claims:
        for choice in claim.choices:
            _require_field(
                choice.field,
                experiments,
                f"{paper.folder / 'claims.toml'}: {claim.id}, choice {choice.id}",
            )
    paper.words  # noqa: B018 (reading them is the check)
    return paper


def _require_distinct_names(paper: Paper) -> None:
    """Raise PaperError where a name in claims or on the command line would mean two things."""
    for name in sorted({*paper.names("conditions")} & {*paper.names("controls")}):
        raise PaperError(
            f"{paper.folder / 'controls' / name}.toml: {name!r} is the name of a condition, too; "
            "a control must have a name of its own"
        )
    if FIRST in paper.experiment_names():
        raise PaperError(
            f"{paper.folder}: no condition can be named {FIRST!r}, because claims call the first generations so; rename its file"
        )


def require_known(
    claims: Sequence[Claim],
    path: Path,
    known: list[str],
    measures: Callable[[str], Mapping[str, Any] | None],
) -> None:
    """Raise PaperError where claims in a file are about a condition that is not known, or about what it does not measure.

    `measures` gives those that a condition has next to `OF_ALL`, by name; None where its model is not loaded.
    """
    for claim in claims:
        _require(sorted(claim.conditions), known, f"{path}: {claim.id} names a condition")
        for comparison in claim.comparisons:
            for name in sorted(comparison.conditions):
                own = measures(name)
                if own is None:
                    continue
                _require(
                    [comparison.measure],
                    [*OF_ALL, *own],
                    f"{path}: {claim.id}: a measure of {name}",
                )
                if comparison.rule == "survives_longer" and not own[comparison.measure].censored:
                    raise PaperError(
                        f"{path}: {claim.id}: the rule 'survives_longer' needs a measure that tells which runs are censored, "
                        f"and {comparison.measure!r} of {name} does not"
                    )


def _require(names: Iterable[str], known: list[str], where: str) -> None:
    for name in names:
        if name not in known:
            raise PaperError(f"{where} {name!r}, which there is not{suggest(name, known)}")


def _require_field(path: str, experiments: Sequence[Experiment], where: str) -> None:
    """A field that a part brings is there only where that part is chosen."""
    faults = []
    for experiment in experiments:
        try:
            look_up(experiment, path)
        except ExperimentError as error:
            faults.append(error)
    if len(faults) == len(experiments):
        raise PaperError(f"{where}: {faults[0]}")
