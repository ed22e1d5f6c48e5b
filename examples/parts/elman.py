"""A network with memory: the previous activations of the hidden units are further inputs.

    baldwinlab run evo/A --part examples/parts/elman.py --set network.kind=elman

Learning does not propagate back in time.

Source: J. L. Elman, "Finding Structure in Time", Cognitive Science 14 (1990).
"""

from baldwinlab.models.miniworld.networks.feed_forward import FeedForward, feed_forward
from baldwinlab.parts import Network, get, put


class Elman(Network, name="elman"):
    """Layers of logistic units; the first hidden layer also gets its own previous activations."""

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
                "network.kind = 'elman' needs at least one hidden layer (network.hidden)"
            )

    @staticmethod
    def forward(part, weights, activations, lane):
        # The units after the inputs store the previous activations of the hidden units.
        for unit in range(part.context):
            previous = get(activations, part.inputs + part.context + unit, lane)
            put(activations, part.inputs + unit, lane, previous)
        feed_forward(part.sizes, part.biases, weights, activations, lane)

    @staticmethod
    def oracle(part, agent, naive):
        """Return the outputs. `agent.hidden` contains the previous activations, 0 at birth."""
        return naive.think(agent.action_module, [*agent.inputs, *agent.hidden])
