/** The balance of the needle, as `balance_of_unset` in analysis/theory/needle.py. */

// Maximum gain in fitness above the baseline of 1.
const MAX_GAIN = 19;
// Halvings of the interval of the root, down to the precision of a number.
const HALVINGS = 60;

/** Return the mean fitness of a string with `unset` open switches and no wrong one. */
function computeExpectedFitness(unset, { trials, cost }) {
  const success = 0.5 ** unset;
  let fitness = 1;
  // The probability that the first success is this trial.
  let probability = success;
  for (let trial = 1; trial <= trials; trial++) {
    fitness += probability * MAX_GAIN * Math.max(0, 1 - (cost * trial) / trials);
    probability *= 1 - success;
  }
  return fitness;
}

/** Return the relative gain in fitness if one open switch becomes right. */
function computeSelection(unset, settings) {
  const count = Math.max(unset, 1);
  const fitness = computeExpectedFitness(count, settings);
  return (computeExpectedFitness(count - 1, settings) - fitness) / fitness;
}

/**
 * Return the share of open switches at which mutation, change and selection balance.
 * @param {{loci: number, trials: number, cost: number, mutationRate: number, period: number,
 *   redrawnLoci: number}} settings
 */
export function computeBalance(settings) {
  const { loci, mutationRate, period, redrawnLoci } = settings;
  const gain = mutationRate / 3 + redrawnLoci / (2 * loci * period);
  const loss = (2 * mutationRate) / 3;
  if (gain === 0) return 0;
  const computeSurplus = (share) =>
    (1 - share) * gain - share * (computeSelection(share * loci, settings) + loss);
  // The first root is that of populations that have found the needle.
  let high = 0;
  for (let locus = 0; locus <= loci; locus++) {
    high = locus / loci;
    if (computeSurplus(high) <= 0) break;
  }
  let low = 0;
  for (let halving = 0; halving < HALVINGS; halving++) {
    const middle = (low + high) / 2;
    if (computeSurplus(middle) > 0) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}
