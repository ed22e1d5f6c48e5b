"""Bit strings that guess in life: a whole model of another kind, in which learning finds a needle in a haystack for evolution.

    baldwinlab run bit-strings --part examples/parts/bit_strings.py --runs 10

Alleles are 0, 1 and ? (0.5 in a genome); right is 1 at every locus. A guess makes each ? a 0 or a 1 by chance, until all are
right; what is left of the guesses then is worth up to 19. G. E. Hinton and S. J. Nowlan, Complex Systems 1, 1987.
"""

import numpy as np

from baldwinlab.parts import FOUNDER, LIFE, Field, LifeResults, Model, Variable, Variation, uniforms


class BitStrings(Model, name="bit-strings"):
    """Strings of 0, 1 and ?, which guess what a ? should be."""

    loci: int = Field(20, ge=1, le=60, description="length of a string")
    guesses: int = Field(1000, ge=1, le=100_000, description="for which a life has time")
    guessing: bool = Field(
        True, description="whether a ? is guessed at all; if not, it is never right"
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 50, "variation": "one-point", "mutation_rate": 0.0},
    }
    records = {
        "unknown": Variable(
            ("generation", "agent"), np.int32, "loci", "loci that hold a ? at birth"
        )
    }
    learns = property(lambda self: self.guessing)
    steps = property(lambda self: self.guesses)

    def without_learning(self):
        return self.model_copy(update={"guessing": False})

    def weights(self):
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
        used = np.empty_like(unknown)
        for count in np.unique(unknown):
            wrong = np.cumprod(
                np.full(self.guesses, 1 - 1 / 2 ** int(count))
            )  # the chance of so many wrong guesses in a row
            used[unknown == count] = 1 + np.searchsorted(-wrong, -luck[unknown == count])
        found = (
            (genomes != 0).all(axis=-1) & (used <= self.guesses) & (self.guessing | (unknown == 0))
        )
        payoff = np.where(found, 1 + 19 * (self.guesses - used) / self.guesses, 1.0)
        learned = np.where(found[:, :, None], np.float32(1), genomes)
        return LifeResults(
            payoff, np.zeros_like(payoff), learned, {"unknown": unknown.astype(np.int32)}
        )

    def oracle(self, genome, luck):
        """The payoff of one string, guess by guess: it goes wrong so many times in a row as its luck, in (0, 1), is small."""
        unknown, wrong = sum(allele not in (0, 1) for allele in genome), 1.0
        for guess in range(1, self.guesses + 1):
            wrong *= 1 - 1 / 2**unknown
            if 0 not in genome and wrong <= luck and (self.guessing or not unknown):
                return 1 + 19 * (self.guesses - guess) / self.guesses
        return 1.0


class OnePoint(Variation, name="one-point"):
    """One parent's alleles up to a cut between two loci, the other's from there; a mutation draws an allele anew."""

    settings = ("mutation_rate",)
    derived = {"rate": lambda part, experiment: float(experiment.evolution.mutation_rate)}

    @staticmethod
    def vary(part, fitter, other, draws, gate, child):
        cut = 1 + int(gate * (child.shape[1] - 1))
        for locus in range(child.shape[1]):
            first = (locus < cut) == (
                draws[0, 0] < 0.5
            )  # whose alleles come first is left to chance, too
            child[0, locus] = fitter[0, locus] if first else other[0, locus]
            if draws[locus, 1] < part.rate:
                child[0, locus] = (
                    0.0 if draws[locus, 2] < 0.25 else 1.0 if draws[locus, 2] < 0.5 else 0.5
                )

    @staticmethod
    def oracle(part, fitter, other, draws, gate):
        cut = 1 + int(gate * (len(fitter[0]) - 1))
        one, two = (fitter[0], other[0]) if draws[0][0] < 0.5 else (other[0], fitter[0])
        anew = [0.0 if draw[2] < 0.25 else 1.0 if draw[2] < 0.5 else 0.5 for draw in draws]
        child = [*one[:cut], *two[cut:]]
        return [
            [
                new if draw[1] < part.rate else old
                for old, new, draw in zip(child, anew, draws, strict=True)
            ]
        ]
