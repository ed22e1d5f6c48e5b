"""Hawks and doves: a model whose view is a matrix, as small as one can be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from baldwinlab.parts import FOUNDER, LifeResults, MatrixView, Model, View

PAYOFFS = np.array([[0.0, 4.0], [1.0, 2.0]])  # of hawk and dove, against hawk and dove


def payoffs(model: Any, moment: Any, genomes: npt.NDArray[np.float32], agent: int) -> MatrixView:
    hawks = (genomes > 0.5).mean()
    names = [f"hawk ({hawks:.0%})", f"dove ({1 - hawks:.0%})"]
    return MatrixView(
        names, ["hawk", "dove"], PAYOFFS, "payoff of the row's strategy against the column's"
    )


class Hawks(Model, name="hawks-and-doves"):
    """Hawks and doves, each of whom meets everybody."""

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 20},
        "evolution": {"generations": 4},
    }
    views: ClassVar[Mapping[str, View]] = {
        "payoffs": View("What strategies get against each other.", payoffs, of_an_agent=False)
    }

    def weights(self) -> int:
        return 1

    def founders(self, agents: int, moment: Any) -> npt.NDArray[np.float32]:
        return moment.uniforms(FOUNDER, (agents, 1))[:, :, :1].astype(np.float32)  # type: ignore[no-any-return]

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        dove = (genomes[:, :, 0, 0] <= 0.5).astype(int)
        met = np.stack([1 - dove.mean(axis=1), dove.mean(axis=1)], axis=-1)
        energy = (PAYOFFS[dove] * met[:, None]).sum(axis=-1)
        return LifeResults(energy, np.zeros_like(energy), None, {})
