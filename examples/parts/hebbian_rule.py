"""A learning rule in one expression: Oja's rule, a Hebbian rule whose weights do not explode.

    baldwinlab run evo/A --part examples/parts/hebbian_rule.py --set learning.rule=oja \
        learning.rate=0.05

`compute_change` is called for every weight, in each step in which an agent learns. x and y are the
activations of the source unit and of the target unit.

Source: E. Oja, "Simplified neuron model as a principal component analyzer", Journal of Mathematical
Biology 15 (1982).
"""

from baldwinlab.parts import SynapticRule


class Oja(SynapticRule, name="oja"):
    """Weight changes rate * y (x - y w). Weights are limited to [-10, 10]."""

    @staticmethod
    def compute_change(part, state, synapse, lane):
        return synapse.y * (synapse.x - synapse.y * synapse.weight)

    @staticmethod
    def oracle(part, agents, agent, naive):
        for row, unit, x, y in naive.synapses(agent):
            weight = row[unit] + agent.rate * (x * y - y * y * row[unit])
            row[unit] = min(max(weight, -10.0), 10.0)
