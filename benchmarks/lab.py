"""Measure the frame rate of the lab: `python -m benchmarks.lab [--seconds 5] [--agents 20 1000]`.

The command needs the extra `lab`, playwright and Chromium. It prints frames per second in headless
Chromium without a graphics card, at most 60: the median, and the slowest 5 %. The map is drawn once
for each frame, or, in a world of many agents, once for each simulated frame. The last columns are
these pictures and the steps of the lifetime per second.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import uvicorn
from playwright.sync_api import Browser, Page, sync_playwright

from baldwinlab.core.console import progress
from baldwinlab.lab.access import Access
from baldwinlab.lab.server import make_app
from baldwinlab.papers.presets import load
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.run import find_missing_runs, run_study

CONDITION = "evo%2Bself-taught/A"


class World(NamedTuple):
    """The size of a benchmark: items, side of the map in map units, and steps of the lifetime."""

    items: int
    side: float
    steps: int


# By the number of agents.
WORLDS = {
    20: World(50, 640, 3000),
    1000: World(500, 640, 3000),
    10_000: World(25_000, 2500, 2000),
    100_000: World(250_000, 8000, 400),
}
# The page shows frames of larger worlds instead of recordings.
MAX_RECORDED_AGENTS = 4000
SETTINGS = {
    "plays at 10x": "&speed=10",
    "plays at 100x": "&speed=100",
    "full trails": "&speed=100&trails=life",
    "an agent open": "&speed=10&agent=3",
    "side by side": "&speed=10&b.condition=evo/A",
}
FRAME_SETTINGS = {
    "plays at 1x": "&speed=1",
    "plays at 10x": "&speed=10",
    "plays at 100x": "&speed=100",
    "single agents": "&speed=10&zoom=0.6,0.5,40",
    "side by side": "&speed=10&b.condition=evo/A",
}
# Return the times of frames, in ms, and the steps of the page and of the map at these times.
COUNT_FRAMES = """seconds => new Promise(done => {
  const [times, steps, pictures] = [[], [], []];
  const canvas = document.querySelector("[data-testid=world-a]");
  const clock = document.querySelector("[data-testid=step]");
  const frame = now => {
    times.push(now);
    steps.push(Number(clock.textContent.split("/")[0].replaceAll(",", "")));
    pictures.push(canvas.dataset.step ?? null);
    const isLast = now - times[0] >= 1000 * seconds;
    if (isLast) done({ times, steps, pictures });
    else requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
})"""


class FrameRates(NamedTuple):
    """Frames per second: median and slowest 5 %; pictures of the map and steps per second."""

    median: float
    slow: float
    pictures: float
    steps: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=5, help="duration of each setting, in seconds"
    )
    parser.add_argument(
        "--agents", type=int, nargs="+", default=list(WORLDS), choices=WORLDS, help="sizes"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for agents in options.agents:
            make_study(Path(folder) / str(agents), agents, WORLDS[agents])
        with serving(Path(folder)) as address, chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            print(
                f"{'agents':>7}  {'':14}  {'median':>6}  {'slowest 5 %':>11}  {'pictures':>8}"
                f"  {'steps':>6}  per second"
            )
            for agents in options.agents:
                is_large = agents > MAX_RECORDED_AGENTS
                for name, setting in (FRAME_SETTINGS if is_large else SETTINGS).items():
                    rates = frames_a_second(
                        page,
                        f"{address}#/world?study={agents}&condition={CONDITION}{setting}",
                        options.seconds,
                    )
                    print(
                        f"{agents:7}  {name:14}  {rates.median:6.1f}  {rates.slow:11.1f}"
                        f"  {rates.pictures:8.1f}  {rates.steps:6.1f}",
                        flush=True,
                    )


def frames_a_second(page: Page, address: str, seconds: float) -> FrameRates:
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_selector("[data-ready]", timeout=300_000)
    # The rate of a simulation is measured during the first steps.
    page.wait_for_timeout(1500)
    counted = page.evaluate(COUNT_FRAMES, seconds)
    intervals = np.diff(counted["times"])
    duration = (counted["times"][-1] - counted["times"][0]) / 1000
    pictures = counted["pictures"]
    # A recording is drawn in each frame.
    is_recording = pictures[-1] is None and not page.locator(".streaming").count()
    changes = [is_recording or before != picture for before, picture in pairwise(pictures)]
    return FrameRates(
        median=1000 / float(np.median(intervals)),
        slow=1000 / float(np.quantile(intervals, 0.95)),
        pictures=sum(changes) / duration,
        steps=(counted["steps"][-1] - counted["steps"][0]) / duration,
    )


def make_study(directory: Path, agents: int, world: World) -> None:
    """Create a study of two conditions and one generation.

    Newborns are at the edge of the food, in one third of a large map.
    """
    is_large = agents > MAX_RECORDED_AGENTS
    changes: dict[str, Any] = {
        "population": {"size": agents},
        "lifetime": {"steps": world.steps},
        "evolution": {"generations": 1},
    }
    start: dict[str, Any] = {"x": 400, "y": 160}
    area = {}
    if is_large:
        start = {"x": 0.45 * world.side, "y": 0.5 * world.side, "radius": 0.3 * world.side}
        start["headings"] = "random"
        area = {
            "x": (0.5 * world.side, 0.98 * world.side),
            "y": (0.02 * world.side, 0.98 * world.side),
        }
    size = {"width": world.side, "height": world.side}
    experiments = []
    for name in ("evo/A", "evo+self-taught/A"):
        experiment = load(name)
        food = [
            region.model_copy(update={"count": world.items, **area})
            for region in experiment.world.food
        ]
        experiments.append(
            experiment.replace(**changes, world={**size, "start": start, "food": food})
        )
    study = create_study(directory, experiments, seed=0)
    run_study(study, find_missing_runs(study, 1, print), 1, progress, print)


@contextmanager
def serving(root: Path) -> Iterator[str]:
    """Serve the studies of a folder, and yield the address with the token."""
    access = Access()
    server = uvicorn.Server(
        uvicorn.Config(make_app(root, access), host="127.0.0.1", port=0, log_level="error")
    )
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            time.sleep(0.01)
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}/?token={access.token}"
    finally:
        server.should_exit = True
        thread.join()


# The programs that `make browser` accepts.
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")


@contextmanager
def chromium() -> Iterator[Browser]:
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=path, args=["--no-sandbox", "--disable-gpu"]
        )
        yield browser
        browser.close()


if __name__ == "__main__":
    main()
