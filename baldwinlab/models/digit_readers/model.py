"""The model `digit-readers`: settings, records and measures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.models.digit_readers.digits import N_DIGITS, N_PIXELS, draw_digit_sets
from baldwinlab.models.digit_readers.training import (
    TrainingResults,
    TrainingSettings,
    train_and_test,
)
from baldwinlab.models.digit_readers.variation import LEVEL_STEP, MAX_WEIGHT, N_LEVELS
from baldwinlab.models.record_means import mean_of_last_generation
from baldwinlab.parts import FOUNDER, Field, LifeResults, Measure, Model, Variable


class DigitReaders(Model, name="digit-readers"):
    """Networks that classify digits and learn from examples during life."""

    trials: int = Field(
        20,
        ge=0,
        le=100_000,
        description="Mean number of learning trials in a lifetime. 0: no learning.",
    )
    trial_distribution: Literal["equal", "spread"] = Field(
        "equal",
        description=(
            "Distribution of the trials. equal: the same for all agents; spread: "
            "uniform from 0 to twice the mean."
        ),
    )
    learning_rate: float = Field(0.5, gt=0, le=10, description="Learning rate.")
    noise: float = Field(0.05, ge=0, le=0.5, description="Probability that a pixel is inverted.")
    hidden_units: int = Field(10, ge=1, le=100, description="Number of hidden units.")
    criterion: Literal["strongest", "all"] = Field(
        "strongest",
        description=(
            "Criterion of a correct answer: the largest output, or all ten outputs on"
            " the correct side of 1/2."
        ),
    )
    tests_per_digit: int = Field(
        10, ge=1, le=1000, description="Number of tests per digit at the end of a lifetime."
    )

    defaults = {
        "population": {"size": 100},
        "evolution": {
            "generations": 51,
            "selection": "truncation",
            "variation": "four-bit-weights",
            "mutation_rate": 0.005,
        },
        "record": {"genome_every": 5},
    }
    payoff = "share of digits classified correctly"
    records = {
        "innate_error": Variable.share("share of digits misclassified at birth"),
        "error": Variable.share("share of digits misclassified at the end of life"),
        "used": Variable.integer(
            "trials", "number of trials in the lifetime, plus 1 for the test at its end"
        ),
    }
    clock = "used"
    learning_amount = "learning_rate"
    settings_without_learning = {"trials": 0}
    measures = {
        "innate-error": Measure(
            "share of digits misclassified at birth in the last generation",
            mean_of_last_generation("innate_error"),
        ),
        "error": Measure(
            "share of digits misclassified after learning in the last generation",
            mean_of_last_generation("error"),
        ),
    }

    @property
    def steps(self) -> int:
        return max(1, self.trials)

    def n_weights(self) -> int:
        return (N_PIXELS + 1) * self.hidden_units + (self.hidden_units + 1) * N_DIGITS

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        # [agent, weight]: the first of four numbers.
        draws = key.uniforms(FOUNDER, (agents, self.n_weights()))[..., 0]
        levels = (N_LEVELS * draws).astype(np.int64)
        weights: npt.NDArray[np.float32] = levels.astype(np.float32) * LEVEL_STEP - MAX_WEIGHT
        # A genome has one module.
        return weights[:, None]

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        n_runs, n_agents = genomes.shape[:2]
        # [run, agent, weight]: trained in place.
        weights = genomes[:, :, 0].copy()
        n_trials = poison.empty((n_runs, n_agents), np.int32)
        # [run, agent, 2]: before and after the training.
        n_wrong = poison.empty((n_runs, n_agents, 2), np.int32)
        # Activations of hidden units, outputs, and errors.
        scratch = poison.empty((3, max(self.hidden_units, N_DIGITS)), np.float32)
        for row, run in enumerate(runs):
            settings = TrainingSettings(
                seed=seed,
                run=run,
                generation=generation,
                n_hidden=self.hidden_units,
                mean_trials=self.trials,
                has_equal_trials=self.trial_distribution == "equal",
                requires_all_outputs=self.criterion == "all",
                learning_rate=np.float32(self.learning_rate),
            )
            training_set, test_set = draw_digit_sets(seed, run, self.tests_per_digit, self.noise)
            results = TrainingResults(
                weights=weights[row], n_trials=n_trials[row], n_wrong=n_wrong[row]
            )
            train_and_test(settings, training_set, test_set, scratch, results)
        errors = n_wrong / (N_DIGITS * self.tests_per_digit)
        innate_error = errors[:, :, 0]
        final_error = errors[:, :, 1]
        fitness = 1 - final_error
        # The test at the end of a lifetime counts as an evaluation.
        n_evaluations = n_trials + 1
        return LifeResults.without_cost(
            fitness,
            learned=weights,
            records={
                "innate_error": innate_error.astype(np.float32),
                "error": final_error.astype(np.float32),
                "used": n_evaluations,
            },
        )
