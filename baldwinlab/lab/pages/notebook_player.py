"""The HTML of traces in notebooks: a player in a sandboxed frame, and the variables below it.

A trace is a lifetime as an `xarray.Dataset`, the result of `replay`. This class is third-party, so
`baldwinlab/__init__.py` registers `format_html` as the HTML representation of datasets.
"""

from __future__ import annotations

from html import escape
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.analysis.appearance import has_appearance, read_appearance
from baldwinlab.api.load import load
from baldwinlab.core.deferred import xr
from baldwinlab.lab.pages import single_page
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.model_displays import describe_species

# Of a lifetime with more agent-steps, the player shows only the first steps.
MAX_AGENT_STEPS: Final = 1_000_000
DEGREES_OF_CIRCLE: Final = 360
# The variables that the player draws, with their dimensions.
DRAWN_VARIABLES: Final = {
    **dict.fromkeys(("x", "y", "heading", "action", "eaten"), ("step", "agent")),
    **dict.fromkeys(("item_x", "item_y"), ("step", "item")),
    "sensor": ("step", "agent", "side"),
}


def format_html(dataset: xr.Dataset) -> str:
    """Return the HTML of a dataset: a player for a trace, else the representation of xarray."""
    table = str(dataset._repr_html_())
    if not is_playable(dataset):
        return table
    panel = make_panel(dataset)
    page = single_page.render_replay_page([panel], 0)
    # The scripts in the frame have no access to the notebook.
    return (
        f'<iframe sandbox="allow-scripts" title="{escape(panel["title"])}"'
        f' style="width: 100%; height: 700px; border: 0" srcdoc="{escape(page.decode())}"></iframe>'
        f"<details><summary>Variables of this trace</summary>{table}</details>"
    )


def is_playable(dataset: xr.Dataset) -> bool:
    """Return whether a dataset is a trace with all drawn variables and at least one step."""
    has_variables = all(
        name in dataset.variables and dataset[name].dims == dims
        for name, dims in DRAWN_VARIABLES.items()
    )
    if not has_variables or not dataset.sizes["step"]:
        return False
    return has_appearance(dataset) and "experiment" in dataset.attrs


def make_panel(trace: xr.Dataset) -> dict[str, Any]:
    """Return a recorded lifetime for the player, with the command that simulates it again."""
    run = trace.attrs["run"]
    generation = trace.attrs["generation"]
    command = (
        f"bl.replay(bl.load('experiment.toml'), seed={trace.attrs['seed']}, run={run},"
        f" generation={generation})"
    )
    return {
        "title": f"{trace.attrs['condition']}, run {run}, generation {generation}",
        "recording": single_page.compress(pack_trace(trace)),
        "experiment": trace.attrs["experiment"],
        "commands": [command],
    }


def pack_trace(trace: xr.Dataset) -> bytes:
    """Return a container with the arrays of `lab/sources/recording.py`, which the player reads.

    The arrays of agents are stored as differences between steps, which compress better.
    """
    n_agents = trace.sizes["agent"]
    max_steps = max(1, MAX_AGENT_STEPS // n_agents)
    first_steps = trace.isel(step=slice(0, max_steps))
    # A trace does not contain the teachers.
    appearance = {**read_appearance(trace), "has_teachers": False}
    agent_arrays = _collect_agent_arrays(first_steps, appearance)
    experiment = load(trace)
    header = {
        "kind": "recording",
        **{name: trace.attrs[name] for name in ("condition", "seed", "run", "generation")},
        "first": 0,
        "last": first_steps.sizes["step"],
        "steps": trace.sizes["step"],
        "agents": n_agents,
        "items": trace.sizes["item"],
        "world": experiment.world.model_dump(mode="json"),
        "appearance": appearance,
        **describe_species(experiment),
    }
    arrays = agent_arrays | _collect_item_arrays(first_steps)
    if "species" in trace:
        arrays["species"] = trace["species"].values.astype(np.uint8)
    return binary_frames.pack(header, arrays, differences=agent_arrays.keys())


def _collect_agent_arrays(
    trace: xr.Dataset, appearance: dict[str, Any]
) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of agents [step, agent], and sensors [step, agent * byte or input]."""
    # [step, agent, input]. The trace has NaN for an input that a species lacks.
    sensor = np.nan_to_num(trace.sensor.values)
    if not any(appearance["is_continuous"]):
        sensor = np.packbits(sensor > 0, axis=2, bitorder="little")
    # From degrees to units of 1 / `n_headings` of a circle. 360 degrees become 0.
    n_headings = appearance["headings"]
    heading = np.rint(trace.heading.values * (n_headings / DEGREES_OF_CIRCLE)) % n_headings
    return {
        "x": trace.x.values,
        "y": trace.y.values,
        "heading": heading.astype(np.uint16),
        # Join the sensors of all agents in a step.
        "sensor": sensor.reshape(len(sensor), -1),
        "action": trace.action.values,
        "eaten_in_life": trace.eaten.values.cumsum(axis=0, dtype=np.uint32),
    }


def _collect_item_arrays(trace: xr.Dataset) -> dict[str, npt.NDArray[Any]]:
    """Return the positions of items at the first step, and each later change of a position."""
    # [step, item]
    x = trace.item_x.values
    y = trace.item_y.values
    has_moved = (np.diff(x, axis=0) != 0) | (np.diff(y, axis=0) != 0)
    steps_before_moves, moved_items = np.nonzero(has_moved)
    # Element i of `np.diff` is the change from step i to step i + 1.
    move_steps = steps_before_moves + 1
    return {
        "item_x": x[0],
        "item_y": y[0],
        "move_step": move_steps.astype(np.uint32),
        "move_item": moved_items.astype(np.uint32),
        "move_x": x[move_steps, moved_items],
        "move_y": y[move_steps, moved_items],
    }
