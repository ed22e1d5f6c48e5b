"""Draw the pictures of papers: `python -m scripts.gallery_pictures [PAPER ...]`.

The script runs each paper, and draws its picture for docs/ and a small one, `card.png`, for its
folder. If a paper takes too long, its card is cut from a picture in docs/.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

import baldwinlab as bl
from baldwinlab import papers
from baldwinlab.analysis import figures
from baldwinlab.analysis.claim_samples import Samples
from baldwinlab.analysis.report import content
from baldwinlab.analysis.statistics.proportions import estimate_probability
from baldwinlab.experiment.species_measures import SPECIES_MEASURES
from baldwinlab.models.plastic_elements import find_innate_times
from baldwinlab.papers.paper import CARD_FILE
from tests.oracles.theory.reaction_norm import Setting, solve_means

PICTURES: Final = Path(__file__).parents[1] / "docs" / "pictures"
# Pixels of a card.
CARD_WIDTH = 640
CARD_HEIGHT = 320
# Numbers of colors of a card. The first number that gives at most MAX_CARD_BYTES is used.
CARD_COLORS: Final = (128, 64, 32)
MAX_CARD_BYTES: Final = 30_000


def _draw_shares(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    conditions = {experiment.name: experiment for experiment in experiments}
    return figures.draw_shares(content.compute_shares(dataset, conditions))


def _draw_curves(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    return figures.draw_fitness_curves(dataset)


def _make_draw_measures(name: str) -> Callable[[xr.Dataset, Sequence[Any]], Figure]:
    paper = papers.load(name)
    return lambda study, experiments: figures.draw_measures(
        study,
        [figures.MeasureValues(*measure) for measure in Samples(study, 1, paper).model_measures()],
    )


def _draw_survival(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    return figures.draw_survival(dataset)


def _draw_fixation_probabilities(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    """Draw the fixation probability of each condition, with its 95 % interval."""
    names = [experiment.name for experiment in experiments]
    fixations = SPECIES_MEASURES["fixation"].of(dataset).sel(condition=names)
    estimates = [estimate_probability(values) for values in fixations.values]
    probabilities, lows, highs = np.transpose(estimates)
    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes = figure.subplots()
    positions = range(len(names))
    errors = (probabilities - lows, highs - probabilities)
    axes.errorbar(probabilities, positions, xerr=errors, fmt="o", capsize=3)
    neutral_probability = 1 / experiments[0].population.size
    axes.axvline(neutral_probability, color="gray", linestyle="--")
    axes.set_yticks(positions, names)
    axes.invert_yaxis()
    axes.set_xlabel("fixation probability (dashed: neutral, 1/N)")
    return figure


def _draw_searches(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    """Draw the share of the global optimum, or the best fitness, of each search and function."""
    figure = Figure(figsize=(8, 2.8), layout="constrained")
    # The label and the values of each panel.
    panels = {
        "deceptive": ("born as the global optimum", dataset["optimum"].mean("agent")),
        "rastrigin": ("best fitness", dataset["learned"].max("agent")),
        "schwefel": ("best fitness", dataset["learned"].max("agent")),
    }
    all_axes = figure.subplots(1, len(panels))
    for axes, (function, (label, measure)) in zip(all_axes, panels.items(), strict=True):
        for search in ("genetic-search", "baldwinian", "lamarckian"):
            values = measure.sel(condition=f"{search}/{function}")
            middle, low, high = (values.quantile(q, "run").values for q in (0.5, 0, 1))
            axes.plot(middle, label=search)
            axes.fill_between(range(middle.size), low, high, alpha=0.2)
        axes.set(title=function, xlabel="generation", ylabel=label)
    lines = all_axes[0].get_legend_handles_labels()
    figure.legend(*lines, loc="outside upper center", ncols=3)
    return figure


def _draw_innate_times(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    """Draw the generation in which each element becomes innate, by its predicted selection."""
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    panels = figure.subplots(2, 3, sharey=True)
    for axes, experiment in zip(panels.flat, experiments, strict=True):
        model = experiment.model_part
        runs = dataset.sel(condition=experiment.name)
        last = runs.sizes["generation"] - 1
        # An element that does not become innate is drawn at the last generation.
        times = np.minimum(find_innate_times(runs, model.n_elements), last)
        median = np.median(times, axis=0)
        low, high = np.quantile(times, [0.25, 0.75], axis=0)
        selection = model.predicted_selection()
        axes.errorbar(selection, median, (median - low, high - median), fmt="o", capsize=2)
        axes.set_title(experiment.name, loc="left")
        axes.set_xlim(0, None)
        axes.margins(x=0.1)
    figure.supxlabel("predicted selection on the innate allele", fontsize="medium")
    figure.supylabel("generation in which the element is innate", fontsize="medium")
    return figure


def _draw_reaction_norms(dataset: xr.Dataset, experiments: Sequence[Any]) -> Figure:
    """Draw the mean slope and intercept over the generations, with the closed form."""
    figure = Figure(figsize=(6.4, 3.0), layout="constrained")
    panels = figure.subplots(1, 2)
    for index, experiment in enumerate(experiments):
        model = experiment.model_part
        runs = dataset.sel(condition=experiment.name)
        for axes, record, column in zip(panels, ("slope", "intercept"), (1, 0), strict=True):
            mean = runs[record].astype(np.float64).mean(("agent", "run"))
            n_generations = mean.sizes["generation"]
            # Generations at equal distances on the logarithmic axis.
            shown = np.unique(np.geomspace(1, n_generations, 80).astype(int)) - 1
            axes.plot(shown + 1, mean[shown], color=f"C{index}", label=experiment.name)
            if model.learns:
                start = np.array([0.0, model.predictability * model.optimum_slope])
                expected = solve_means(_reaction_norm_setting(model), start, n_generations - 1)
                generations = np.arange(2, n_generations + 1)
                axes.plot(generations, expected[:, column], color="black", lw=1, ls=":")
            axes.set(title=f"mean {record}", xlabel="generation + 1 (dotted: closed form)")
            axes.set_xscale("log")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _reaction_norm_setting(model: Any) -> Setting:
    return Setting(
        optimum_slope=model.optimum_slope,
        peak_variance=model.peak_width**2,
        intercept_variance=model.intercept_std**2,
        slope_variance=model.slope_std**2,
        jump=model.jump,
        noise_variance=model.noise_std**2,
        predictability=model.predictability,
        cost=model.plasticity_cost,
    )


DRAW_PICTURE: Final[dict[str, Callable[[xr.Dataset, Sequence[Any]], Figure]]] = {
    "hinton-nowlan-1987": _draw_shares,
    "keesing-stork-1991": _make_draw_measures("keesing-stork-1991"),
    "todd-miller-1991": _make_draw_measures("todd-miller-1991"),
    "ackley-littman-1991": _draw_survival,
    "nolfi-parisi-1993": _draw_curves,
    "nolfi-elman-parisi-1994": _draw_curves,
    "whitley-1994": _draw_searches,
    "mayley-1996": _draw_shares,
    "floreano-urzelai-2000": _draw_shares,
    "stanley-miikkulainen-2002": _draw_curves,
    "suzuki-arita-2004": _draw_shares,
    "borenstein-2006": _make_draw_measures("borenstein-2006"),
    "lande-2009": _draw_reaction_norms,
    "mery-kawecki-2004": _make_draw_measures("mery-kawecki-2004"),
    "paenke-2007": _make_draw_measures("paenke-2007"),
    "soltoggio-2008": _draw_curves,
    "le-2018": _draw_shares,
    "lange-sprekeler-2020": _draw_shares,
    "morgan-2020": _draw_innate_times,
    "invasion": _draw_fixation_probabilities,
    "predators-and-prey": _make_draw_measures("predators-and-prey"),
}
# The panel on the card. The default is the first panel.
CARD_PANELS: Final = {
    "mayley-1996": 1,
    "nolfi-parisi-1993": 1,
    "nolfi-elman-parisi-1994": 1,
    "predators-and-prey": 1,
    "lange-sprekeler-2020": 4,
    "morgan-2020": 2,
}
# A picture in docs/, and the left, upper, right and lower edge of the card in the picture.
CARD_CROPS: Final = {
    "le-2019": ("emergence.png", (22, 58, 947, 510)),
    "worlds-and-minds": ("worlds-and-minds.png", (0, 455, 790, 818)),
}


def main() -> None:
    for name in sys.argv[1:] or [*DRAW_PICTURE, *CARD_CROPS]:
        paper = papers.load(name)
        if name in CARD_CROPS:
            picture, edges = CARD_CROPS[name]
            (paper.folder / CARD_FILE).write_bytes(
                _encode_card(Image.open(PICTURES / picture).crop(edges))
            )
            continue
        experiments = paper.experiments()
        with TemporaryDirectory() as folder:
            bl.run(experiments, runs=paper.metadata.runs, out=Path(folder) / "study")
            figure = DRAW_PICTURE[name](bl.open_runs(Path(folder) / "study"), experiments)
            figures.save_figure(figure, Path(folder), name)
            (PICTURES / f"{name}.png").write_bytes((Path(folder) / f"{name}.png").read_bytes())
        (paper.folder / CARD_FILE).write_bytes(_draw_card(figure, CARD_PANELS.get(name, 0)))


def _draw_card(figure: Figure, panel: int) -> bytes:
    """Return one panel of a figure, without text."""
    card_axes = figure.axes[panel]
    for axes in [*figure.axes]:
        if axes is not card_axes:
            axes.remove()
    for artist in [*figure.legends, *figure.texts]:
        artist.remove()
    card_axes.set(title="", xlabel="", ylabel="")
    card_axes.set_title("", loc="left")
    card_axes.tick_params(labelbottom=False, labelleft=False)
    figure.set_layout_engine("none")
    figure.set_size_inches(CARD_WIDTH / 200, CARD_HEIGHT / 200)
    card_axes.set_position((0.03, 0.05, 0.94, 0.9))
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=200)
    return _encode_card(Image.open(drawn))


def _encode_card(picture: Image.Image) -> bytes:
    """Return a picture in the size of a card, with few colors."""
    resized = picture.convert("RGB").resize((CARD_WIDTH, CARD_HEIGHT), Image.Resampling.LANCZOS)
    for colors in CARD_COLORS:
        file = io.BytesIO()
        resized.quantize(colors).save(file, "png", optimize=True)
        if file.tell() <= MAX_CARD_BYTES:
            break
    return file.getvalue()


if __name__ == "__main__":
    main()
