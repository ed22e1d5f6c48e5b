"""A network with memory: the hidden units of the step before are inputs, too.

    baldwinlab run evo/A --part examples/parts/elman.py --set network.kind=elman

Source: J. L. Elman, "Finding Structure in Time", Cognitive Science 14 (1990). As there, learning does not reach back in time.
"""

from baldwinlab.models.miniworld.networks.feed_forward import FeedForward, feed_forward
from baldwinlab.parts import Network, get, put


class Elman(Network, name="elman"):
    """Layers of logistic units; the first hidden layer hears itself, as it was a step before."""

    is_memoryless = False
    derived = FeedForward.derived | {
        "inputs": lambda part, experiment: len(experiment.inputs),
        "context": lambda part, experiment: experiment.network.hidden[0],
    }
    backward = staticmethod(FeedForward.backward)

    def layers(self, inputs, hidden, actions):
        return (inputs + hidden[0], *hidden, actions)

    def memory(self, inputs, hidden, actions):
        return tuple((inputs + hidden[0] + unit, inputs + unit) for unit in range(hidden[0]))

    def check(self, experiment):
        if not experiment.network.hidden:
            raise ValueError(
                "network.kind = 'elman' remembers hidden units: network.hidden must have at least one layer"
            )

    @staticmethod
    def forward(part, weights, activations, lane):
        for unit in range(
            part.context
        ):  # the units behind the inputs keep what the hidden ones were
            put(
                activations,
                part.inputs + unit,
                lane,
                get(activations, part.inputs + part.context + unit, lane),
            )
        feed_forward(part.sizes, part.biases, weights, activations, lane)

    @staticmethod
    def oracle(part, agent, naive):
        """`agent.hidden` is what the first hidden layer was a step before: zeros at birth."""
        return naive.think(agent.action_module, [*agent.inputs, *agent.hidden])
