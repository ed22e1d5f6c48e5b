"""Which lifetime a request means, and what it takes to live it again."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import xarray as xr
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from baldwinlab.evolution import Genome, Moment
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.lab import Lab, MissingError, studies
from baldwinlab.lab.concurrency import InTurn
from baldwinlab.lab.query import Query, number, text
from baldwinlab.simulation.reevaluation import stored_genome
from baldwinlab.simulation.replay import energy_before, genome_at
from baldwinlab.simulation.simulate import check_seed

MOST_STEPS = 20_000  # in one answer
MOST_BYTES = 32 * 2**20  # in one answer, about


class Past(NamedTuple):
    """What came before a lifetime."""

    genome: Genome  # [agent, module, weight], with which it begins
    energy: (
        xr.DataArray | None
    )  # [generation, agent] of the generations before it, at least; None where there are none


class Life(NamedTuple):
    """One lifetime. Experiment and moment alone decide it, so they can stand for what follows from it."""

    experiment: Experiment
    moment: Moment
    past: Callable[[], Past]  # a little work


class Span(NamedTuple):
    """Steps from `first` up to, and without, `last`."""

    first: int
    last: int


async def answer(
    lab: Lab,
    request: Request,
    bytes_a_step: Callable[[Experiment], int],
    make: Callable[[Life, Span], bytes],
) -> Response:
    """The container that `make` makes of the life and the part of it that a request asks for, or has made of it before."""
    query = request.query_params
    life = await run_in_threadpool(find, lab, query)
    part = span(query, life.experiment.lifetime.steps, bytes_a_step(life.experiment))
    key = (request.url.path, tuple(sorted(query.items())), life.experiment, life.moment)

    def made() -> Response:
        return Response(
            lab.answers.get(key, lambda: make(life, part)), media_type="application/octet-stream"
        )

    return InTurn(lab, made)


def span(query: Query, steps: int, bytes_a_step: int) -> Span:
    """The part of a life that is asked for (unless given, all of it), or as much of its beginning as one answer may hold.

    Raises ValueError where there is no such part.
    """
    first, last = number(query, "first", 0), number(query, "last", steps)
    if not first < last <= steps:
        raise ValueError(
            f"first = {first} and last = {last} must be in order and at most {steps}, the steps of a life"
        )
    return Span(first, min(last, first + max(1, min(MOST_STEPS, MOST_BYTES // bytes_a_step))))


def find(lab: Lab, query: Query) -> Life:
    """The lifetime of a stored run (study, condition), of a live one (live), or of a preset (preset, seed).

    Each also takes run and generation. Raises MissingError where there is none such, and where lives of its model cannot be
    watched; and ValueError where something is missing.
    """
    life = _named(lab, query)
    if not isinstance(life.experiment, Experiment):
        raise MissingError(
            f"{life.experiment.name} is of the model {life.experiment.model}, whose lives have no world to watch"
        )
    return life


def require_agent(experiment: BaseExperiment, agent: int) -> None:
    """Raises MissingError for an agent that the population has not."""
    if agent >= experiment.population.size:
        raise MissingError(
            f"{experiment.name} has no agent {agent}: its agents are 0 to {experiment.population.size - 1}"
        )


def _named(lab: Lab, query: Query) -> Life:
    generation = number(query, "generation")
    if "study" in query:
        return _stored(lab, query, generation)
    if "live" in query:
        run = number(query, "run")
        experiment, seed, _, energy = lab.live.recording_source(query["live"], run, generation)
        return _bred(experiment, Moment(seed, run, generation), lambda: energy)
    moment = Moment(number(query, "seed", 0), number(query, "run", 0), generation)
    check_seed(moment.seed, moment.run)
    experiment = studies.load_preset(text(query, "preset"))
    return _bred(experiment, moment, lambda: energy_before(experiment, moment))


def _stored(lab: Lab, query: Query, generation: int) -> Life:
    study = studies.find(lab, query["study"])
    name, run = text(query, "condition"), number(query, "run")
    experiment = studies.condition(study, name)
    study.require_parts(name)
    require_generation(experiment, generation)

    def past() -> Past:
        record = study.record(name, run)
        return Past(stored_genome(experiment, record, generation), record.energy)

    studies.require_run(lab, study, name, run)
    return Life(experiment, Moment(study.seed, run, generation), past)


def _bred(
    experiment: Experiment, moment: Moment, energy: Callable[[], xr.DataArray | None]
) -> Life:
    require_generation(experiment, moment.generation)

    def past() -> Past:
        eaten = energy()
        return Past(genome_at(experiment, moment, eaten), eaten)

    return Life(experiment, moment, past)


def require_generation(experiment: BaseExperiment, generation: int) -> None:
    """Raises MissingError for a generation that the experiment has not."""
    if generation >= experiment.evolution.generations:
        last = experiment.evolution.generations - 1
        raise MissingError(
            f"{experiment.name} has no generation {generation}: its generations are 0 to {last}"
        )
