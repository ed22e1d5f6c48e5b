"""A paper: a folder of data that declares experiments, claims and texts.

    paper.toml            name, title, authors and conditions: the fields of `PaperMetadata`
    conditions/*.toml     changes of the defaults of an experiment
    controls/*.toml       conditions that are not in the paper
    maps/*.toml           changes of a condition
    variants/*.toml       changes of a condition
    claims.toml           the claims
    words.toml            texts of the report
    README.md             the page of the paper
    card.png              a small picture, twice as wide as high
    card.toml             texts of the card in the lab

An experiment is named CONDITION/MAP, or CONDITION if the paper has no maps. Only paper.toml and
conditions/ are required. The folder contains no code.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator

from baldwinlab.core.files import find_paths
from baldwinlab.core.names import PAPER_NAME, find_name_fault, list_names, read_stem, suggest
from baldwinlab.core.numbers import SEED_LIMIT
from baldwinlab.experiment import Experiment, ExperimentError, merge, validate
from baldwinlab.experiment.conditions import Factors
from baldwinlab.papers.claims import Claim, read_claims
from baldwinlab.papers.loading import DeclaredTable, PaperError, read_tables, validate_tables

PRESET_KINDS = ("conditions", "controls", "maps", "variants")
CARD_FILE = "card.png"
# Default variant: the paper without changes.
STANDARD_VARIANT = "standard"
# This package does not check the names of figures, because the package `analysis` defines figures.
DEFAULT_FIGURES: tuple[str, ...] = (
    "fitness",
    "species",
    "final-fitness",
    "emergence",
    "networks",
    "senses",
    "maps",
)
Question = Literal[
    "gain", "learning", "newborns", "innate", "share", "need", "movement", "cost", "sooner",
    "guidance", "built-innate", "built-learned", "reinforcement", "action",
]  # fmt: skip


class Inference(DeclaredTable):
    """A statement of a paper on the Baldwin effect, and the question that tests this statement."""

    question: Question
    # One sentence of the report.
    text: str = Field(alias="says")
    # A sentence on what the comparison cannot show.
    limit: str = ""


class ReportTexts(DeclaredTable):
    """Texts of `words.toml`, which a paper adds to its report."""

    # Heading of the report.
    heading: str = ""
    # The question that the study answers, as the first line of the report.
    question: str = ""
    # By figure: a sentence after the caption that compares the figure with one of the paper.
    captions: Mapping[str, str] = Field(default_factory=dict)
    inference: Inference | None = None


class Exercise(DeclaredTable):
    """A live run that shows one fact of the paper."""

    # Instructions, and the expected result.
    text: str
    preset: str
    # Changed settings by path.
    changes: Mapping[str, Any] = Field(default_factory=dict)


class PaperCard(DeclaredTable):
    """The texts of `card.toml`."""

    # The question of the paper in a few words.
    question: str
    # A result to notice.
    notice: str
    exercise: Exercise = Field(alias="try")
    # A question for a further study.
    extend: str


class PaperMetadata(DeclaredTable):
    """The fields of `paper.toml`."""

    name: str = Field(pattern=PAPER_NAME)
    title: str
    authors: tuple[str, ...] = Field(min_length=1)
    year: int = Field(ge=1, le=9999)
    # Journal or conference, for example "AISB 2019".
    published: str = ""
    citation: str
    # Text from which the claims of the paper were taken. "": the study is no publication.
    text_source: Literal["full text", "abstract", "memory", ""] = ""
    # Address with http or https.
    link: str = ""
    description: str
    # Conditions and maps of the study, in order. Default: all.
    conditions: tuple[str, ...] = ()
    maps: tuple[str, ...] = ()
    # Runs of each condition.
    runs: int = Field(30, ge=1, le=SEED_LIMIT)
    # Number of the first run.
    first_run: int = Field(0, ge=0, lt=SEED_LIMIT)
    figures: tuple[str, ...] = DEFAULT_FIGURES
    # Assays of `reproduce`, which checks the names. Default: the default assays.
    assays: tuple[str, ...] | None = None
    # Experiment of the figure "emergence". Default: the first.
    emergence: str = ""
    # Names of the experiments in the gallery. Default: all experiments with learning.
    compared: tuple[str, ...] = ()

    @field_validator("name")
    @classmethod
    def _is_folder_name(cls, name: str) -> str:
        if fault := find_name_fault(name):
            raise ValueError(f"{name!r} cannot be the name of a paper: {fault}")
        return name

    @field_validator("link")
    @classmethod
    def _is_web_address(cls, link: str) -> str:
        if link and not re.fullmatch(r"https?://\S+", link, re.IGNORECASE):
            raise ValueError(f"{link!r} must be an address that begins with http:// or https://")
        return link

    @field_validator("conditions", "maps", "figures", "assays", "compared")
    @classmethod
    def _has_no_duplicate(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if repeated := [name for name in names if names.count(name) > 1]:
            raise ValueError(f"{repeated[0]!r} is listed twice; list each name once")
        return names

    @property
    def source(self) -> str:
        """Return authors, title and journal in one line."""
        published = f" ({self.published})" if self.published else ""
        return f"{', '.join(self.authors)}, {self.title}{published}"


@dataclass(frozen=True)
class Paper:
    """A paper in a folder."""

    folder: Path
    metadata: PaperMetadata

    @property
    def name(self) -> str:
        return self.metadata.name

    @cached_property
    def claims(self) -> tuple[Claim, ...]:
        return read_claims(self.folder / "claims.toml")

    @cached_property
    def texts(self) -> ReportTexts:
        path = self.folder / "words.toml"
        tree = read_tables(path) if path.exists() else {}
        return validate_tables(ReportTexts, tree, path)

    @cached_property
    def card(self) -> PaperCard | None:
        path = self.folder / "card.toml"
        return validate_tables(PaperCard, read_tables(path), path) if path.exists() else None

    @cached_property
    def _files_by_kind(self) -> dict[str, dict[str, Path]]:
        return {
            kind: {read_stem(path): path for path in find_paths(self.folder / kind, "*.toml")}
            for kind in PRESET_KINDS
        }

    def names(self, kind: str) -> list[str]:
        """Return the sorted names of a kind of `PRESET_KINDS`, but the standard variant first."""
        return sorted(self._files_by_kind[kind], key=lambda name: (name != STANDARD_VARIANT, name))

    def describe(self, kind: str, name: str) -> str:
        """Return the description of a preset."""
        return str(self.read_preset(kind, name)["description"])

    def changes(self, kind: str, name: str) -> dict[str, Any]:
        """Return the settings of a preset, as the arguments of `Experiment.replace`."""
        preset = self.read_preset(kind, name)
        return {table: values for table, values in preset.items() if table != "description"}

    def read_preset(self, kind: str, name: str) -> dict[str, Any]:
        """Return the tables of a preset's file.

        Raises ExperimentError if there is no such preset, and PaperError if it has no description.
        """
        names = self.names(kind)
        if name not in names:
            if (kind, name) == ("variants", STANDARD_VARIANT):
                return {"description": "the paper without changes"}
            raise ExperimentError(
                f"there is no {kind.removesuffix('s')} {name!r}{suggest(name, names)}"
            )
        path = self._files_by_kind[kind][name]
        preset = read_tables(path)
        if not isinstance(preset.get("description"), str):
            raise PaperError(f"{path}: description is missing: one line that describes the preset")
        if "name" in preset:
            raise PaperError(
                f"{path}: name: a preset has no such key; the name of its file is its name"
            )
        return preset

    def factors(self) -> dict[str, Factors]:
        """Return learner and map of each experiment by name: conditions first, then controls."""
        learners = [*self.names("conditions"), *self.names("controls")]
        maps = self.names("maps")
        if not maps:
            return {learner: Factors(learner) for learner in learners}
        return {
            f"{learner}/{name}": Factors(learner, name) for learner in learners for name in maps
        }

    def experiment_names(self) -> list[str]:
        """Return the names of all experiments: conditions first, then controls."""
        return list(self.factors())

    def experiment(self, name: str, variant: str = STANDARD_VARIANT) -> Experiment:
        """Return an experiment by name, with the changes of a variant.

        Raises ExperimentError for an unknown name, and PaperError if the files of the presets
        describe no valid experiment.
        """
        if self.lacks_map(name):
            raise self.missing_map_error(name)
        condition, map_name = name, ""
        if self.names("maps"):
            condition, slash, map_name = name.rpartition("/")
            if not slash:
                names = self.experiment_names()
                raise ExperimentError(f"there is no preset {name!r}{suggest(name, names)}")
        kind = "controls" if condition in self.names("controls") else "conditions"
        # The settings of a later preset replace those of an earlier preset.
        presets = [(kind, condition)]
        if map_name:
            presets.append(("maps", map_name))
        presets.append(("variants", variant))
        tree: dict[str, Any] = {"name": name}
        for preset_kind, preset in presets:
            tree = merge(tree, self.changes(preset_kind, preset))
        try:
            experiment: Experiment = validate(tree)
            return experiment
        except ExperimentError as error:
            files = " with ".join(
                f"{preset_kind}/{preset}.toml"
                for preset_kind, preset in presets
                if preset in self.names(preset_kind)
            )
            first_line = str(error).splitlines()[0]
            raise PaperError(f"{self.folder}: {files}: {first_line}") from None

    def lacks_map(self, name: str) -> bool:
        """Return whether a name is a condition or control without the map that the paper needs."""
        return bool(self.names("maps")) and name in (
            *self.names("conditions"),
            *self.names("controls"),
        )

    def missing_map_error(self, name: str) -> ExperimentError:
        """Return the error for a condition without a map, with the possible maps."""
        maps = self.metadata.maps or self.names("maps")
        return ExperimentError(
            f"{name} names no map; {list_names(name, maps)}: write {name}/{maps[0]}"
        )

    def measures(self, name: str) -> Mapping[str, Any] | None:
        """Return the measures of an experiment in addition to `COMMON_MEASURES`.

        They are those of the model and of several species. None: a part is not loaded.
        """
        try:
            return self.experiment(name).measures
        except (ExperimentError, PaperError):
            return None

    def study_names(self) -> list[str]:
        """Return the names of the experiments of the study, in order."""
        conditions = self.metadata.conditions or self.names("conditions")
        maps = self.metadata.maps or self.names("maps")
        if not maps:
            return list(conditions)
        return [f"{condition}/{map_name}" for map_name, condition in product(maps, conditions)]

    def experiments(self, variant: str = STANDARD_VARIANT) -> list[Experiment]:
        """Return the experiments of the study, in order."""
        return [self.experiment(name, variant) for name in self.study_names()]


def open_paper(folder: Path) -> Paper:
    """Return the paper in a folder. Only paper.toml is read and checked. Raises PaperError."""
    path = folder / "paper.toml"
    return Paper(folder, validate_tables(PaperMetadata, read_tables(path), path))
