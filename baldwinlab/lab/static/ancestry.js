/** From whom an agent descends, from what a page without a server has seen of its run: as lab/history.py tells it. */

/**
 * @param {{parents: Int32Array, food_eaten: Int32Array}[]} lived each generation up to the agent's; parents are [agent, (fitter, other)]
 * @param {number} agent
 * @returns {import("./ancestors.js").Line}
 */
export function ancestorLine(lived, agent) {
  const [agents, others, everybody] = [[agent], [], [new Set([agent])]];
  let first = lived.length - 1;
  for (; lived[first].parents[2 * agents[0]] >= 0; first -= 1) {
    const couple = (child) => Array.from(lived[first].parents.subarray(2 * child, 2 * child + 2));
    everybody.unshift(new Set([...everybody[0]].flatMap(couple)));
    const [fitter, other] = couple(agents[0]);
    agents.unshift(fitter);
    others.unshift(other);
  }
  const eaten = (line) => line.map((one, at) => lived[first + at].food_eaten[one]);
  const mean = lived
    .slice(first)
    .map(({ food_eaten }) => food_eaten.reduce((sum, items) => sum + items, 0) / food_eaten.length);
  return {
    first,
    agents,
    eaten: eaten(agents),
    others,
    eaten_of_others: eaten(others),
    ancestors: everybody.map(({ size }) => size),
    mean,
  };
}
