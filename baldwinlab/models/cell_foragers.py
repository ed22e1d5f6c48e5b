"""Model of foragers on a grid that learn from a teacher or from additional outputs.

    baldwinlab reproduce nolfi-parisi-1993

An environment is a grid of 10 by 10 cells with ten food items and a single agent. The agent eats an
item when it enters the cell of the item. The four inputs are the angle of the nearest item relative
to the heading, the distance of this item, and the two bits of the next action. From these inputs,
the network computes the action after the next action: stay (00), turn right (01), turn left (10) or
go ahead (11). A lifetime has several environments. Fitness is the mean number of eaten items per
environment.

The setting `learning` selects the targets of learning:

- none;
- `auto-teaching`: outputs of an inherited teaching module are the targets of the action outputs;
- `prediction`: the next angle and distance are the targets of two additional outputs;
- `random-targets`: random numbers are the targets of two additional outputs, as a control.

World, lifetimes, evolution and prediction follow Nolfi et al. 1994. The constants of both papers
are from memory. Our choices are as follows: a move off the grid has no effect; an agent begins in
any cell with any heading; without food, the angle is 0 and the distance is 1.

The module `cell_forager_lifetimes` simulates the lifetimes.

References
----------
S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks", Adaptive Behavior
3 (1994).
S. Nolfi and D. Parisi, "Auto-teaching: networks that develop their own teaching input", ECAL 93.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.models import cell_forager_lifetimes as lifetimes
from baldwinlab.models import kit
from baldwinlab.parts import (
    Field,
    GridView,
    LifeResults,
    Mating,
    Measure,
    Model,
    Variable,
    Variation,
    View,
)

TARGET_OF_LEARNING: Final = {
    "none": lifetimes.NO_TARGET,
    "auto-teaching": lifetimes.INHERITED_TEACHER,
    "prediction": lifetimes.NEXT_SENSATION,
    "random-targets": lifetimes.NOISE,
}
# Number of equal periods of a lifetime. The record `gain` compares the last and the first period.
N_PERIODS: Final = 6
# Number of outputs for the targets of prediction, or for random targets.
N_ADDITIONAL_OUTPUTS: Final = 2
# Approximate maximum number of moves in a view.
MAX_SHOWN_MOVES: Final = 20_000


def _view_lifetime(model: CellForagers, key: Any, genomes: kit.Genomes, agent: int) -> GridView:
    """Return the moves of an agent in the first environments, one frame per step."""
    max_environments = max(1, MAX_SHOWN_MOVES // model.steps_per_environment)
    environments = min(model.environments, max_environments)
    results = model.forage(
        key.seed,
        [key.run],
        key.generation,
        genomes[None, [agent]],
        first_agent=agent,
        environments=environments,
        n_recorded=environments,
    )
    side = lifetimes.GRID_SIZE
    n_steps = model.steps_per_environment
    contents = np.zeros((environments, n_steps, side * side), np.uint8)
    gained = np.zeros((environments, n_steps))
    for environment in range(environments):
        contents[environment][:, results.food[environment]] = 1
        for step, cell in enumerate(results.track[environment, :, 0]):
            gained[environment, step:] += contents[environment, step, cell]
            # Food in this cell is eaten, and is missing from this step on.
            contents[environment, step:, cell] = 0
    # The frames of the second environment follow those of the first environment.
    cells, heading = results.track.reshape(-1, 2).T
    return GridView(
        cell_colors={"food": "green"},
        cells=contents.reshape(-1, side, side),
        position=np.stack([cells // side, cells % side], axis=-1),
        heading=heading,
        gained=gained.ravel(),
        visit=np.repeat(np.arange(environments), n_steps),
        visit_label="environment",
    )


class CellForagers(Model, name="cell-foragers"):
    """Foragers on a grid whose networks learn during life."""

    learning: Literal["none", "auto-teaching", "prediction", "random-targets"] = Field(
        "none", description="Content of learning."
    )
    learning_rate: float = Field(
        0.15,
        ge=0,
        le=10,
        description="Learning rate. 0: the same genome without learning.",
    )
    hidden_units: int = Field(7, ge=1, le=100, description="Number of hidden units per module.")
    environments: int = Field(
        24,
        ge=6,
        le=1000,
        description=(
            "Number of environments in a lifetime, each with its own start position and food."
        ),
    )
    steps_per_environment: int = Field(
        50, ge=1, le=10_000, description="Number of steps per environment."
    )

    defaults = {
        "population": {"size": 100},
        "evolution": {
            "generations": 51,
            "selection": "best-copies",
            "variation": "few-mutations",
            "mutation_size": 1.0,
        },
        "record": {"genome_every": 10},
    }
    payoff = "food eaten per environment"
    learning_amount = "learning_rate"
    settings_without_learning = {"learning_rate": 0.0}
    records = {
        "gain": Variable.quantity(
            "items", "food per environment in the last sixth of life minus that in the first"
        ),
    }
    views = {
        "life": View(
            (
                "An agent and its food, step by step. Eaten food disappears. Each "
                "environment has its own food."
            ),
            _view_lifetime,
        )
    }
    measures = {
        **{
            f"gain-{generation}": Measure(
                f"gain within life in generation {generation}, items an environment",
                kit.mean_at("gain", generation),
            )
            for generation in (0, 10, 20, 50)
        },
        "gain-falls": Measure(
            "gain within life in generation 10 minus that in generation 50",
            lambda runs: kit.mean_at("gain", 10)(runs) - kit.mean_at("gain", 50)(runs),
        ),
    }

    @property
    def modules(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("action", "reinforcement") if self.learning == "auto-teaching" else ("action",)

    @property
    def learns(self) -> bool:
        return self.learning != "none" and self.learning_rate > 0

    @property
    def steps(self) -> int:
        return self.environments * self.steps_per_environment

    @property
    def outputs(self) -> int:
        """Return the number of outputs: two for the action, and two for additional targets."""
        has_additional_outputs = self.learning in ("prediction", "random-targets")
        return lifetimes.N_ACTION_OUTPUTS + (N_ADDITIONAL_OUTPUTS if has_additional_outputs else 0)

    def n_weights(self) -> int:
        return (lifetimes.N_INPUTS + 1) * self.hidden_units + (self.hidden_units + 1) * self.outputs

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        n_modules = len(self.modules)
        draws = kit.draw_founder_numbers(key, agents, n_modules * self.n_weights())
        weights: kit.Genomes = (2 * draws - 1).astype(np.float32)
        return weights.reshape(agents, n_modules, -1)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        results = self.forage(
            seed,
            runs,
            generation,
            genomes,
            first_agent=0,
            environments=self.environments,
            n_recorded=1,
        )
        # [run, agent, environment].
        eaten = results.eaten
        n_compared = self.environments // N_PERIODS
        mean_eaten_last = eaten[..., -n_compared:].mean(axis=-1)
        mean_eaten_first = eaten[..., :n_compared].mean(axis=-1)
        gain = mean_eaten_last - mean_eaten_first
        fitness = eaten.sum(axis=-1) / self.environments
        return self.make_results(fitness, {"gain": gain}, learned=results.learned)

    def forage(
        self,
        seed: int,
        runs: Sequence[int],
        generation: int,
        genomes: kit.Genomes,
        *,
        first_agent: int,
        environments: int,
        n_recorded: int,
    ) -> lifetimes.ForagingResults:
        """Simulate environments of the agents of `genomes`.

        `first_agent`: index in the population of the first of these agents. `n_recorded`: number of
        last environments with a recorded path.
        """
        n_units = lifetimes.N_INPUTS + self.hidden_units + self.outputs
        target = TARGET_OF_LEARNING[self.learning] if self.learns else lifetimes.NO_TARGET
        settings = lifetimes.ForagingSettings(
            seed=seed,
            generation=generation,
            first_agent=first_agent,
            target=target,
            layers=lifetimes.Layers(
                hidden=self.hidden_units,
                outputs=self.outputs,
                rate=np.float32(self.learning_rate),
            ),
        )
        scratch = lifetimes.Scratch(
            food=poison.empty(lifetimes.N_FOOD_ITEMS, np.int64),
            units=lifetimes.Activations(
                values=poison.empty(n_units, np.float32),
                teacher=poison.empty(n_units, np.float32),
                targets=poison.empty(N_ADDITIONAL_OUTPUTS, np.float32),
            ),
        )
        n_runs, n_agents = genomes.shape[:2]
        results = lifetimes.ForagingResults(
            learned=genomes[:, :, 0].copy(),
            eaten=poison.empty((n_runs, n_agents, environments), np.int32),
            food=poison.empty((n_recorded, lifetimes.N_FOOD_ITEMS), np.int64),
            track=poison.empty((n_recorded, self.steps_per_environment, 2), np.int64),
        )
        # The last module. Without a teaching module, it is the action module and is not used.
        teaching = np.ascontiguousarray(genomes[:, :, -1])
        lifetimes.simulate_lifetimes(settings, np.array(runs, np.int64), teaching, scratch, results)
        return results


class FewMutations(Variation, name="few-mutations"):
    """Copy of one parent, chosen at random; a fixed number of weights mutate.

    References
    ----------
    Nolfi, Elman and Parisi 1994.
    """

    mutations: int = Field(
        5,
        ge=0,
        le=1000,
        description="Number of weights of a child that mutate, drawn with replacement.",
    )
    reads = ("mutation_size",)

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                child[module, weight] = (
                    fitter[module, weight] if mating.gate < 0.5 else second[module, weight]
                )
        # `draws` has one row per weight, which limits the number of mutations.
        for mutation in range(min(part.mutations, mating.draws.shape[0])):
            # Index of a weight in the list of the weights of all modules.
            position = int(mating.draws[mutation, 1] * child.size)
            module = position // child.shape[1]
            weight = position % child.shape[1]
            change = (2.0 * mating.draws[mutation, 2] - 1.0) * part.mutation_size
            child[module, weight] += np.float32(change)
