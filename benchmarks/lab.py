"""Measure the frame rate of the lab: `python -m benchmarks.lab [--seconds 5]`.

The command needs the extra `lab`, playwright and Chromium. It prints frames per second in headless
Chromium, at most 60: the median, and the slowest 5 %.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

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
STEPS = 3000
# Number of agents, and of items.
WORLDS = {20: 50, 1000: 500}
SETTINGS = {
    "plays at 10x": "&speed=10",
    "plays at 100x": "&speed=100",
    "full trails": "&speed=100&trails=life",
    "an agent open": "&speed=10&agent=3",
    "side by side": "&speed=10&b.condition=evo/A",
}
COUNT_FRAMES = """seconds => new Promise(done => {
  const times = [];
  const frame = now => {
    times.push(now);
    now - times[0] < 1000 * seconds ? requestAnimationFrame(frame) : done(times);
  };
  requestAnimationFrame(frame);
})"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=5, help="duration of each setting, in seconds"
    )
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory() as folder:
        for agents, items in WORLDS.items():
            make_study(Path(folder) / str(agents), agents, items)
        with serving(Path(folder)) as address, chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            print(f"{'agents':>6}  {'':14}  {'median':>6}  {'slowest 5 %':>11}  frames a second")
            for agents in WORLDS:
                for name, options in SETTINGS.items():
                    middle, slow = frames_a_second(
                        page,
                        f"{address}#/world?study={agents}&condition={CONDITION}{options}",
                        seconds,
                    )
                    print(f"{agents:6}  {name:14}  {middle:6.1f}  {slow:11.1f}", flush=True)


def frames_a_second(page: Page, address: str, seconds: float) -> tuple[float, float]:
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_selector("[data-ready]")
    page.wait_for_timeout(500)
    intervals = np.diff(page.evaluate(COUNT_FRAMES, seconds))
    return 1000 / float(np.median(intervals)), 1000 / float(np.quantile(intervals, 0.95))


def make_study(directory: Path, agents: int, items: int) -> None:
    """Create a study of two conditions and one generation; newborns are at the edge of the food."""
    changes: dict[str, Any] = {
        "population": {"size": agents},
        "lifetime": {"steps": STEPS},
        "evolution": {"generations": 1},
    }
    experiments = []
    for name in ("evo/A", "evo+self-taught/A"):
        experiment = load(name)
        food = [region.model_copy(update={"count": items}) for region in experiment.world.food]
        experiments.append(
            experiment.replace(**changes, world={"start": {"x": 400, "y": 160}, "food": food})
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
