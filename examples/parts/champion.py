"""A selection scheme: a parent is the fittest agent, or sometimes a random agent.

baldwinlab run evo/A --part examples/parts/champion.py --set evolution.selection=champion
"""

from baldwinlab.parts import Field, Selection


class Champion(Selection, name="champion"):
    """The fittest agent with probability `share`, otherwise a random agent."""

    share: float = Field(
        0.5, ge=0, le=1, description="Probability that a parent is the fittest agent."
    )

    @staticmethod
    def select(part, generation):
        fitness = generation.fitness
        best = 0
        for agent in range(fitness.size):
            if fitness[agent] > fitness[best]:
                best = agent
        for child in range(generation.parents.shape[0]):
            for side in range(2):
                random_agent = int(generation.uniforms[child, 0, side] * fitness.size)
                is_best = generation.uniforms[child, 1, side] < part.share
                generation.parents[child, side] = best if is_best else random_agent

    @staticmethod
    def oracle(part, generation):
        fitness = generation.fitness
        best = max(range(len(fitness)), key=lambda agent: fitness[agent])
        parents = []
        for agents, decisions in generation.uniforms:
            parents.append(
                [
                    best if decisions[side] < part.share else int(agents[side] * len(fitness))
                    for side in range(2)
                ]
            )
        return parents
