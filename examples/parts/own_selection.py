"""A selection scheme: only the single best breeds, now and then somebody else.

    baldwinlab run evo/A --part examples/parts/own_selection.py --set evolution.selection=champion
"""

from baldwinlab.parts import Field, Selection


class Champion(Selection, name="champion"):
    """The fittest agent is a parent with a certain probability, else anybody is."""

    share: float = Field(0.5, ge=0, le=1, description="probability that a parent is the fittest agent")

    @staticmethod
    def select(part, fitness, draws, parents):
        best = 0
        for agent in range(fitness.size):
            if fitness[agent] > fitness[best]:
                best = agent
        for child in range(parents.shape[0]):
            for side in range(2):
                anybody = int(draws[child, side, 0] * fitness.size)
                parents[child, side] = best if draws[child, side, 1] < part.share else anybody
