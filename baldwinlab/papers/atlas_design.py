"""Design of the atlas: maps, laws and claims, read from the folder `papers/atlas`.

A map of the atlas is a model, simulated on a grid of settings. A cell is a point of the grid.

atlas.toml        title, numbers of runs, and the maps
NAME.toml         file of the sweep of the map NAME: see docs/reference/sweeps.md
registered.toml   the claims and rules that were registered before the confirmatory runs
claims.toml       the present rules of these claims
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import Field

from baldwinlab.core.names import ATLAS_CLAIM, MAP_NAME
from baldwinlab.papers.loading import DeclaredTable, digest_folder, read_tables, validate_tables

FOLDER: Final = Path(__file__).with_name("atlas")
DESIGN_FILE: Final = "atlas.toml"
CLAIMS_FILE: Final = "claims.toml"
REGISTERED_FILE: Final = "registered.toml"


class Size(DeclaredTable):
    """Number of runs of a cell. Runs 0 to `exploration_runs` - 1 explore. The others confirm."""

    runs: int = Field(ge=2)
    exploration_runs: int = Field(ge=1)


class AtlasMap(DeclaredTable):
    """A map: a model on a grid of settings. The file of the sweep has the map's name."""

    name: str = Field(pattern=MAP_NAME)
    title: str
    # The model, in one sentence.
    description: str
    # Label of each swept field.
    axes: Mapping[str, str]
    # Law of `analysis.atlas.laws` that is drawn with the values, or "".
    law: str = ""
    # Whether the claims ignore the map, because the map was added after the confirmatory runs.
    is_exploratory: bool = False
    # Values of swept fields in the quick form. A field that is not named here keeps its values.
    quick: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)

    @property
    def complete_description(self) -> str:
        """Return the description, with a note if the claims do not use the map."""
        if not self.is_exploratory:
            return self.description
        return (
            f"{self.description} The claims do not use this map, which was added after their "
            "confirmatory runs."
        )

    @property
    def sweep_file(self) -> Path:
        """Return the file of the sweep."""
        return FOLDER / f"{self.name}.toml"


class AtlasClaim(DeclaredTable):
    """A claim, with the rule that decides whether the claim fails."""

    id: str = Field(pattern=ATLAS_CLAIM)
    claim: str
    rule: str
    # Numbers by name. The text of `rule` has these names in braces.
    bounds: Mapping[str, float] = Field(default_factory=dict)
    # Changes of the claim after a first look at results, or "".
    note: str = ""
    # Reason why the claim nearly follows from the construction of the model, or "".
    near_theorem: str = ""
    # The rule that was registered before the runs, and its verdict, or "" if the rule is the same.
    registered_rule: str = ""
    registered_verdict: str = ""

    @property
    def complete_rule(self) -> str:
        """Return the text of the rule with numbers in place of the names in braces."""
        return _insert_numbers(self.rule, self.bounds)

    @property
    def remarks(self) -> str:
        """Return what a reader must know about the rule: its history, and its limits."""
        sentences = [
            self.note,
            f"Near-theorem: {self.near_theorem}" if self.near_theorem else "",
            f"Registered rule: {self.registered_rule} Its verdict was: {self.registered_verdict}."
            if self.registered_rule
            else "",
        ]
        return " ".join(filter(None, sentences))


def _insert_numbers(rule: str, bounds: Mapping[str, float]) -> str:
    return rule.format_map({name: f"{number:g}" for name, number in bounds.items()})


class AtlasDesign(DeclaredTable):
    """The fields of `atlas.toml` and `claims.toml`."""

    title: str
    full: Size
    quick: Size
    maps: tuple[AtlasMap, ...] = Field(min_length=1)
    claims: tuple[AtlasClaim, ...] = Field(min_length=1)


def read_atlas() -> AtlasDesign:
    """Return the design of the atlas. Raises PaperError."""
    path = FOLDER / DESIGN_FILE
    registered = {table["id"]: table for table in read_tables(FOLDER / REGISTERED_FILE)["claims"]}
    claims = [
        _add_registered(table, registered[table["id"]])
        for table in read_tables(FOLDER / CLAIMS_FILE)["claims"]
    ]
    return validate_tables(AtlasDesign, {**read_tables(path), "claims": claims}, path)


def _add_registered(claim: Mapping[str, Any], registered: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a claim with its registered text and rule."""
    rule = _insert_numbers(registered["rule"], registered["bounds"])
    return {**claim, "claim": registered["claim"], "registered_rule": rule}


def digest_atlas(design: AtlasDesign) -> dict[str, str]:
    """Return the SHA-256 of each file of the atlas, by the name of the file."""
    names = [DESIGN_FILE, CLAIMS_FILE, REGISTERED_FILE]
    names += [atlas_map.sweep_file.name for atlas_map in design.maps]
    return digest_folder(FOLDER, names)
