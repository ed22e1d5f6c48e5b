"""A selection scheme: only the single best breeds, now and then somebody else.

baldwinlab run evo/A --part examples/parts/own_selection.py --set evolution.selection=champion
"""

from baldwinlab.parts import Field, Selection


class Champion(Selection, name="champion"):
    """The fittest agent is a parent with a certain probability, else anybody is."""

    share: float = Field(
        0.5, ge=0, le=1, description="probability that a parent is the fittest agent"
    )

    @staticmethod
    def select(part, fitness, uniforms, shares, order, parents):
        best = 0
        for agent in range(fitness.size):
            if fitness[agent] > fitness[best]:
                best = agent
        for child in range(parents.shape[0]):
            for side in range(2):
                anybody = int(uniforms[child, 0, side] * fitness.size)
                parents[child, side] = best if uniforms[child, 1, side] < part.share else anybody

    @staticmethod
    def oracle(part, fitness, uniforms):
        best = max(range(len(fitness)), key=lambda agent: fitness[agent])
        return [
            [
                best if favour < part.share else int(anybody * len(fitness))
                for anybody, favour in zip(*draws, strict=True)
            ][:2]
            for draws in uniforms
        ]
