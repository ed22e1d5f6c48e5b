"""A trace in a notebook: the lab's player in a frame of its own, which asks nobody for anything; below it, what the trace holds.

A trace is xarray's `Dataset`, a class that is not ours, so `baldwinlab/__init__.py` tells notebooks to show datasets by `html`.
"""

from __future__ import annotations

import json
from html import escape
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab._version import __version__
from baldwinlab.api.records import read_experiment
from baldwinlab.lab import binary_frames, single_page

PLAYER: Final = "replay_page.js"
STYLES: Final = ("style.css", "world.css", "world_figure.css", "replay_page.css")
MOST: Final = (
    1_000_000  # agents times steps that are played; a longer life is played from its beginning
)
SHOWN: Final = {  # the variables that are drawn, and their dimensions
    **dict.fromkeys(("x", "y", "heading", "action", "eaten"), ("step", "agent")),
    **dict.fromkeys(("item_x", "item_y"), ("step", "item")),
    "sensor": ("step", "agent", "side"),
}


def html(dataset: xr.Dataset) -> str:
    """How a notebook shows a dataset: a trace, or some steps of it, plays; any other is shown as xarray does."""
    table = str(dataset._repr_html_())
    return (
        f"{_frame(dataset)}<details><summary>What this trace holds</summary>{table}</details>"
        if plays(dataset)
        else table
    )


def plays(dataset: xr.Dataset) -> bool:
    """Whether a dataset is a trace with all that its player draws, at one step at least."""
    drawn = all(
        name in dataset.variables and dataset[name].dims == dims for name, dims in SHOWN.items()
    )
    return drawn and bool(dataset.sizes["step"]) and {"look", "experiment"} <= dataset.attrs.keys()


def _frame(trace: xr.Dataset) -> str:
    """Its scripts run, but as a page from nowhere: they see nothing of the notebook."""
    title = f"{trace.attrs['condition']}, run {trace.attrs['run']}, generation {trace.attrs['generation']}"
    again = "bl.replay(bl.load('experiment.toml'), seed={seed}, run={run}, generation={generation})".format(
        **trace.attrs
    )
    panel = {
        "title": title,
        "recording": single_page.compress(recording(trace)),
        "experiment": trace.attrs["experiment"],
        "commands": [again],
    }
    replay = {"version": __version__, "step": 0, "panels": [panel]}
    page = escape(
        single_page.render_page("replay.html", PLAYER, STYLES, title=title, replay=replay).decode()
    )
    size = "width: 100%; height: 700px; border: 0"
    return f'<iframe sandbox="allow-scripts" title="{escape(title)}" style="{size}" srcdoc="{page}"></iframe>'


def recording(trace: xr.Dataset) -> bytes:
    """The container that the page plays, as `lab/recording.py` has it, but what agents do is kept as differences."""
    steps, agents = trace.sizes["step"], trace.sizes["agent"]
    part = trace.isel(step=slice(0, max(1, MOST // agents)))
    look = {
        **json.loads(trace.attrs["look"]),
        "lessons": False,
    }  # a trace does not say from whom each learns
    moving, items = _of_agents(part, look), _of_items(part)
    header = {
        "kind": "recording",
        **{name: trace.attrs[name] for name in ("condition", "seed", "run", "generation")},
        "first": 0,
        "last": part.sizes["step"],
        "steps": steps,
        "agents": agents,
        "items": trace.sizes["item"],
        "world": read_experiment(trace).world.model_dump(mode="json"),
        "look": look,
    }
    return binary_frames.pack(header, moving | items, differences=moving.keys())


def _of_agents(part: xr.Dataset, look: dict[str, Any]) -> dict[str, npt.NDArray[Any]]:
    """What is known of each in each step: [step, agent], and of sensors [step, agent * byte or input]."""
    sensor = (
        part.sensor.values
        if any(look["real"])
        else np.packbits(part.sensor.values > 0, axis=2, bitorder="little")
    )
    turns = np.rint(part.heading.values * (look["headings"] / 360)) % look["headings"]
    return {
        "x": part.x.values,
        "y": part.y.values,
        "heading": turns.astype(np.uint16),
        "sensor": sensor.reshape(len(sensor), -1),
        "action": part.action.values,
        "eaten_in_life": part.eaten.values.cumsum(axis=0, dtype=np.uint32),
    }


def _of_items(part: xr.Dataset) -> dict[str, npt.NDArray[Any]]:
    """Where they lie at the first step, and from which step on which of them lies elsewhere."""
    x, y = part.item_x.values, part.item_y.values
    step, item = np.nonzero((np.diff(x, axis=0) != 0) | (np.diff(y, axis=0) != 0))
    step = step + 1  # at which they lie where they have moved
    moves = {
        "step": step.astype(np.uint32),
        "item": item.astype(np.uint32),
        "x": x[step, item],
        "y": y[step, item],
    }
    return {"item_x": x[0], "item_y": y[0]} | {
        f"move_{name}": values for name, values in moves.items()
    }
