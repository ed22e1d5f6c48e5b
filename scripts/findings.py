"""Measure the main findings of the pages: `python -m scripts.findings results/findings`.

The script simulates the missing studies of the folder, prints the tables of `README.md`, of the
gallery and of the pages of `le-2019` and `mayley-1996`, and draws the figure of the first finding.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy import stats

import baldwinlab as bl
from baldwinlab.analysis.assays.fork import compute_effects, name_quantity
from baldwinlab.analysis.estimands.quantitative_genetics import compute_differentials
from baldwinlab.analysis.figures.charts import EstimateStyle, draw_estimates
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, GRAY, render_figure, styled
from baldwinlab.analysis.palette import BLUE, ORANGE
from baldwinlab.analysis.statistics import compare, fitness, median_interval
from baldwinlab.analysis.statistics.bootstrap import Sample

PICTURE: Final = Path(__file__).parents[1] / "docs" / "pictures" / "history-and-regime.png"
# Maps of mayley-1996 by epistasis K.
RUGGEDNESS: Final = {0: "smooth", 5: "moderate", 10: "rugged"}
PAIRED_RUNS: Final = 40
RUNS: Final = 30
SEEDS: Final = (0, 4242)
LEARNERS: Final = ("evo", "evo+self-taught", "evo+random-targets", "evo+motor-noise")
VARIANTS: Final = {"literal": "visual radius 4", "standard": "visual radius 40"}
LABELS: Final = {
    "now": "learners minus control, last 10 generations",
    "regime": "regime: learning on minus off",
    "history": "history: learners minus control, learning off",
}
STYLES: Final = {
    "regime": EstimateStyle(ORANGE, size=6),
    "history": EstimateStyle(BLUE, "s", size=6),
}
CAPTION: Final = (
    f"Medians of the differences of {PAIRED_RUNS} pairs of runs, with 95 % bootstrap intervals. "
    "Bits climb NK landscapes during life, without a cost (mayley-1996)."
)


def measure_ruggedness(folder: Path, seed: int) -> dict[int, dict[str, Sample]]:
    """Return effects of free learning on innate fitness [run], by epistasis K and label.

    The unit is one hundredth of the innate fitness of the better genomes without learning.
    """
    learners = ("not-climbing", "climbing")
    names = [f"{learner}/{name}" for name in RUGGEDNESS.values() for learner in learners]
    study = bl.run(names, runs=PAIRED_RUNS, seed=seed, out=folder / f"ruggedness-seed-{seed}")
    innate = fitness.average_last(study.data()["innate"].astype(float).mean("agent"), 10)
    forks = {name: study.assay("fork", f"climbing/{name}") for name in RUGGEDNESS.values()}
    return {
        k: compute_percentages(
            forks[name].isel(generation=[-1]),
            innate.sel(condition=f"climbing/{name}") - innate.sel(condition=f"not-climbing/{name}"),
        )
        for k, name in RUGGEDNESS.items()
    }


def compute_percentages(fork: xr.Dataset, difference: xr.DataArray) -> dict[str, Sample]:
    """Return the effects of one landscape in percent, [run] by label. `fork`: one generation."""
    effects = compute_effects(fork)
    values = {"now": difference} | {
        name: effects[name_quantity(name, "innate_fitness")].isel(generation=0)
        for name in ("regime", "history")
    }
    # The scale of the estimands of the fork: the better of both histories.
    without_learning = fork["innate_fitness"].sel(regime="off").mean(("run", "agent"))
    scale = float(np.abs(without_learning).max())
    return {name: 100 * np.asarray(array, np.float64) / scale for name, array in values.items()}


@styled
def draw_ruggedness(effects: Mapping[int, Mapping[str, Sample]]) -> Figure:
    """Draw the effects of regime and history against K."""
    figure = Figure((FIGURE_WIDTH, 3.2))
    axes = figure.subplots()
    axes.axhline(0, color=GRAY, lw=0.8)
    for name, style in STYLES.items():
        samples = [effects[k][name] for k in RUGGEDNESS]
        ends = np.array([median_interval(sample) for sample in samples]).T
        draw_estimates(
            axes, [*RUGGEDNESS], [np.median(samples, axis=1), *ends], style, is_joined=True
        )
        axes.plot([], [], color=style.color, marker=style.marker, label=LABELS[name])
    axes.set_xticks([*RUGGEDNESS])
    axes.set(xlabel="epistasis K (0: one peak)", ylabel="change of innate fitness in %")
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def measure_first_paper(folder: Path) -> list[list[str]]:
    """Return the effects of self-teaching on map A by seed, of all seeds, and of `literal`."""
    names = ["evo/A", "evo+self-taught/A"]
    samples = []
    for seed in SEEDS:
        study = bl.run(names, runs=RUNS, seed=seed, out=folder / f"map-A-seed-{seed}")
        samples.append(study.data())
    rows = []
    groups = {f"seed {seed}": [data] for seed, data in zip(SEEDS, samples, strict=True)}
    literal = run_variant(folder, "literal").data(names)
    for title, data in (groups | {"both seeds": samples, "`literal`, seed 0": [literal]}).items():
        row = [title]
        for measure in ("best", "mean"):
            control, taught = (
                np.concatenate([fitness.final(d, measure).sel(condition=name) for d in data])
                for name in names
            )
            result = compare(taught, control)
            row.append(format_estimate(result.effect, result.low, result.high))
        rows.append([*row, str(len(control))])
    return rows


def measure_selection(folder: Path) -> list[list[str]]:
    """Return selection on innate fitness with self-teaching and without, on map A, by seed."""
    rows = []
    for seed in SEEDS:
        study = bl.open_study(folder / f"map-A-seed-{seed}")
        innate = study.assay("innate", "evo+self-taught/A")
        trait = innate["energy"].sel(life="off", drop=True).astype(float)
        selection = compute_differentials(innate, trait, study.experiment("evo+self-taught/A"))
        on, off = (selection[life].mean("generation").values for life in ("on", "off"))
        values = [format_median(sample) for sample in (on, off, on / off - 1)]
        rows.append([str(seed), *values, f"{(on > 0).sum()} of {len(on)}"])
    return rows


def measure_noise(folder: Path) -> list[list[str]]:
    """Return the items of the average agent under both visual radii, by map."""
    data = {variant: run_variant(folder, variant).data() for variant in VARIANTS}
    rows = []
    for name in "AB":
        for variant, title in VARIANTS.items():
            means = fitness.final(data[variant], "mean")
            cells = [means.sel(condition=f"{learner}/{name}").values for learner in LEARNERS]
            # The control with the larger median. Both controls have no information about food.
            best = max(cells[2:], key=np.median)
            result = compare(cells[1], best)
            effect = format_estimate(result.effect, result.low, result.high)
            effect = f"{effect}; p = {result.p:.2g}"
            rows.append([name, f"`{variant}` ({title})", *map(format_median, cells), effect])
    return rows


def run_variant(folder: Path, variant: str) -> bl.Study:
    """Run self-teaching and its noise controls on both maps under a variant of the first paper."""
    names = [f"{learner}/{name}" for name in "AB" for learner in LEARNERS]
    experiments = [bl.load(name, variant) for name in names]
    return bl.run(experiments, runs=RUNS, out=folder / f"noise-{variant}")


def format_median(sample: Sample) -> str:
    return format_estimate(float(np.median(sample)), *median_interval(sample))


def format_estimate(value: float, low: float, high: float) -> str:
    return f"{value:.3g} [{low:.3g}, {high:.3g}]"


def count_signs(sample: Sample) -> str:
    """Return the numbers of values above, below and equal to 0, and p of the sign test."""
    above, below = int((sample > 0).sum()), int((sample < 0).sum())
    p = stats.binomtest(above, above + below).pvalue
    return f"{above}, {below}, {sample.size - above - below}; p = {p:.2g}"


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table in Markdown."""
    for row in (columns, ["---"] * len(columns), *rows):
        print(f"| {' | '.join(row)} |")
    print()


def main(folder: Path) -> None:
    effects = {seed: measure_ruggedness(folder, seed) for seed in SEEDS}
    rows = [
        [
            *(str(seed), str(k)),
            *(format_median(samples[name]) for name in LABELS),
            count_signs(samples["history"]),
        ]
        for seed, effects_of_seed in effects.items()
        for k, samples in effects_of_seed.items()
    ]
    columns = ["seed", "K", *LABELS.values(), "pairs with a history above 0, below 0, equal"]
    print_table(columns, rows)
    PICTURE.write_bytes(render_figure(draw_ruggedness(effects[SEEDS[0]]), "png", CAPTION))
    columns = ["runs of", "best agent", "average agent", "number of runs"]
    print_table(columns, measure_first_paper(folder))
    columns = ["seed", "S_on", "S_off", "S_on / S_off - 1", "runs with S_on above 0"]
    print_table(columns, measure_selection(folder))
    learners = [f"`{name}`" for name in LEARNERS]
    columns = ["map", "variant", *learners, "self-taught minus the best control"]
    print_table(columns, measure_noise(folder))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
