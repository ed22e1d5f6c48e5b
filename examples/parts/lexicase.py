"""Lexicase selection: parents are compared on one region of food after another, in random order.

baldwinlab run evo/A --part examples/parts/lexicase.py --set evolution.selection=by-region
"""

from baldwinlab.parts import Selection, compiled, draw


@compiled
def shuffle(stream, first_draw, cases, count):
    """Write the numbers of the cases in random order."""
    for case in range(count):
        cases[case] = case
    for last in range(count - 1, 0, -1):
        swapped = int(draw(stream, first_draw + last) * (last + 1))
        cases[last], cases[swapped] = cases[swapped], cases[last]


class ByRegion(Selection, name="by-region"):
    """The agent with most food of a random region. The next region decides between equals."""

    def check(self, experiment):
        if len(experiment.world.food) > experiment.population.size:
            raise ValueError("by-region needs at least one agent per region of food")

    @staticmethod
    def select_with_genomes(part, stream, lifetimes, fitness, uniforms, shares, order, parents):
        regions = lifetimes.eaten.shape[1]
        for child in range(parents.shape[0]):
            for side in range(2):
                shuffle(stream, (2 * child + side) * regions, shares, regions)
                count = fitness.size
                for agent in range(count):
                    order[agent] = agent
                for number in range(regions):
                    region = int(shares[number])
                    best = 0
                    for candidate in range(count):
                        best = max(best, lifetimes.eaten[order[candidate], region])
                    remaining = 0
                    for candidate in range(count):
                        if lifetimes.eaten[order[candidate], region] == best:
                            order[remaining] = order[candidate]
                            remaining += 1
                    count = remaining
                parents[child, side] = order[int(uniforms[child, 0, side] * count)]

    @staticmethod
    def oracle(part, stream, lifetimes, fitness, uniforms):
        def find_parent(child, side):
            order = list(range(len(lifetimes.eaten[0])))
            shuffle(stream, (2 * child + side) * len(order), order, len(order))
            keys = [[eaten[region] for region in order] for eaten in lifetimes.eaten]
            best = [agent for agent, key in enumerate(keys) if key == max(keys)]
            return best[int(uniforms[child][0][side] * len(best))]

        return [[find_parent(child, side) for side in range(2)] for child in range(len(uniforms))]
