"""Figures of a report: drawn, saved as files, and embedded in the page with a caption."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np
import xarray as xr

from baldwinlab.analysis import figures
from baldwinlab.analysis.report import content
from baldwinlab.analysis.report.content import select_foragers, title_worlds
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.embedding import ReportFigure
from baldwinlab.analysis.report.phrases import format_number
from baldwinlab.analysis.statistics import curve_intervals, fitness
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import of_study
from baldwinlab.papers import load
from baldwinlab.papers.texts import FIGURES, Figure

# Figures that models other than MiniWorld record.
OF_ANY_MODEL: Final = ("shares", "clocks", "measures", "survival")
# Figures that show what was run. The section "What was run" shows them.
EXPLAINING: Final = ("networks", "senses", "maps")
# Figures at the top of a report.
SUMMING_UP: Final = ("overview",)
BOXES: Final = (
    "Each point is a run. The box shows the quartiles, and its thick line the median. Whiskers "
    "extend to the most distant run within 1.5 times the interquartile range."
)


def draw_figures(report: ReportData) -> Iterator[ReportFigure]:
    """Draw the figures of a report.

    Parameters
    ----------
    report : ReportData
        The study and its results.

    Yields
    ------
    ReportFigure
        The figures that apply to the study: those of its paper, or the standard ones.
    """
    names = report.paper.metadata.figures if report.paper else FIGURES
    captions = report.paper.words.captions if report.paper else {}
    is_foraging = bool(select_foragers(report.experiments))
    for name in names:
        drawn = DRAW[name](report)
        if drawn:
            has_caption = name in captions and (is_foraging or name in OF_ANY_MODEL)
            addition = captions[name] if has_caption else ""
            yield drawn._replace(caption=f"{drawn.caption} {addition}".rstrip())


def _draw_overview(report: ReportData) -> ReportFigure:
    standings = figures.overview_cells(report.data, report.results, report.last)
    measure = _name_fitness(report.data, "average")
    return ReportFigure(
        "overview",
        "Fitness by learner and map",
        f"{measure}, mean over the last {report.last} generations, median over runs. Darker cells "
        "are closer to the highest value of their map. A triangle marks a condition that a claim "
        "compares: it points up if the claim holds, and down if it does not hold.",
        describe_final_medians(report.data, report.last),
        figures.draw_overview({"": standings}),
        [cell._asdict() for cell in standings],
    )


def _draw_fitness(report: ReportData) -> ReportFigure:
    data = report.data
    return ReportFigure(
        "fitness",
        "Fitness over generations",
        f"{_name_fitness(data, 'best', 'average')} of each generation. Lines are means over runs. "
        "Bands are 95 % intervals of the mean (Student's t).",
        "Curves of fitness by generation for each condition. "
        f"{describe_final_medians(data, report.last)}",
        figures.draw_fitness_curves(data),
        [row for measure in ("best", "mean") for row in _tabulate_generations(data, measure)],
        _list_typical_replays(data),
    )


def _tabulate_generations(data: xr.Dataset, measure: str) -> list[dict[str, Any]]:
    """Return the mean over runs and its interval: one row per condition and generation."""
    average, low, high = curve_intervals.interval_of_mean(fitness.MEASURES[measure](data))
    numbers = xr.Dataset({"mean": average, "low": low, "high": high})[["mean", "low", "high"]]
    table = numbers.reset_coords(drop=True).to_dataframe().dropna(how="all").reset_index()
    return [
        {"condition": row.pop("condition"), "measure": measure, **row}
        for row in table.to_dict("records")
    ]


def _list_typical_replays(data: xr.Dataset) -> list[str]:
    """Return the commands that replay the last generation of a typical run of each condition."""
    if "food_eaten" not in data:
        return []
    has_data = data["energy"].notnull().any(("run", "agent"))
    commands = []
    for name in map(str, data["condition"].values):
        present = has_data.sel(condition=name)
        if bool(present.any()):
            generation = int(present["generation"][present][-1])
            run = fitness.typical_run(data, name)
            commands.append(format_replay_command(name, run, generation))
    return commands


def _name_fitness(data: xr.Dataset, *agents: str) -> str:
    """Return the name of fitness, for example "Energy of the items eaten by the best agent"."""
    if "food_eaten" in data:
        names = " and by ".join(f"the {agent} agent" for agent in agents)
        return f"Energy of the items eaten by {names}"
    names = " and of ".join(f"the {agent} agent" for agent in agents)
    gain = str(data["energy"].attrs.get("long_name", "fitness"))
    return f"{gain[0].upper()}{gain[1:]} of {names}"


def _draw_final_fitness(report: ReportData) -> ReportFigure:
    has_claims = any(result.findings for result in report.results)
    brackets = (
        " Brackets show the Mann-Whitney p-value, corrected for all claims (Holm)."
        if has_claims
        else ""
    )
    return ReportFigure(
        "final-fitness",
        f"Fitness in the last {report.last} generations",
        f"Fitness, averaged over the last {report.last} generations of each run. {BOXES}{brackets}",
        "Box plots of final fitness by condition. "
        f"{describe_final_medians(report.data, report.last)}",
        figures.draw_fitness_boxes(report.data, report.results, report.last),
        _tabulate_runs(report.data, report.last),
    )


def _tabulate_runs(data: xr.Dataset, last: int) -> list[dict[str, Any]]:
    """Return the final fitness: one row per condition and finished run."""
    finals = {measure: fitness.final(data, measure, last) for measure in ("best", "mean")}
    table = xr.Dataset(finals).reset_coords(drop=True).to_dataframe()
    return [*table.dropna(how="all").reset_index().to_dict("records")]


def _draw_shares(report: ReportData) -> ReportFigure | None:
    shares = content.compute_shares(report.data, report.experiments)
    if not shares:
        return None
    meanings = "; ".join(f"{name}: {share.attrs['long_name']}" for name, share in shares.items())
    return ReportFigure(
        "shares",
        "Composition of the generations",
        "Lines are means over agents and runs. Bands are 95 % intervals of the mean over runs "
        f"(Student's t). {meanings}.",
        f"Curves by generation for each condition: {meanings}.",
        figures.draw_shares(shares),
        _tabulate_shares(shares),
    )


def _tabulate_shares(shares: xr.Dataset) -> list[dict[str, Any]]:
    generations = shares["generation"].values
    rows = []
    for name, share in shares.items():
        for condition, values in share.mean("run").groupby("condition"):
            for generation, value in zip(generations, values.values.ravel(), strict=True):
                row = {"condition": str(condition), "share": str(name)}
                rows.append(row | {"generation": int(generation), "mean": float(value)})
    return rows


def _draw_measures(report: ReportData) -> ReportFigure | None:
    if not report.model_measures:
        return None
    measures = [figures.MeasureValues(*measure) for measure in report.model_measures]
    medians = []
    rows = []
    for measure in report.model_measures:
        values = {name: sample for name, sample in measure.values.items() if sample.size}
        texts = [
            f"{name} {format_number(float(np.median(sample)))}" for name, sample in values.items()
        ]
        medians.append(f"{measure.meaning}: {', '.join(texts)}")
        for name, sample in values.items():
            row = {"condition": name, "measure": measure.name}
            rows += [row | {"value": value} for value in sample.tolist()]
    return ReportFigure(
        "measures",
        "Measures that the claims compare",
        BOXES,
        f"Box plots by condition, with medians over runs: {'; '.join(medians)}.",
        figures.draw_measures(report.data, measures),
        rows,
    )


def _draw_clocks(report: ReportData) -> ReportFigure | None:
    clock = content.find_clock(report.experiments)
    if not clock:
        return None
    return ReportFigure(
        "clocks",
        "Fitness by generations and by evaluations",
        "Fitness of the average agent, mean over runs. The horizontal axis is the generation, or "
        "the total number of evaluations by all agents of a run. Learning uses many evaluations "
        "within one generation.",
        "The same curves of fitness by generation and by evaluations. "
        f"{describe_final_medians(report.data, 1)}",
        figures.draw_clocks(report.data, clock),
    )


def _draw_survival(report: ReportData) -> ReportFigure:
    return ReportFigure(
        "survival",
        "Survival of the populations",
        "Share of runs that survive, by time (Kaplan-Meier). A curve that ends above 0 has runs "
        "that still survive at the end of the study.",
        f"Curves of survival for each condition. {describe_final_medians(report.data, 1)}",
        figures.draw_survival(report.data),
        _tabulate_runs(report.data, 1),
    )


def _draw_maps(report: ReportData) -> ReportFigure | None:
    conditions = select_foragers(report.experiments)
    if not conditions:
        return None
    titles = title_worlds(conditions, of_study(report.data))
    worlds = {title: conditions[name].world for title, name in titles.items()}
    looks = {title: report.looks[name] for title, name in titles.items() if name in report.looks}
    starts = [
        f"{title}: agents start around ({world.start.x:g}, {world.start.y:g})"
        for title, world in worlds.items()
    ]
    n_agents = min(experiment.population.size for experiment in conditions.values())
    return ReportFigure(
        "maps",
        "The maps",
        "Maps to scale, in map units, with y pointing down. An agent that leaves a map at one edge "
        "enters it at the opposite edge. The positions of agents (blue, with a line in the "
        "direction of their heading) and of items are examples.",
        f"{'; '.join(starts)}.",
        figures.draw_world_maps(worlds, n_agents, looks),
    )


def _draw_emergence(report: ReportData) -> ReportFigure | None:
    if not report.traces:
        return None
    condition = str(report.traces[0].attrs["condition"])
    run = int(report.traces[0].attrs["run"])
    is_typical = fitness.typical_run(report.data, condition) == run
    reason = ", the run closest to the median final mean fitness" if is_typical else ""
    counts = []
    for trace in report.traces:
        eaters = int((trace["eaten"].sum("step") > 0).sum())
        counts.append(f"generation {trace.attrs['generation']}: {eaters} of {trace.sizes['agent']}")
    rows = _tabulate_generations(report.data, "share")
    return ReportFigure(
        "emergence",
        "The emergence of foraging",
        f"{condition}, run {run}{reason}. Top: time that all agents spent at each position; darker "
        "is longer, with one scale for all maps. The circle is the birthplace, and rectangles "
        "contain items. Bottom: share of agents that ate an item, mean over runs with its 95 % "
        "interval.",
        f"Maps of agent positions at several generations. Agents that ate: {', '.join(counts)}.",
        figures.draw_emergence(report.data, report.traces),
        [row for row in rows if row["condition"] == condition],
        [
            format_replay_command(condition, run, int(trace.attrs["generation"]))
            for trace in report.traces
        ],
    )


def _draw_networks(report: ReportData) -> ReportFigure | None:
    if not report.looks:
        return None
    paper = report.paper or load()
    experiments = select_foragers(report.experiments)
    kinds: dict[str, figures.AgentKind] = {}
    for name, factors in of_study(report.data).items():
        if name in report.looks and name in experiments:
            kind = _make_kind(factors.learner, experiments[name], report.looks[name])
            kinds.setdefault(factors.learner, kind)
    sources = {
        learner: kind
        for kind in ("conditions", "controls")
        for learner in paper.names(kind)
        if learner in kinds
    }
    descriptions = " ".join(
        f"{learner}: {paper.describe(kind, learner)}." for learner, kind in sources.items()
    )
    alternatives = [
        f"{kind.name}: {', '.join(kind.lines)}; {' and '.join(kind.modules)}"
        for kind in kinds.values()
    ]
    return ReportFigure(
        "networks",
        "The agents' networks",
        "The action module computes the action from the inputs (orange): the strongest output is "
        "the action. A second module, if there is one, receives the same inputs and keeps its "
        "weights from birth. Its outputs are the targets from which the action module learns. "
        f"{descriptions}",
        f"{'; '.join(alternatives)}.",
        figures.draw_networks(list(kinds.values())),
    )


def _make_kind(learner: str, experiment: Experiment, look: figures.Look) -> figures.AgentKind:
    inherits = experiment.evolution.inheritance != "none"
    heredity = (
        "evolves: inherits weights" if inherits else "does not evolve: new random\nweights at birth"
    )
    learning = (
        f"learns in its lifetime: {experiment.learning.rule}"
        if experiment.learns
        else "does not learn"
    )
    return figures.AgentKind(
        learner,
        (heredity, learning),
        look["inputs"],
        experiment.network.hidden,
        look["actions"],
        look["modules"],
    )


def _draw_senses(report: ReportData) -> ReportFigure | None:
    if not report.looks:
        return None
    name, look = next(iter(report.looks.items()))
    sectors = figures.group_sectors(look)
    ranges = [
        f"{' and '.join(inputs)} from {first:g} to {last:g} degrees, to {radius:g} units"
        for (first, last, radius), inputs in sectors.items()
    ]
    without_sector = [
        sensor for sensor, sector in zip(look["inputs"], look["sectors"], strict=True) if not sector
    ]
    unseen = f" Inputs without a sector: {', '.join(without_sector)}." if without_sector else ""
    last_inputs = " and ".join([*sectors.values()][-1]) if sectors else ""
    item = f" The item is in the sector of {last_inputs}." if sectors else ""
    return ReportFigure(
        "senses",
        "The agents' senses",
        f"Sectors in which the inputs sense items, to scale, for {name}. The agent heads to the "
        f"right of the page, and its right hand is below.{item}{unseen}",
        f"An agent and its sectors, clockwise from its heading: {'; '.join(ranges) or 'none'}.",
        figures.draw_agent_senses(look),
    )


DRAW: Final[Mapping[Figure, Callable[[ReportData], ReportFigure | None]]] = {
    "overview": _draw_overview,
    "fitness": _draw_fitness,
    "final-fitness": _draw_final_fitness,
    "emergence": _draw_emergence,
    "networks": _draw_networks,
    "maps": _draw_maps,
    "senses": _draw_senses,
    "shares": _draw_shares,
    "clocks": _draw_clocks,
    "measures": _draw_measures,
    "survival": _draw_survival,
}


def describe_final_medians(data: xr.Dataset, last: int) -> str:
    """Return the median over runs of the final mean fitness, as alternative text of a figure."""
    medians = fitness.final(data, "mean", last).median("run")
    values = [
        f"{name} {format_number(float(medians.sel(condition=name)))}"
        for name in medians["condition"].values
    ]
    return f"Final fitness of the average agent, median over runs: {', '.join(values)}."


def format_replay_command(condition: str, run: int, generation: int) -> str:
    """Return the command that replays a lifetime of the study."""
    return (
        f"baldwinlab replay . --condition {condition} --run {run} --generation {generation} "
        "--out life.mp4"
    )
