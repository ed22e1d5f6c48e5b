"""Backend for the CPU of several species that share a world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.jit import cached_jit, resolve_call
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import list_hooks, make_model, make_state, poison_state
from baldwinlab.models.miniworld.backends.cpu import PopulationView
from baldwinlab.models.miniworld.grid import GridSettings
from baldwinlab.models.miniworld.regions import item_regions
from baldwinlab.models.miniworld.senses.other_agents import SpeciesSense
from baldwinlab.models.miniworld.species_step import (
    SHARED_ARRAYS,
    SpeciesPopulation,
    simulate_species,
)
from baldwinlab.models.miniworld.state import MiniWorldModel, State

SHARED_STATE: Final = (
    "keys",
    "generation",
    "item_x",
    "item_y",
    "appearances",
    "touched",
    "slot_x",
    "slot_y",
    "slot_item",
    "cell_slots",
    "cell_next",
    "item_cell",
    "stale",
)
"""Arrays of `State` that all species share."""


class SpeciesBatch:
    """Several runs of species that share a world, simulated one generation at a time."""

    def __init__(
        self, experiment: Experiment, seed: int, runs: Sequence[int], sizes: Sequence[int]
    ) -> None:
        """Allocate the states. `sizes` [species]: number of agents of each species in every run."""
        names = [species.name for species in experiment.population.species]
        members = [
            _with_size(member, size)
            for member, size in zip(experiment.species_experiments(), sizes, strict=True)
        ]
        grid = GridSettings(
            visual_radius=max(member.senses.visual_radius for member in members),
            agents=sum(sizes),
        )
        self.members = members
        self.models = [make_model(member, len(runs), grid) for member in members]
        self.states = _make_states(members, names, len(runs), grid)
        # All species share the arrays `keys` and `generation` of the first species.
        self.states[0].keys[:] = [(seed, run) for run in runs]
        self._species = tuple(zip(self.models, self.states, strict=True))
        hooks = tuple(hook for state in self.states for hook in list_hooks(state))
        self._dispatcher = cached_jit(simulate_species, hooks, short_loops=True)
        self._function = self._dispatcher
        self._runs = len(runs)

    def begin(self, generation: int, genomes: Sequence[npt.NDArray[np.float32]]) -> None:
        """Initialize a generation with genomes [world, agent, module, weight] of each species."""
        for state, member, species_genomes in zip(self.states, self.members, genomes, strict=True):
            poison_state(state, self._runs * member.population.size)
            state.genome[:] = species_genomes
        self.states[0].generation[0] = generation
        is_start = True
        arguments = self._species, is_start, 0, 0
        self._function(*arguments)
        # The first call compiles the function. Later calls skip the dispatcher.
        if self._function is self._dispatcher:
            self._function = resolve_call(self._dispatcher, *arguments)

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` to `last_step` - 1."""
        is_start = False
        self._function(self._species, is_start, first_step, last_step)

    def views(self) -> list[SpeciesView]:
        """Return the agents of each species."""
        return [
            SpeciesView(self, model, state, (self._runs, model.agents))
            for model, state in self._species
        ]


class SpeciesView(PopulationView):
    """The agents of one species of a batch."""

    def __init__(
        self, batch: SpeciesBatch, model: MiniWorldModel, state: State, shape: tuple[int, int]
    ) -> None:
        """Store the batch. The other arguments are those of `PopulationView`."""
        super().__init__(model, state, shape)
        self._batch = batch

    def simulate(self, first_step: int, last_step: int) -> None:
        """Simulate the steps from `first_step` to `last_step` - 1 of all species of the batch."""
        self._batch.simulate(first_step, last_step)


def _with_size(member: Experiment, size: int) -> Experiment:
    """Return the experiment of a species with another number of agents, which can be 0."""
    population = member.population.model_copy(update={"size": size})
    return member.model_copy(update={"population": population})


def _make_states(
    members: Sequence[Experiment], names: Sequence[str], worlds: int, grid: GridSettings
) -> list[State]:
    """Allocate the states of all species, which share arrays. `names` are names of species."""
    sizes = [member.population.size for member in members]
    shared: dict[str, Any] = {
        name: poison.allocate((worlds, grid.agents), np.dtype(np.float32)) for name in SHARED_ARRAYS
    }
    states: list[State] = []
    for species_index, member in enumerate(members):
        state = make_state(
            member,
            worlds,
            grid,
            SpeciesPopulation,
            species=species_index,
            first_agent=sum(sizes[:species_index]),
            all_agents=grid.agents,
            n_species=len(members),
            species_of_agents=np.repeat(np.arange(len(sizes)), sizes),
            prey_rows=_find_prey_rows(member, names),
            has_prey=bool(member.eats.prey),
            stepped_features=(),
            **shared,
        )
        state = _set_targets(state, member, names)
        states.append(_share_arrays(state, states[0], member) if states else _step_all(state))
    return states


def _step_all(state: State) -> State:
    """Return the state of the first species. The hooks of all features are called for it."""
    population = state.population._replace(stepped_features=state.features)
    return state._replace(population=population)


def _share_arrays(state: State, first_state: State, member: Experiment) -> State:
    """Return the state of a further species, with the shared arrays of the first species.

    A feature without arrays of agents is also shared. The hook `end_step` of a shared feature is
    called for the first species only, because a second call would change the items twice.
    """
    features = []
    stepped_features = []
    parts = member.parts("world.features")
    for part, values, first_values in zip(parts, state.features, first_state.features, strict=True):
        is_shared = not _has_agents(part)
        features.append(first_values if is_shared else values)
        if not is_shared:
            stepped_features.append(values)
    shared = {name: getattr(first_state, name) for name in SHARED_STATE}
    population = state.population._replace(stepped_features=tuple(stepped_features))
    return state._replace(features=tuple(features), population=population, **shared)


def _has_agents(part: Any) -> bool:
    """Return whether a world feature lets agents die or be born, or has arrays of agents."""
    return (
        part.allows_births
        or part.allows_deaths
        or any(
            array.owner in ("agent", "lane") or "agents" in array.rows
            for array in type(part).arrays.values()
        )
    )


def _set_targets(state: State, member: Experiment, names: Sequence[str]) -> State:
    """Return the state with the index of the target species in each sense that names a species."""
    senses = [
        values._replace(target_number=names.index(part.target))
        if isinstance(part, SpeciesSense) and part.target
        else values
        for part, values in zip(member.parts("senses.kinds"), state.senses, strict=True)
    ]
    return state._replace(senses=tuple(senses))


def _find_prey_rows(member: Experiment, names: Sequence[str]) -> npt.NDArray[np.int64]:
    """Return the row of `State.eaten_in_life` for each prey species, and -1 for other species."""
    prey = [entry.species for entry in member.eats.prey]
    n_item_rows = max(1, len(item_regions(member)))
    rows = [n_item_rows + prey.index(name) if name in prey else -1 for name in names]
    return np.array(rows, np.int64)
