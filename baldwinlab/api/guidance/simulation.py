"""Simulation of a cell: evolution of all arms, then common generations without learning.

An arm is a condition with the same founders and random numbers as the learner. All arms evolve, and
their genomes then evolve further without learning. `innate` is the mean fitness of the agents after
these common generations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.analysis.guidance.predictions import (
    CONTROL,
    EQUAL_EVALUATIONS,
    LEARNING,
    name_costly,
)
from baldwinlab.analysis.theory.landscape_chain import ChainSettings, advance, make_chain
from baldwinlab.evolution import Genome, make_founders, make_run_keys
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models import Simulator
from baldwinlab.models.kit import read_bits
from baldwinlab.models.nk_climbers import landscape
from baldwinlab.papers.guidance_design import Cell
from baldwinlab.simulation.generations import iterate_generations
from baldwinlab.simulation.noise_controls import Kind, NoiseControl
from baldwinlab.studies.assays import Sample
from baldwinlab.studies.assays.fork import MODE, copy_mode, fit_genomes

# The prediction for a run takes about the time of this number of agent-steps.
PREDICTION_STEPS: Final = 8_000_000


class Arm(NamedTuple):
    """A condition of a cell."""

    name: str
    experiment: BaseExperiment
    # The arm has as many lifetimes as this number of generations of the learner.
    repetitions: int = 1
    # Control of `simulation.noise_controls`, if the simulator has one.
    noise: Kind | None = None

    @property
    def last_generation(self) -> int:
        """Generation with the genomes at the start of the common generations."""
        return self.repetitions * (self.experiment.evolution.generations - 1)


def list_arms(cell: Cell) -> Iterator[Arm]:
    """Yield the arms of a cell: the control without learning is the first."""
    control = cell.learner.without_learning()
    yield Arm(CONTROL, control)
    if cell.evaluations > 1:
        yield Arm(EQUAL_EVALUATIONS, control, cell.evaluations)
    yield from _list_plastic_arms(cell, cell.learner)
    if cell.group.costs:
        for arm in _list_plastic_arms(cell, cell.costly_learner):
            yield arm._replace(name=name_costly(arm.name))


def _list_plastic_arms(cell: Cell, learner: BaseExperiment) -> Iterator[Arm]:
    """Yield a learner, and the arms with noise instead of its learning."""
    yield Arm(LEARNING, learner)
    for kind in cell.group.noise:
        if isinstance(learner, Experiment):
            yield Arm(kind, learner.replace(learning={"control": kind}))
        else:
            yield Arm(kind, learner, noise=kind)
    for name in cell.group.noise_presets:
        yield Arm(name, cell.load_noise(name))


def count_agent_steps(cell: Cell) -> int:
    """Return the number of agent-steps of a run of a cell, of all arms."""
    arms = [*list_arms(cell)]
    n_branches = len(arms) * len(cell.group.starts)
    steps_of_arms = sum((arm.last_generation + 1) * _count_steps_of_arm(arm) for arm in arms)
    steps_of_branches = (
        (max(cell.group.horizons) + 1) * n_branches * _count_steps(arms[0].experiment)
    )
    return steps_of_arms + steps_of_branches + PREDICTION_STEPS * cell.group.has_law


def _count_steps_of_arm(arm: Arm) -> int:
    """Return the number of agent-steps in one generation of one run of an arm."""
    steps = _count_steps(arm.experiment)
    # Learners evolve beside the control.
    return steps + _count_steps(arm.experiment.without_learning()) if arm.noise else steps


def _count_steps(experiment: BaseExperiment) -> int:
    """Return the number of agent-steps in one generation of one run.

    The reproduction counts as one step per gene, because a gene takes about the time of a step.
    Without this, the short lifetimes of most models would be almost no work.
    """
    n_genes = len(experiment.modules) * experiment.genome_length
    return experiment.agent_steps + experiment.population.size * n_genes


def measure_runs(
    cell: Cell, seed: int, runs: Sequence[int], report_progress: Callable[[int], None]
) -> xr.Dataset:
    """Return `innate` (run, arm, start, horizon), with `predicted` if the group has a law.

    `report_progress`: called with the number of agent-steps after each generation.
    """
    arms = [*list_arms(cell)]
    group = cell.group
    control = cell.learner.without_learning()
    no_directory: Any = None  # `fit_genomes` reads only the seed, the runs and the experiment.
    sample = Sample(no_directory, seed, control, (*runs,), (), (), lambda _: None)
    branches = []
    for arm in arms:
        genomes = _evolve(arm, seed, runs, report_progress)
        for start in group.starts:
            if start == MODE:
                genomes = np.stack([copy_mode(population) for population in genomes])
            branches.append(fit_genomes(genomes, sample))
    innate = _branch(cell, control, seed, runs, branches, report_progress)
    innate = innate.reshape(len(arms), len(group.starts), len(runs), len(group.horizons))
    coordinates = {
        "run": [*runs],
        "arm": [arm.name for arm in arms],
        "start": [*group.starts],
        "horizon": [*group.horizons],
    }
    dims = ("run", "arm", "start", "horizon")
    data = xr.Dataset({"innate": (dims, innate.transpose(2, 0, 1, 3))}, coordinates)
    if not group.has_law:
        return data
    predicted = np.stack([_predict(cell, seed, run, report_progress) for run in runs])
    data = data.assign_coords(history=[LEARNING, CONTROL])
    return data.assign(predicted=(("run", "history", "horizon"), predicted))


def _evolve(
    arm: Arm, seed: int, runs: Sequence[int], report_progress: Callable[[int], None]
) -> Genome:
    """Return the genomes of an arm in its last generation, from the founders of the runs."""
    founders = make_founders(arm.experiment, make_run_keys(seed, runs, 0))
    simulator: Simulator | None = None
    if arm.noise:
        simulator = NoiseControl(arm.experiment, seed, runs, arm.noise)
    generations = range(arm.last_generation + 1)
    agent_steps = len(runs) * _count_steps_of_arm(arm)
    genomes = founders
    for generation in iterate_generations(
        arm.experiment, seed, runs, generations, founders, simulator
    ):
        genomes = generation.genomes
        report_progress(agent_steps)
    return genomes


def _branch(
    cell: Cell,
    control: BaseExperiment,
    seed: int,
    runs: Sequence[int],
    branches: Sequence[Genome],
    report_progress: Callable[[int], None],
) -> npt.NDArray[np.float64]:
    """Return the mean fitness [branch and run, horizon] after common generations.

    `branches` [branch]: genomes of all runs, which evolve further without learning. A run has the
    same random numbers in all branches. All branches are one batch, because a generation has costs
    that do not depend on the number of agents.
    """
    first = control.evolution.generations - 1
    generations = range(first, first + max(cell.group.horizons) + 1)
    all_runs = [*runs] * len(branches)
    agent_steps = len(all_runs) * _count_steps(control)
    means = []
    for generation in iterate_generations(
        control, seed, all_runs, generations, np.concatenate(branches)
    ):
        if generation.number - first in cell.group.horizons:
            means.append(generation.fitness.mean(axis=1))
        report_progress(agent_steps)
    return np.stack(means, axis=1)


def _predict(
    cell: Cell, seed: int, run: int, report_progress: Callable[[int], None]
) -> npt.NDArray[np.float64]:
    """Return the expected innate fitness [history, horizon] by the Markov chain of a landscape."""
    experiment = cell.learner
    model = experiment.model_part
    fitness = landscape(seed, run, model.bits, model.k)
    founder = read_bits(make_founders(experiment, make_run_keys(seed, [run], 0)))[0, 0]
    settings = ChainSettings(experiment.population.size, experiment.evolution.mutation_rate)
    off = make_chain(fitness, settings)
    expected = []
    for chain in (make_chain(fitness, settings._replace(trials=model.trials)), off):
        shares = np.zeros(fitness.size)
        shares[founder] = 1
        shares = advance(chain, shares, experiment.evolution.generations - 1)
        of_history = []
        generation = 0
        for horizon in cell.group.horizons:
            shares = advance(off, shares, horizon - generation)
            generation = horizon
            of_history.append(float(fitness @ shares))
        expected.append(of_history)
    report_progress(PREDICTION_STEPS)
    return np.array(expected)
