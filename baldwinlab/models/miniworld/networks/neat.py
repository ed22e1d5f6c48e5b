"""Networks with an evolving topology (NEAT), for agents of MiniWorld.

The network kind `neat` needs the variation `neat`. The selection `species` is recommended.

Instead of weights, the array of the weights contains a list of links (`evolution/neat/genome.py`).
`network.hidden = [40]` reserves memory for up to 40 links. The rows of units are the inputs, one
row per reserved link, and the outputs. The activation of a hidden node is in the row of the first
incoming link of the node. Other rows of links are 0.

Source: Stanley and Miikkulainen 2002, section 3. By our interpretation, a node is evaluated after
all sources of the node.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from baldwinlab.engine.simd import Lane, first_lane, lanes_of
from baldwinlab.evolution.neat.genome import (
    INFINITE_GENES,
    SIGMOID_SLOPE,
    activate,
    count_entries,
    list_links,
    require_neat,
)
from baldwinlab.parts import Network


def max_links(weights: int, hidden: int) -> int:
    """Return the maximum number of links in `weights` entries and `hidden` rows of units."""
    entries_per_link = count_entries(1) - count_entries(0)
    links_in_weights = (weights - count_entries(0)) // entries_per_link
    return max(0, min(hidden, links_in_weights))


def _max_links_of_experiment(experiment: Any) -> int:
    """Return the maximum number of links in the network of an experiment."""
    return max_links(experiment.weight_count, sum(experiment.network.hidden))


class NeatNetwork(Network, name="neat"):
    """A network without loops. The nodes and links evolve, and do not change during life.

    References
    ----------
    Stanley and Miikkulainen 2002.
    """

    has_graph_genomes: ClassVar[bool] = True
    infinite_genes: ClassVar[tuple[int, ...]] = INFINITE_GENES
    required_settings: ClassVar[Mapping[str, Any]] = {
        "network.hidden": [40],
        "learning.rule": "none",
        "evolution.variation": "neat",
        "evolution.selection": "species",
    }
    sigmoid_slope: float = SIGMOID_SLOPE

    derived: ClassVar[Mapping[str, Any]] = {
        "inputs": lambda part, experiment: len(experiment.inputs),
        "outputs": lambda part, experiment: len(experiment.actions),
        "max_links": lambda part, experiment: _max_links_of_experiment(experiment),
    }

    def check(self, experiment: Any) -> None:
        network = experiment.network
        if experiment.learning.rule != "none":
            raise ValueError(
                f"network.kind = 'neat' does not learn: "
                f"learning.rule = {experiment.learning.rule!r} must be 'none'"
            )
        require_neat(experiment, "network.kind = 'neat'")
        if network.biases:
            raise ValueError(
                "network.kind = 'neat' has its bias as a node: network.biases must be false"
            )
        needed_links = (len(experiment.inputs) + 1) * len(experiment.actions)
        possible_links = _max_links_of_experiment(experiment)
        if len(network.hidden) != 1 or possible_links < needed_links:
            raise ValueError(
                f"network.kind = 'neat' starts with {needed_links} links, but can hold only "
                f"{possible_links}: network.hidden must be one number, the maximum number "
                "of links, for example [40]"
            )

    @staticmethod
    def forward(part: Any, weights: Any, activations: Any, lane: Lane) -> None:
        # Agents have different graphs, so that a SIMD block is computed lane by lane.
        for column in range(first_lane(lane), first_lane(lane) + lanes_of(lane)):
            activate(
                weights[:, column],
                part.inputs,
                part.outputs,
                part.sigmoid_slope,
                activations[:, column],
            )

    @staticmethod
    def links(part: Any, weights: Any, units: int, lane: int, table: Any) -> int:
        return list_links(weights[:, lane], part.inputs, part.outputs, units, table)
