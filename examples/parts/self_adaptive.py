"""A variation whose mutations have an inherited step size: the gene `step_size` of the agent.

The gene mutates log-normally before the variation creates the child (Schwefel 1981). By default,
the size of this mutation is 1 / sqrt(2 n) for n weights (Beyer 2007).

    baldwinlab check examples/parts/self_adaptive.py
    baldwinlab run evo/A --part examples/parts/self_adaptive.py \\
        --set evolution.variation=my-self-adaptive

The study stores the gene of each agent as `gene_step_size`.
"""

from statistics import NormalDist

import numpy as np

from baldwinlab.parts import Gene, Variation, normal_quantile


class MySelfAdaptive(Variation, name="my-self-adaptive"):
    """A copy of one parent, in which all weights mutate with the step size of the child."""

    genes = {"step_size": Gene(initial=0.1, low=1e-4, high=10, mutation="log-normal")}

    @staticmethod
    def vary(part, mating):
        child = mating.child
        step_size = child[0, part.step_size]
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                inherited = (
                    mating.fitter[module, weight]
                    if mating.gate < 0.5
                    else mating.second[module, weight]
                )
                mutation = step_size * np.float32(normal_quantile(mating.draws[draw, 0]))
                child[module, weight] = inherited + mutation

    @staticmethod
    def oracle(part, fitter, second, draws, gate, genes):
        parent = fitter if gate < 0.5 else second
        mutations = NormalDist(0, genes["step_size"])
        remaining_draws = iter(draws)
        return [
            [weight + mutations.inv_cdf(next(remaining_draws)[0]) for weight in module]
            for module in parent
        ]
