"""The model `digit-readers`: settings, records and measures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.models import kit
from baldwinlab.models.digit_readers.digits import N_DIGITS, N_PIXELS, draw_digit_sets
from baldwinlab.models.digit_readers.training import (
    TrainingResults,
    TrainingSettings,
    train_and_test,
)
from baldwinlab.models.digit_readers.variation import LEVEL_STEP, MAX_WEIGHT, N_LEVELS
from baldwinlab.parts import Field, LifeResults, Model, Variable


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
    lifetime_steps = "trials"
    settings_without_learning = {"trials": 0}
    measures = kit.measure_last_means(
        {
            "innate_error": "share of digits misclassified at birth",
            "error": "share of digits misclassified after learning",
        }
    )

    def n_weights(self) -> int:
        return (N_PIXELS + 1) * self.hidden_units + (self.hidden_units + 1) * N_DIGITS

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        draws = kit.draw_founder_numbers(key, agents, self.n_weights())
        levels = (N_LEVELS * draws).astype(np.int64)
        weights: kit.Genomes = levels.astype(np.float32) * LEVEL_STEP - MAX_WEIGHT
        return weights

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
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
        # The test at the end of a lifetime counts as an evaluation.
        records = {"innate_error": errors[..., 0], "error": errors[..., 1], "used": n_trials + 1}
        return self.make_results(1 - errors[..., 1], records, learned=weights)
