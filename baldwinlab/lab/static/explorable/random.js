/** A seeded generator of random numbers, so that a run can be repeated on each computer. */

/**
 * Return a function that returns uniform random numbers in [0, 1): sfc32 of C. Doty-Humphrey,
 * PractRand (2010).
 * @param {...number} keys integers, for example the seed of the page and the number of a run
 */
export function createRandom(...keys) {
  const state = [...keys, 0, 0, 0].slice(0, 3).map((key) => key | 0);
  let counter = 1;
  const draw = () => {
    const [a, b, c] = state;
    const sum = (a + b + counter) | 0;
    counter = (counter + 1) | 0;
    state[0] = b ^ (b >>> 9);
    state[1] = (c + (c << 3)) | 0;
    state[2] = (((c << 21) | (c >>> 11)) + sum) | 0;
    return (sum >>> 0) / 2 ** 32;
  };
  // The first numbers of similar keys are similar.
  for (let skipped = 0; skipped < 15; skipped++) draw();
  return draw;
}

/** Return a random integer from 0 to `count` - 1. */
export function drawInteger(random, count) {
  return Math.floor(random() * count);
}
