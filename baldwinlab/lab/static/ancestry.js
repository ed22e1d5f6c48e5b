/** Find the ancestors of an agent in a run of the browser engine, as lab/history.py. */

/**
 * @param {{parents: Int32Array, food_eaten: Int32Array}[]} generations all generations up to that
 *   of the agent; parents are [agent, (fitter, other)]
 * @param {number} agent
 * @returns {import("./ancestors.js").Line}
 */
export function findAncestorLine(generations, agent) {
  const agents = [agent];
  const partners = [];
  const ancestorSets = [new Set([agent])];
  let first = generations.length - 1;
  for (; generations[first].parents[2 * agents[0]] >= 0; first -= 1) {
    const couple = (child) =>
      Array.from(generations[first].parents.subarray(2 * child, 2 * child + 2));
    ancestorSets.unshift(new Set([...ancestorSets[0]].flatMap(couple)));
    const [fitter, partner] = couple(agents[0]);
    agents.unshift(fitter);
    partners.unshift(partner);
  }
  const eaten = (line) => line.map((agent, index) => generations[first + index].food_eaten[agent]);
  const mean = generations
    .slice(first)
    .map(({ food_eaten }) => food_eaten.reduce((sum, items) => sum + items, 0) / food_eaten.length);
  return {
    first,
    agents,
    eaten: eaten(agents),
    partners,
    eaten_by_partners: eaten(partners),
    ancestors: ancestorSets.map(({ size }) => size),
    mean,
  };
}
