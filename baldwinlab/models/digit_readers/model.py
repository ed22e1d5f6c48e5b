"""The model `digit-readers`: settings, records and measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.models.digit_readers.digits import N_DIGITS, N_PIXELS, draw_digit_sets
from baldwinlab.models.digit_readers.training import train_and_test
from baldwinlab.models.digit_readers.variation import LEVEL_STEP, MAX_WEIGHT, N_LEVELS
from baldwinlab.parts import (
    FOUNDER,
    PER_AGENT_DIMS,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
)


def _mean_of_last_generation(record: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return a function of runs: the mean of a record in the last generation."""
    return lambda runs: runs[record].isel(generation=-1).mean("agent")


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

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 100},
        "evolution": {
            "generations": 51,
            "selection": "truncation",
            "variation": "four-bit-weights",
            "mutation_rate": 0.005,
        },
        "record": {"genome_every": 5},
    }
    payoff: ClassVar[str] = "share of digits classified correctly"
    records: ClassVar[Mapping[str, Variable]] = {
        "innate_error": Variable(
            PER_AGENT_DIMS, np.float32, "1", "share of digits misclassified at birth"
        ),
        "error": Variable(
            PER_AGENT_DIMS, np.float32, "1", "share of digits misclassified at the end of life"
        ),
        "used": Variable(
            PER_AGENT_DIMS, np.int32, "trials", "trials in the lifetime, and the test at its end"
        ),
    }
    clock: ClassVar[str] = "used"
    measures: ClassVar[Mapping[str, Measure]] = {
        "innate-error": Measure(
            "share of digits misclassified at birth in the last generation",
            _mean_of_last_generation("innate_error"),
        ),
        "error": Measure(
            "share of digits misclassified after learning in the last generation",
            _mean_of_last_generation("error"),
        ),
    }

    @property
    def learns(self) -> bool:
        return self.trials > 0

    @property
    def steps(self) -> int:
        return max(1, self.trials)

    def without_learning(self) -> DigitReaders:
        return self.model_copy(update={"trials": 0})

    def n_weights(self) -> int:
        return (N_PIXELS + 1) * self.hidden_units + (self.hidden_units + 1) * N_DIGITS

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.n_weights()))[:, None, :, 0]
        levels = (N_LEVELS * draws).astype(np.int64)
        weights: npt.NDArray[np.float32] = levels.astype(np.float32) * LEVEL_STEP - MAX_WEIGHT
        return weights

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        learned = genomes[:, :, 0].copy()
        used_trials = poison.empty(learned.shape[:2], np.int32)
        n_wrong = poison.empty((*learned.shape[:2], 2), np.int32)
        scratch = poison.empty((3, max(self.hidden_units, N_DIGITS)), np.float32)
        for row, run in enumerate(runs):
            settings = np.array(
                [
                    seed,
                    run,
                    generation,
                    self.hidden_units,
                    self.trials,
                    self.trial_distribution == "spread",
                ],
                np.int64,
            )
            training_set, test_set = draw_digit_sets(seed, run, self.tests_per_digit, self.noise)
            train_and_test(
                settings,
                self.criterion == "all",
                np.float32(self.learning_rate),
                training_set,
                test_set,
                learned[row],
                scratch,
                used_trials[row],
                n_wrong[row],
            )
        errors = n_wrong / (N_DIGITS * self.tests_per_digit)
        innate = errors[:, :, 0].astype(np.float32)
        error = errors[:, :, 1].astype(np.float32)
        energy = 1 - errors[:, :, 1]
        # The test at the end of a lifetime counts as an evaluation.
        return LifeResults(
            energy,
            np.zeros_like(energy),
            learned,
            {"innate_error": innate, "error": error, "used": used_trials + 1},
        )
