"""The game of hawks and doves: a minimal model with a matrix as view, and a negative fitness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from baldwinlab.parts import FOUNDER, Fitness, LifeResults, MatrixView, Model, View

# The payoffs [strategy of the row, strategy of the column] of hawk and dove.
PAYOFFS = np.array([[0.0, 4.0], [1.0, 2.0]])


def payoffs(model: Any, key: Any, genomes: npt.NDArray[np.float32], agent: int) -> MatrixView:
    hawks = (genomes > 0.5).mean()
    names = [f"hawk ({hawks:.0%})", f"dove ({1 - hawks:.0%})"]
    return MatrixView(
        names, ["hawk", "dove"], PAYOFFS, "payoff of the row's strategy against the column's"
    )


class Hawks(Model, name="hawks-and-doves"):
    """Hawks and doves. Each agent plays against all agents."""

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 20},
        "evolution": {"generations": 4},
    }
    views: ClassVar[Mapping[str, View]] = {
        "payoffs": View(
            "The payoff of each strategy against each strategy.", payoffs, has_agent_choice=False
        )
    }

    def n_weights(self) -> int:
        return 1

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        return key.uniforms(FOUNDER, (agents, 1))[:, :, :1].astype(np.float32)  # type: ignore[no-any-return]

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        # [run, agent]: index of the strategy in `PAYOFFS`, 0 (hawk) or 1 (dove).
        dove = (genomes[:, :, 0, 0] <= 0.5).astype(int)
        frequencies = np.stack([1 - dove.mean(axis=1), dove.mean(axis=1)], axis=-1)
        energy = (PAYOFFS[dove] * frequencies[:, None]).sum(axis=-1)
        return self.make_results(energy, {})


class Debt(Fitness, name="debt"):
    """The same negative fitness for all agents."""

    @staticmethod
    def evaluate(part: Any, lifetimes: Any, fitness: Any) -> None:
        for agent in range(fitness.size):
            fitness[agent] = -50.0
