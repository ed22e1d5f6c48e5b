"""A model: bit strings that learn by guessing (Hinton and Nowlan 1987).

    baldwinlab run bit-strings --part examples/parts/bit_strings.py --runs 10

The alleles are 0, 1 and ?, which is 0.5 in a genome. The correct allele is 1 at every locus.
A guess sets each ? to 0 or 1 at random. Learning ends when all loci are correct.
The fitness is 1, plus up to 19 for the guesses that remain.

Source: G. E. Hinton and S. J. Nowlan, "How learning can guide evolution", Complex Systems 1 (1987).
"""

import numpy as np

from baldwinlab.parts import FOUNDER, LIFE, Field, Model, Variable, Variation, uniforms


class BitStrings(Model, name="bit-strings"):
    """Strings of the alleles 0, 1 and ?, with guesses for each ?."""

    loci: int = Field(20, ge=1, le=60, description="Number of loci.")
    guesses: int = Field(1000, ge=1, le=100_000, description="Number of guesses in a lifetime.")
    guessing: bool = Field(True, description="Whether agents guess. Otherwise ? is never correct.")

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 50, "variation": "one-point", "mutation_rate": 0.0},
    }
    records = {"unknown": Variable.integer("loci", "number of loci with ? at birth")}
    settings_without_learning = {"guessing": False}
    lifetime_steps = "guesses"

    def n_weights(self):
        return self.loci

    def founders(self, agents, key):
        draws = key.uniforms(FOUNDER, (agents, self.loci))[:, :, 0]
        return np.select([draws < 0.25, draws < 0.5], [0.0, 1.0], 0.5)[:, None].astype(np.float32)

    def simulate(self, seed, runs, generation, genomes):
        genomes = genomes[:, :, 0]
        luck = np.stack(
            [uniforms(seed, run, generation, LIFE, (genomes.shape[1], 1))[:, 0, 0] for run in runs]
        )
        unknown = ((genomes != 0) & (genomes != 1)).sum(axis=-1)
        # Number of guesses up to the first correct one.
        used = np.empty_like(unknown)
        for count in np.unique(unknown):
            # Probability that the first n guesses are wrong, for each n.
            wrong = np.cumprod(np.full(self.guesses, 1 - 1 / 2 ** int(count)))
            used[unknown == count] = 1 + np.searchsorted(-wrong, -luck[unknown == count])
        can_succeed = (genomes != 0).all(axis=-1) & (self.guessing | (unknown == 0))
        succeeded = can_succeed & (used <= self.guesses)
        payoff = np.where(succeeded, 1 + 19 * (self.guesses - used) / self.guesses, 1.0)
        learned = np.where(succeeded[:, :, None], np.float32(1), genomes)
        return self.make_results(payoff, {"unknown": unknown}, learned=learned)

    def oracle(self, genome, luck):
        """Return the payoff of one string. A small `luck`, in (0, 1), means many wrong guesses."""
        unknown = sum(allele not in (0, 1) for allele in genome)
        wrong = 1.0
        for guess in range(1, self.guesses + 1):
            wrong *= 1 - 1 / 2**unknown
            if 0 not in genome and wrong <= luck and (self.guessing or not unknown):
                return 1 + 19 * (self.guesses - guess) / self.guesses
        return 1.0


class OnePoint(Variation, name="one-point"):
    """One-point crossover; a mutation draws a new allele."""

    reads = ("mutation_rate",)

    @staticmethod
    def vary(part, mating):
        child = mating.child
        draws = mating.draws
        cut = 1 + int(mating.gate * (child.shape[1] - 1))
        for locus in range(child.shape[1]):
            # The order of the parents is random.
            is_fitter = (locus < cut) == (draws[0, 0] < 0.5)
            child[0, locus] = mating.fitter[0, locus] if is_fitter else mating.second[0, locus]
            if draws[locus, 1] < part.mutation_rate:
                if draws[locus, 2] < 0.25:
                    child[0, locus] = 0.0
                elif draws[locus, 2] < 0.5:
                    child[0, locus] = 1.0
                else:
                    child[0, locus] = 0.5

    @staticmethod
    def oracle(part, fitter, second, draws, gate):
        cut = 1 + int(gate * (len(fitter[0]) - 1))
        parents = [fitter[0], second[0]] if draws[0][0] < 0.5 else [second[0], fitter[0]]
        child = [*parents[0][:cut], *parents[1][cut:]]
        for locus, draw in enumerate(draws):
            if draw[1] < part.mutation_rate:
                alleles = [0.0, 1.0, 0.5, 0.5]
                child[locus] = alleles[int(draw[2] * 4)]
        return [child]
