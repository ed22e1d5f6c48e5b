"""Genetic variance by rare large mutations around an optimum that does not move."""


def variance_of_rare_mutations(mutation_rate: float, width_squared: float) -> float:
    """Return the variance in the house-of-cards approximation: learning decreases the mismatch.

    Mutants are rare, and each is lost before the next mutation of its lineage. A mutant at the
    distance d has the disadvantage d^2 / (2 V_L). The expected share of mutants is 2 mu V_L / d^2,
    so the variance is v = 2 mu V_L. The mismatch then decreases with 1 - a. The law holds at an
    optimum that does not move, if the variance of a mutation is well above v.

    Parameters
    ----------
    mutation_rate : float
        Probability mu of a mutation per birth.
    width_squared : float
        V_L, from `selection_variance`.

    Returns
    -------
    float
        Genetic variance v at birth.
    """
    return 2 * mutation_rate * width_squared
