"""Lifetimes that a report links to: addresses in the lab, and commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple
from urllib.parse import urlencode

import xarray as xr

from baldwinlab.analysis.statistics import fitness
from baldwinlab.core.lab_address import DEFAULT_LAB_PORT, LAB_HOST

# Largest number of lifetimes that a figure links to.
MAX_LINKED_LIVES: Final = 8


class StoredLife(NamedTuple):
    """A stored lifetime."""

    condition: str
    run: int
    generation: int

    @property
    def options(self) -> str:
        """The options of commands that replay the lifetime."""
        return f"--condition {self.condition} --run {self.run} --generation {self.generation}"


class Link(NamedTuple):
    """A link to lifetimes in the lab."""

    label: str
    address: str


def find_typical_lives(data: xr.Dataset) -> dict[str, StoredLife]:
    """Return by condition the last generation of a typical run. Conditions without runs have none.

    `data`: the runs, with the dimensions (condition, run, generation, agent).
    """
    has_data = data["energy"].notnull().any(("run", "agent"))
    lives = {}
    for name in map(str, data["condition"].values):
        is_stored = has_data.sel(condition=name)
        if bool(is_stored.any()):
            last_generation = int(is_stored["generation"][is_stored][-1])
            lives[name] = StoredLife(name, fitness.typical_run(data, name), last_generation)
    return lives


def make_link(lives: Sequence[StoredLife], label: str = "") -> Link:
    """Return the link to one lifetime, or to two that the lab shows next to each other.

    The lab serves the directory of the study, so the address contains no name of a directory.

    `label`: text of the link. By default the conditions.
    """
    state: dict[str, str | int] = {}
    for prefix, life in zip(("", "b."), lives, strict=False):
        state[f"{prefix}study"] = "."
        state |= {f"{prefix}{key}": value for key, value in life._asdict().items()}
    label = label or " and ".join(life.condition for life in lives)
    return Link(label, _format_address("world", state))


def link_paper(name: str) -> Link:
    """Return the link to the card of a paper. The lab serves the folder of its study."""
    return Link(name, _format_address("papers", {"paper": name}))


def _format_address(view: str, state: Mapping[str, str | int]) -> str:
    return f"http://{LAB_HOST}:{DEFAULT_LAB_PORT}/#/{view}?{urlencode(state)}"


def link_conditions(lives: Mapping[str, StoredLife]) -> list[Link]:
    """Return a link to a typical lifetime of each condition, at most `MAX_LINKED_LIVES`."""
    return [make_link([life]) for life in [*lives.values()][:MAX_LINKED_LIVES]]


def list_replay_commands(lives: Mapping[str, StoredLife]) -> list[str]:
    """Return the commands that write the lifetimes as movies, in the directory of the study."""
    return [format_replay_command(life) for life in lives.values()]


def format_replay_command(life: StoredLife) -> str:
    """Return the command that writes a lifetime as a movie, in the directory of the study."""
    return f"baldwinlab replay . {life.options} --out life.mp4"
