"""The keys of the random numbers of a generation, and the types of arrays in evolution.

Functions of evolution work on the runs of a batch. Their arrays have the first dimension `run`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison, rng
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.engine.threads import run_in_ranges

# [agent, module, weight], or [run, agent, module, weight].
Genome = npt.NDArray[np.float32]
# [agent], or [run, agent].
Fitness = npt.NDArray[np.float64]
# [index, draw, 4], or [run, index, draw, 4], in (0, 1).
Uniforms = npt.NDArray[np.float64]
# [child, 2], or [run, child, 2], the fitter parent first.
Parents = npt.NDArray[np.int32]

# Minimum number of agents for which a thread does the work between two lifetimes. It takes some
# milliseconds.
MIN_AGENTS_PER_THREAD: Final = 1_000


class GenerationKey(NamedTuple):
    """Seed, run and generation, which determine the random numbers of a generation."""

    seed: int
    run: int
    generation: int

    def previous(self) -> GenerationKey:
        """Return the key of the previous generation of the same run."""
        return self._replace(generation=self.generation - 1)

    def as_run_keys(self) -> RunKeys:
        """Return the keys of a batch that contains only this run."""
        return RunKeys(self.seed, np.array([self.run]), self.generation)

    def uniforms(self, purpose: int, shape: tuple[int, int]) -> Uniforms:
        """Return uniform numbers in (0, 1), of shape (*shape, 4): [index, draw, 4]."""
        return rng.uniforms(*self, purpose, shape)


class RunKeys(NamedTuple):
    """The keys of the same generation of several runs."""

    seed: int
    runs: npt.NDArray[np.int64]  # [run].
    generation: int

    def previous(self) -> RunKeys:
        """Return the keys of the previous generation of the same runs."""
        return self._replace(generation=self.generation - 1)

    def key(self, run_index: int) -> GenerationKey:
        """Return the key of one run."""
        return GenerationKey(self.seed, int(self.runs[run_index]), self.generation)

    def uniforms(self, purpose: int, shape: tuple[int, int]) -> Uniforms:
        """Return uniform numbers in (0, 1), of shape (run, *shape, 4): [run, index, draw, 4]."""
        out = poison.empty((len(self.runs), *shape, 4))
        split_runs(range(len(out)), shape[0], partial(_draw_of_runs, self, purpose, out))
        return out


def make_run_keys(seed: int, runs: npt.ArrayLike, generation: int) -> RunKeys:
    """Return the keys of a generation of several runs."""
    return RunKeys(seed, np.array(runs, np.int64), generation)


def split_runs(runs: range, n_agents: int, function: Callable[[int, int], None]) -> None:
    """Call `function` with the first run and the end of ranges, in the threads of the context.

    `n_agents`: number of agents in each run.
    """
    run_in_ranges(
        lambda first, end: function(runs.start + first, runs.start + end),
        len(runs),
        max(1, MIN_AGENTS_PER_THREAD // max(1, n_agents)),
    )


@jit_entry_point
def _draw_of_runs(keys: RunKeys, purpose: int, out: Uniforms, first_run: int, end_run: int) -> None:
    for run in range(first_run, end_run):
        for index in range(out.shape[1]):
            rng.draw_uniforms(
                keys.seed, keys.runs[run], keys.generation, purpose, index, out[run, index]
            )
