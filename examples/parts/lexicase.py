"""Lexicase selection: parents are compared on one region of food after another, in random order.

baldwinlab run evo/A --part examples/parts/lexicase.py --set evolution.selection=by-region
"""

from baldwinlab.parts import Selection, compiled, draw


@compiled
def next_region(stream, first_draw, regions, previous):
    """Return the region with the next larger random number, or -1."""
    limit = draw(stream, first_draw + previous) if previous >= 0 else 0.0
    following = -1
    for region in range(regions):
        key = draw(stream, first_draw + region)
        if key > limit and (following < 0 or key < draw(stream, first_draw + following)):
            following = region
    return following


class ByRegion(Selection, name="by-region"):
    """The agent with most food of a random region. The next region decides between equals."""

    @staticmethod
    def select(part, generation):
        order = generation.order
        regions = generation.lifetimes.eaten.shape[1]
        for child in range(generation.parents.shape[0]):
            for side in range(2):
                first_draw = (2 * child + side) * regions
                count = generation.fitness.size
                for agent in range(count):
                    order[agent] = agent
                region = next_region(generation.stream, first_draw, regions, -1)
                while region >= 0:
                    best = 0
                    for candidate in range(count):
                        best = max(best, generation.lifetimes.eaten[order[candidate], region])
                    remaining = 0
                    for candidate in range(count):
                        if generation.lifetimes.eaten[order[candidate], region] == best:
                            order[remaining] = order[candidate]
                            remaining += 1
                    count = remaining
                    region = next_region(generation.stream, first_draw, regions, region)
                generation.parents[child, side] = order[
                    int(generation.uniforms[child, 0, side] * count)
                ]

    @staticmethod
    def oracle(part, generation):
        def find_parent(child, side):
            regions = range(len(generation.lifetimes.eaten[0]))
            first_draw = (2 * child + side) * len(regions)
            order = sorted(regions, key=lambda region: draw(generation.stream, first_draw + region))
            keys = [[eaten[region] for region in order] for eaten in generation.lifetimes.eaten]
            best = [agent for agent, key in enumerate(keys) if key == max(keys)]
            return best[int(generation.uniforms[child][0][side] * len(best))]

        return [
            [find_parent(child, side) for side in range(2)]
            for child in range(len(generation.uniforms))
        ]
