"""The command `watch`: draw a lifetime in the terminal."""

from __future__ import annotations

from typing import Annotated, Final

from cyclopts import Parameter
from rich.live import Live
from rich.text import Text

from baldwinlab.analysis.scene import Scene
from baldwinlab.analysis.statistics.fitness import typical_run
from baldwinlab.analysis.text_scene import TextScene
from baldwinlab.api.study import Study
from baldwinlab.cli.keys import read_keys
from baldwinlab.cli.options import (
    FLAG,
    HIDE_DEFAULT,
    RESOURCE_FORCE,
    Directory,
    OptionalInteger,
    Parts,
    load_parts,
)
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.simulation.replay import require_world
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.store import StudyStore

KEYS: Final = "space pause · ← → steps · + − speed · q quit"
# Duration of a lifetime and time between two frames, in seconds.
DURATION: Final = 30.0
FRAME_INTERVAL: Final = 0.066
# Space of a frame if the output is no terminal, in characters.
PLAIN_WIDTH: Final = 80
PLAIN_HEIGHT: Final = 30
# Number of frames that an arrow key skips.
SKIPPED_FRAMES: Final = 15


def watch(
    directory: Directory,
    /,
    *,
    condition: Annotated[
        str | None,
        HIDE_DEFAULT,
        Parameter(help="Condition of the run. Default: the first condition with a stored run."),
    ] = None,
    run: Annotated[
        OptionalInteger,
        HIDE_DEFAULT,
        Parameter(help="Number of a stored run, from 0. Default: the typical run."),
    ] = None,
    generation: Annotated[
        OptionalInteger,
        HIDE_DEFAULT,
        Parameter(help="Number of a generation, from 0. Default: the last one."),
    ] = None,
    world: Annotated[
        int,
        Parameter(help="Number of a world of the population (`population.worlds`), from 0."),
    ] = 0,
    part: Parts = None,
    force: Annotated[bool, FLAG, Parameter(help=RESOURCE_FORCE)] = False,
) -> None:
    """Draw a lifetime of a study in the terminal: the map, its items and its agents.

    An arrow is an agent, in the direction of its heading. It is bright after its first meal. The
    space key pauses, and q quits. If the output is not a terminal, the last step is printed.

    For example:

        baldwinlab watch results/evo-A --generation 99
    """
    load_parts(part)
    store = StudyStore(directory)
    name = condition or _find_condition(store)
    experiment = require_world(store.experiment(name))
    if run is None:
        store.require_runs()
        run = typical_run(open_sample(store, [name]), name)
    if generation is None:
        generation = store.record(name, run).sizes["generation"] - 1
    trace = Study(store).replay(name, run=run, generation=generation, world=world, force=force)
    scene = Scene(trace, experiment.world.width, experiment.world.height)
    if console.console.is_terminal:
        _play(scene)
    else:
        text_scene = TextScene(scene, PLAIN_WIDTH, PLAIN_HEIGHT)
        console.console.print(text_scene.draw(text_scene.n_steps - 1))


def _find_condition(store: StudyStore) -> str:
    for name in store.experiments:
        if store.runs(name):
            return name
    raise RefusedError(f"{store.location} has no stored run: simulate it with `baldwinlab run`")


def _play(scene: Scene) -> None:
    """Draw the steps one after another until the end of the lifetime, or until the user quits."""
    size = console.console.size
    text_scene = TextScene(scene, size.width, size.height)
    last_step = text_scene.n_steps - 1
    steps_per_frame = max(1, round(text_scene.n_steps * FRAME_INTERVAL / DURATION))
    step = 0
    is_paused = False
    with (
        Live(console=console.console, screen=True, auto_refresh=False) as live,
        read_keys() as read,
    ):
        while True:
            frame = text_scene.draw(step)
            live.update(Text("\n").join([frame, Text(KEYS, style="dim")]), refresh=True)
            key = read(FRAME_INTERVAL)
            if key == "q" or (step == last_step and not key and not is_paused):
                break
            if key == " ":
                is_paused = not is_paused
            elif key in ("+", "-"):
                factor = 2 if key == "+" else 0.5
                steps_per_frame = max(1, round(steps_per_frame * factor))
            elif key in ("left", "right"):
                is_paused = True
                sign = 1 if key == "right" else -1
                step += sign * SKIPPED_FRAMES * steps_per_frame
            elif not is_paused:
                step += steps_per_frame
            step = min(max(step, 0), last_step)
    console.info(f"{text_scene.title}; {text_scene.describe(step)}")
