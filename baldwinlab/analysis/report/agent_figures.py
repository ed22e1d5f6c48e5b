"""Figures of a report about agents: maps, emergence, networks and senses."""

from __future__ import annotations

from baldwinlab.analysis import figures
from baldwinlab.analysis.report.content import select_foragers, title_worlds
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.embedding import ReportFigure
from baldwinlab.analysis.report.figure_data import (
    tabulate_agents,
    tabulate_generations,
    tabulate_maps,
    tabulate_sectors,
)
from baldwinlab.analysis.report.replays import StoredLife, format_replay_command, make_link
from baldwinlab.analysis.statistics import fitness
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import read_factors
from baldwinlab.papers import load


def draw_maps(report: ReportData) -> ReportFigure | None:
    """Draw the maps with examples of agents and items, or return None without MiniWorld."""
    conditions = select_foragers(report.experiments)
    if not conditions:
        return None
    titles = title_worlds(conditions, read_factors(report.data))
    worlds = {title: conditions[name].world for title, name in titles.items()}
    appearances = {
        title: report.appearances[name]
        for title, name in titles.items()
        if name in report.appearances
    }
    starts = [
        f"{title}: agents start around ({world.start.x:g}, {world.start.y:g})"
        for title, world in worlds.items()
    ]
    n_agents = min(experiment.population.size for experiment in conditions.values())
    return ReportFigure(
        name="maps",
        title="The maps",
        caption=(
            "Maps to scale, in map units, with y pointing down. An agent that leaves a map at one "
            "edge enters it at the opposite edge. The positions of agents (blue, with a line in "
            "the direction of their heading) and of items are examples."
        ),
        alternative=f"{'; '.join(starts)}.",
        figure=figures.draw_world_maps(worlds, n_agents, appearances),
        table=tabulate_maps(worlds),
    )


def draw_emergence(report: ReportData) -> ReportFigure | None:
    """Draw the emergence of foraging in one run, or return None without traces."""
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
    rows = tabulate_generations(report.data, "share")
    lives = [StoredLife(condition, run, int(trace.attrs["generation"])) for trace in report.traces]
    return ReportFigure(
        name="emergence",
        title="The emergence of foraging",
        caption=(
            f"{condition}, run {run}{reason}. Top: time that all agents spent at each position; "
            "darker is longer, with one scale for all maps. The circle is the birthplace, and "
            "rectangles contain items. Bottom: share of agents that eat an item, mean over runs "
            "with its 95 % interval."
        ),
        alternative=(
            f"Maps of agent positions at several generations. Agents that ate: {', '.join(counts)}."
        ),
        figure=figures.draw_emergence(report.data, report.traces),
        table=[row for row in rows if row["condition"] == condition],
        commands=[format_replay_command(life) for life in lives],
        links=[make_link([life], f"generation {life.generation}") for life in lives],
    )


def draw_networks(report: ReportData) -> ReportFigure | None:
    """Draw the network of each learner, or return None without appearances."""
    if not report.appearances:
        return None
    paper = report.paper or load()
    experiments = select_foragers(report.experiments)
    kinds: dict[str, figures.AgentKind] = {}
    for name, factors in read_factors(report.data).items():
        if name in report.appearances and name in experiments:
            kind = _make_kind(factors.learner, experiments[name], report.appearances[name])
            kinds.setdefault(factors.learner, kind)
    descriptions = " ".join(
        f"{learner}: {paper.describe(preset_kind, learner)}."
        for preset_kind in ("conditions", "controls")
        for learner in paper.names(preset_kind)
        if learner in kinds
    )
    alternatives = [
        f"{kind.name}: {', '.join(kind.lines)}; {' and '.join(kind.modules)}"
        for kind in kinds.values()
    ]
    return ReportFigure(
        name="networks",
        title="The agents' networks",
        caption=(
            "The action module computes the action from the inputs (orange): the strongest output "
            "is the action. A second module, if there is one, receives the same inputs and keeps "
            "its weights from birth. Its outputs are the targets from which the action module "
            f"learns. {descriptions}"
        ),
        alternative=f"{'; '.join(alternatives)}.",
        figure=figures.draw_networks(list(kinds.values())),
        table=tabulate_agents(list(kinds.values())),
    )


def _make_kind(
    learner: str, experiment: Experiment, appearance: figures.Appearance
) -> figures.AgentKind:
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
        name=learner,
        lines=(heredity, learning),
        inputs=appearance["inputs"],
        hidden=experiment.network.hidden,
        actions=appearance["actions"],
        modules=appearance["modules"],
    )


def draw_senses(report: ReportData) -> ReportFigure | None:
    """Draw the sectors of the senses, or return None without appearances."""
    if not report.appearances:
        return None
    name, appearance = next(iter(report.appearances.items()))
    sectors = figures.group_sectors(appearance)
    ranges = [
        f"{' and '.join(inputs)} from {sector.first_degrees:g} to {sector.last_degrees:g} degrees, "
        f"to {sector.radius:g} units"
        for sector, inputs in sectors.items()
    ]
    without_sector = [
        sensor
        for sensor, sector in zip(appearance["inputs"], appearance["sectors"], strict=True)
        if not sector
    ]
    unseen = f" Inputs without a sector: {', '.join(without_sector)}." if without_sector else ""
    last_inputs = " and ".join([*sectors.values()][-1]) if sectors else ""
    item = f" The item is in the sector of {last_inputs}." if sectors else ""
    return ReportFigure(
        name="senses",
        title="The agents' senses",
        caption=(
            f"Sectors in which the inputs sense items, to scale, for {name}. The agent heads to "
            f"the right of the page, and its right hand is below.{item}{unseen}"
        ),
        alternative=(
            f"An agent and its sectors, clockwise from its heading: {'; '.join(ranges) or 'none'}."
        ),
        figure=figures.draw_agent_senses(appearance),
        table=tabulate_sectors(sectors),
    )
