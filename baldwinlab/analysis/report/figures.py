"""The report's figures: drawn, kept as files, and put into the page with a caption and a text for those who cannot see them."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure as Drawing

from baldwinlab.analysis import figures
from baldwinlab.analysis.claims import ClaimResult, compared
from baldwinlab.analysis.report import content
from baldwinlab.analysis.report.content import Experiments, foragers, worlds
from baldwinlab.analysis.report.phrases import number
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.csv import to_csv
from baldwinlab.core.files import write_atomically
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import of_study
from baldwinlab.papers import Paper, load
from baldwinlab.papers.texts import FIGURES, Figure

Looks = Mapping[
    str, figures.Look
]  # of conditions of foragers, by name, as far as their parts are here
NARROW, SLIM = 4.0, 6.0  # inches
OF_ANY_MODEL = (
    "shares",
    "clocks",
    "measures",
    "survival",
)  # figures of what only models other than the foragers record
EXPLAINING = ("networks", "senses", "maps")  # figures that say what was run, not what came of it
SUMMING_UP = ("overview",)  # figures that stand at the head of a report


class Picture(NamedTuple):
    name: str
    title: str
    caption: str
    alternative: str
    figure: Drawing
    table: Sequence[Mapping[str, Any]] = ()  # its numbers, a row each
    again: Sequence[str] = ()  # commands that live again what it shows, in the study's folder


def pictures(
    dataset: xr.Dataset,
    results: Sequence[ClaimResult],
    traces: Sequence[xr.Dataset],
    conditions: Experiments,
    last: int,
    paper: Paper | None,
    looks: Looks,
) -> Iterator[Picture]:
    """Draw the figures of the paper in its order, or without a paper those of any study, as far as there is data."""
    foraging = foragers(conditions)
    names = paper.about.figures if paper else FIGURES
    captions = paper.words.captions if paper else {}
    shares = content.shares(dataset, conditions) if "shares" in names else xr.Dataset()
    clock = content.clock(conditions)
    measured = (
        [figures.MeasureValues(*one) for one in compared(dataset, paper)]
        if paper and "measures" in names
        else []
    )
    there = {
        "emergence": bool(traces),
        "maps": bool(foraging),
        "senses": bool(looks),
        "networks": bool(looks),
    }
    there |= {"shares": bool(shares), "clocks": bool(clock), "measures": bool(measured)}
    draw: Mapping[Figure, Callable[[], Picture]] = {
        "overview": lambda: _overview(dataset, results, last),
        "fitness": lambda: _fitness(dataset, last),
        "final-fitness": lambda: _final_fitness(dataset, results, last),
        "emergence": lambda: _emergence(dataset, traces),
        "networks": lambda: _networks(dataset, foraging, looks, paper or load()),
        "maps": lambda: _maps(dataset, foraging, looks),
        "senses": lambda: _senses(looks),
        "shares": lambda: _shares(shares),
        "clocks": lambda: _clocks(dataset, clock),
        "measures": lambda: _measures(dataset, measured),
        "survival": lambda: _survival(dataset),
    }
    for name in names:
        if there.get(name, True):
            picture = draw[name]()
            beside = captions.get(name) if foraging or name in OF_ANY_MODEL else None
            yield picture._replace(caption=" ".join(filter(None, [picture.caption, beside])))


def _overview(dataset: xr.Dataset, results: Sequence[ClaimResult], last: int) -> Picture:
    standings = figures.overview_cells(dataset, results, last)
    return Picture(
        "overview",
        "Who forages where",
        f"{_of_whom(dataset, 'average')}, mean over the last {last} generations, the median over runs; the darker, the nearer "
        "to the best of that map. A triangle stands where a claim says that this is greater than something else: up where it "
        "holds, down where it does not; none where that is undecided.",
        final_medians(dataset, last),
        figures.draw_overview({"": standings}),
        [one._asdict() for one in standings],
    )


def _fitness(dataset: xr.Dataset, last: int) -> Picture:
    return Picture(
        "fitness",
        "Fitness over generations",
        f"{_of_whom(dataset, 'best', 'average')} of each generation: mean over runs, and the "
        "95 % interval of that mean (Student's t) as a band.",
        f"Curves of fitness by generation for each condition. {final_medians(dataset, last)}",
        figures.draw_fitness_curves(dataset),
        [row for measure in ("best", "mean") for row in _over_generations(dataset, measure)],
        _typical_lives(dataset),
    )


def _over_generations(dataset: xr.Dataset, measure: str) -> list[dict[str, Any]]:
    """Mean over runs and its interval: a row a condition and generation in which anybody lived."""
    average, low, high = fitness.interval_of_mean(fitness.MEASURES[measure](dataset))
    numbers = xr.Dataset({"mean": average, "low": low, "high": high})[["mean", "low", "high"]]
    table = numbers.reset_coords(drop=True).to_dataframe().dropna(how="all").reset_index()
    return [
        {"condition": row.pop("condition"), "measure": measure, **row}
        for row in table.to_dict("records")
    ]


def _typical_lives(dataset: xr.Dataset) -> list[str]:
    """The commands that show a typical life of each condition of foragers at last."""
    if "food_eaten" not in dataset:
        return []
    lived = dataset["energy"].notnull().any(("run", "agent"))
    last = {
        str(name): lived.sel(condition=name)
        for name in dataset["condition"].values
        if bool(lived.sel(condition=name).any())
    }
    return [
        replayed(name, fitness.typical_run(dataset, name), int(there["generation"][there][-1]))
        for name, there in last.items()
    ]


def _of_whom(dataset: xr.Dataset, *whom: str) -> str:
    """What is shown, and of whom: the energy of foragers, or what another model calls it."""
    if "food_eaten" in dataset:
        return f"Energy of the items eaten by {' and by '.join(f'the {one} agent' for one in whom)}"
    gain = str(dataset["energy"].attrs.get("long_name", "fitness"))
    return f"{gain[0].upper()}{gain[1:]} of {' and of '.join(f'the {one} agent' for one in whom)}"


def _final_fitness(dataset: xr.Dataset, results: Sequence[ClaimResult], last: int) -> Picture:
    claimed = any(result.findings for result in results)
    brackets = (
        " Brackets: p of the Mann-Whitney test, corrected for all claims (Holm)." if claimed else ""
    )
    return Picture(
        "final-fitness",
        f"Fitness in the last {last} generations",
        "Each point is a run, averaged over these generations. Box: quartiles, with the median as the thick line; whiskers reach "
        f"the farthest run within 1.5 times the box.{brackets}",
        f"Box plots of final fitness by condition. {final_medians(dataset, last)}",
        figures.draw_fitness_boxes(dataset, results, last),
        _final_of_runs(dataset, last),
    )


def _final_of_runs(dataset: xr.Dataset, last: int) -> list[dict[str, Any]]:
    """A row a condition and run that was lived."""
    numbers = xr.Dataset(
        {measure: fitness.final(dataset, measure, last) for measure in ("best", "mean")}
    )
    return [
        *numbers.reset_coords(drop=True)
        .to_dataframe()
        .dropna(how="all")
        .reset_index()
        .to_dict("records")
    ]


def _shares(shares: xr.Dataset) -> Picture:
    said = "; ".join(f"{name}: {share.attrs['long_name']}" for name, share in shares.items())
    rows = [
        {
            "condition": str(condition),
            "share": str(name),
            "generation": int(generation),
            "mean": float(value),
        }
        for name, share in shares.items()
        for condition, values in share.mean("run").groupby("condition")
        for generation, value in zip(
            shares["generation"].values, values.values.ravel(), strict=True
        )
    ]
    return Picture(
        "shares",
        "What generations are made of",
        f"Mean over agents and runs, and the 95 % interval of the mean over runs (Student's t) as a band. {said}.",
        f"Curves by generation for each condition: {said}.",
        figures.draw_shares(shares),
        rows,
    )


def _measures(dataset: xr.Dataset, found: Sequence[figures.MeasureValues]) -> Picture:
    medians = [
        f"{one.meaning}: {', '.join(f'{name} {number(float(np.median(of)))}' for name, of in one.values.items() if of.size)}"
        for one in found
    ]
    return Picture(
        "measures",
        "What the claims compare",
        "Each point is a run. Box: quartiles, with the median as the thick line; whiskers reach the farthest run within 1.5 "
        "times the box.",
        f"Box plots by condition, with medians over runs: {'; '.join(medians)}.",
        figures.draw_measures(dataset, found),
        [
            {"condition": name, "measure": one.name, "value": value}
            for one in found
            for name, of in one.values.items()
            for value in of.tolist()
        ],
    )


def _clocks(dataset: xr.Dataset, used: str) -> Picture:
    return Picture(
        "clocks",
        "Two clocks",
        "Fitness of the average agent, mean over runs: by generation, and by how often all agents of a run had asked their world "
        "until then. Learning asks often within one generation.",
        f"The same curves of fitness, once by generations and once by evaluations. {final_medians(dataset, 1)}",
        figures.draw_clocks(dataset, used),
    )


def _survival(dataset: xr.Dataset) -> Picture:
    return Picture(
        "survival",
        "Who survives",
        "The share of runs that survive, by time; a curve that does not come down has runs that live still at the end.",
        f"Curves of survival for each condition. {final_medians(dataset, 1)}",
        figures.draw_survival(dataset),
        _final_of_runs(dataset, 1),
    )


def _maps(dataset: xr.Dataset, conditions: Experiments, looks: Looks) -> Picture:
    named = worlds(conditions, of_study(dataset))
    found = {title: conditions[name].world for title, name in named.items()}
    known = {title: looks[name] for title, name in named.items() if name in looks}
    return Picture(
        "maps",
        "The maps",
        "To scale, in units of length, y pointing down; what leaves the map at one edge enters at the opposite one. Places of "
        "agents (blue, with a line in the direction of their heading) and items are examples.",
        "; ".join(
            f"{title}: agents start round ({world.start.x:g}, {world.start.y:g})"
            for title, world in found.items()
        )
        + ".",
        figures.draw_world_maps(
            found, min(experiment.population.size for experiment in conditions.values()), known
        ),
    )


def _emergence(dataset: xr.Dataset, traces: Sequence[xr.Dataset]) -> Picture:
    condition, run = str(traces[0].attrs["condition"]), int(traces[0].attrs["run"])
    why = (
        ", the one nearest to the median in final mean fitness"
        if fitness.typical_run(dataset, condition) == run
        else ""
    )
    counts = ", ".join(
        f"generation {trace.attrs['generation']}: {int((trace['eaten'].sum('step') > 0).sum())} of {trace.sizes['agent']}"
        for trace in traces
    )
    return Picture(
        "emergence",
        "The emergence of foraging",
        f"{condition}, run {run}{why}. Above: where all agents together spent their life, the darker the longer, all in one "
        "scale; the circle is where they are born, rectangles are where items lie. Below: the share of agents that ate at least "
        "one item, mean over runs with its 95 % interval.",
        f"Maps of where the agents were, at several generations. Agents that ate: {counts}.",
        figures.draw_emergence(dataset, traces),
        [row for row in _over_generations(dataset, "share") if row["condition"] == condition],
        [replayed(condition, run, int(trace.attrs["generation"])) for trace in traces],
    )


def _networks(dataset: xr.Dataset, conditions: Experiments, looks: Looks, paper: Paper) -> Picture:
    kinds: dict[str, figures.AgentKind] = {}
    for name, found in of_study(dataset).items():
        if name in looks and name in conditions:
            kinds.setdefault(found.learner, _kind(found.learner, conditions[name], looks[name]))
    described = {
        learner: kind
        for kind in ("conditions", "controls")
        for learner in paper.names(kind)
        if learner in kinds
    }
    said = " ".join(
        f"{learner}: {paper.describe(kind, learner)}." for learner, kind in described.items()
    )
    return Picture(
        "networks",
        "Who lives there",
        "What an agent senses (orange) goes through its action module, whose strongest output is what it does. A second network, "
        f"where there is one, senses the same and stays as it was born; learning changes the first by its answers. {said}",
        "; ".join(
            f"{kind.name}: {', '.join(kind.lines)}; {' and '.join(kind.modules)}"
            for kind in kinds.values()
        )
        + ".",
        figures.draw_networks(list(kinds.values())),
    )


def _kind(learner: str, experiment: Experiment, look: figures.Look) -> figures.AgentKind:
    inherits = experiment.evolution.inheritance != "none"
    lines = (
        "evolves: inherits weights"
        if inherits
        else "does not evolve: all weights\ndrawn anew at birth",
        f"learns in life: {experiment.learning.rule}" if experiment.learns else "does not learn",
    )
    return figures.AgentKind(
        learner, lines, look["inputs"], experiment.network.hidden, look["actions"], look["modules"]
    )


def _senses(looks: Looks) -> Picture:
    name, look = next(iter(looks.items()))
    found = [(" and ".join(names), *place) for place, names in figures.group_sectors(look).items()]
    looking = [
        f"{names} from {first:g} to {past:g} degrees, to {radius:g} units"
        for names, first, past, radius in found
    ]
    elsewhere = [
        each for each, sector in zip(look["inputs"], look["sectors"], strict=True) if not sector
    ]
    others = f" Inputs that look nowhere: {', '.join(elsewhere)}." if elsewhere else ""
    shown = f" The item lies where {found[-1][0]} looks." if found else ""
    return Picture(
        "senses",
        "What an agent senses",
        f"To scale, as in {name}: the sectors in which inputs look. The agent heads to the right of the page, its right hand is "
        f"below.{shown}{others}",
        f"An agent and its sectors, clockwise from where it heads: {'; '.join(looking) or 'none'}.",
        figures.draw_agent_senses(look),
    )


def final_medians(dataset: xr.Dataset, last: int) -> str:
    """For those who cannot see the picture: the median over runs of the final mean fitness of each condition."""
    medians = fitness.final(dataset, "mean", last).median("run")
    values = [
        f"{name} {number(float(medians.sel(condition=name)))}"
        for name in medians["condition"].values
    ]
    return f"Average agent at last, median over runs: {', '.join(values)}."


def embed(picture: Picture, folder: Path) -> dict[str, Any]:
    """Keep the picture in `folder` as SVG and PNG, its numbers as CSV, and give what the page needs to show it without them."""
    drawing = figures.save_figure(picture.figure, folder, picture.name)
    files = {"SVG": f"{picture.name}.svg", "PNG": f"{picture.name}.png"}
    if picture.table:
        files["CSV"] = f"{picture.name}.csv"
        columns = dict.fromkeys(column for row in picture.table for column in row)
        write_atomically(folder / files["CSV"], to_csv(list(columns), picture.table))
    width, height = picture.figure.get_size_inches()
    shape = (
        ["narrow"]
        if width < NARROW
        else [*(["slim"] if width < SLIM else []), *(["tall"] if height > width else [])]
    )
    return {
        "name": picture.name,
        "title": picture.title,
        "caption": picture.caption,
        "alternative": picture.alternative,
        "shape": " ".join(shape),
        "source": f"data:image/svg+xml;base64,{b64encode(drawing).decode('ascii')}",
        "files": files,
        "again": picture.again,
    }


def replayed(condition: str, run: int, generation: int) -> str:
    """The command that lives a life of the study again."""
    return f"baldwinlab replay . --condition {condition} --run {run} --generation {generation} --out life.mp4"
