/**
 * Record lifetimes in the browser, as lab/recording.py and lab/agent_inspector.py. Needs no page.
 */

// Samples of the weights over a lifetime, including birth and death.
const WEIGHT_SAMPLES = 201;
// With more inputs, the table of all input combinations is left out.
const MAX_TABLE_INPUTS = 4;
// Bytes of one recording.
const MAX_BYTES = 64_000_000;

/** Return the steps of one recording from `first`, limited by its size. */
export function limitSpan({ lifetime: { steps }, population: { size } }, first = 0, last = steps) {
  return {
    first,
    last: Math.min(last, first + Math.max(1, Math.floor(MAX_BYTES / (20 * size))), steps),
  };
}

/**
 * @param {import("./simulation.js").Run} run prepared, with the genomes of a generation
 * @param {{generation: number, first: number, last: number, appearance: object}} span
 * @returns {Object<string, ArrayLike<number>>} as in lab/recording.py
 */
export function recordLifetime(run, { generation, first, last, appearance }) {
  const { engine } = run;
  const agents = run.experiment.population.size;
  const inputs = appearance.inputs.length;
  const steps = last - first;
  const inputBytes = Math.ceil(inputs / 8);
  // Inputs are numbers instead of bits.
  const numbers = appearance.is_continuous.some(Boolean);
  const arrays = {
    x: new Float32Array(steps * agents),
    y: new Float32Array(steps * agents),
    heading: new Uint8Array(steps * agents),
    sensor: numbers
      ? new Float32Array(steps * agents * inputs)
      : new Uint8Array(steps * agents * inputBytes),
    action: new Uint8Array(steps * agents),
    eaten_in_life: new Uint32Array(steps * agents),
  };
  const state = openArrays(engine, [
    "positions",
    "heading",
    "activations",
    "action",
    "eaten_in_life",
    "item_x",
    "item_y",
    "touched",
  ]);
  const teachers = engine.plan.teacher_array ? engine.array(engine.plan.teacher_array) : null;
  // A rule can store any integer type.
  if (teachers) arrays.teacher = new Uint32Array(steps * agents);
  const lanes = state.heading.length;
  const regions = state.eaten_in_life.length / state.heading.length;
  const moves = { step: [], item: [], x: [], y: [] };
  run.startGeneration(generation);
  run.simulateSteps(0, first);
  arrays.item_x = state.item_x.slice();
  arrays.item_y = state.item_y.slice();
  // A world feature can also move items.
  const previous = { x: state.item_x.slice(), y: state.item_y.slice() };
  for (let step = first; step < last; step++) {
    const row = (step - first) * agents;
    arrays.x.set(state.positions.subarray(0, agents), row);
    arrays.y.set(state.positions.subarray(lanes, lanes + agents), row);
    arrays.heading.set(state.heading.subarray(0, agents), row);
    run.simulateSteps(step, step + 1);
    arrays.action.set(state.action.subarray(0, agents), row);
    arrays.teacher?.set(Uint32Array.from(teachers.subarray(0, agents), Number), row);
    for (let agent = 0; agent < agents; agent++) {
      for (let region = 0; region < regions; region++)
        arrays.eaten_in_life[row + agent] += state.eaten_in_life[region * lanes + agent];
      for (let input = 0; input < inputs; input++) {
        const value = state.activations[input * lanes + agent];
        if (numbers) arrays.sensor[(row + agent) * inputs + input] = value;
        else if (value > 0)
          arrays.sensor[(row + agent) * inputBytes + (input >> 3)] |= 1 << (input & 7);
      }
    }
    if (step + 1 === last) break;
    for (let item = 0; item < state.touched.length; item++) {
      if (
        state.touched[item] !== step &&
        state.item_x[item] === previous.x[item] &&
        state.item_y[item] === previous.y[item]
      )
        continue;
      for (const [name, value] of Object.entries({
        step: step + 1,
        item,
        x: state.item_x[item],
        y: state.item_y[item],
      }))
        moves[name].push(value);
    }
    previous.x.set(state.item_x);
    previous.y.set(state.item_y);
  }
  arrays.move_step = Uint32Array.from(moves.step);
  arrays.move_item = Uint32Array.from(moves.item);
  arrays.move_x = Float32Array.from(moves.x);
  arrays.move_y = Float32Array.from(moves.y);
  return arrays;
}

/** @returns {Object<string, ArrayLike<number>>} as in lab/agent_inspector.py, of one agent */
export function inspectAgent(run, { generation, first, last, appearance, agent }) {
  const { engine, experiment } = run;
  const steps = experiment.lifetime.steps;
  const state = openArrays(engine, [
    "weights",
    "activations",
    "action",
    "eaten_in_life",
    "heading",
  ]);
  const lanes = state.heading.length;
  const column = (array) =>
    Float32Array.from({ length: array.length / lanes }, (_, row) => array[row * lanes + agent]);
  const samples = [
    ...new Set(
      Array.from({ length: WEIGHT_SAMPLES }, (_, number) =>
        Math.floor((steps * number) / (WEIGHT_SAMPLES - 1)),
      ),
    ),
  ];
  const weights = [];
  const activations = [];
  const action = [];
  const eaten = [];
  const teacherUnits = [];
  const teacher =
    "state.lookup.activations" in engine.arrays ? engine.array("state.lookup.activations") : null;
  run.startGeneration(generation);
  for (let step = 0; step <= steps; step++) {
    if (samples[weights.length] === step) weights.push(column(state.weights));
    if (step === steps) break;
    run.simulateSteps(step, step + 1);
    if (step < first || step >= last) continue;
    activations.push(column(state.activations));
    action.push(state.action[agent]);
    eaten.push(column(state.eaten_in_life).reduce((sum, items) => sum + items, 0));
    if (teacher) teacherUnits.push(column(teacher));
  }
  const genome = engine.array("population.genome");
  const [, modules, length] = engine.shape("population.genome");
  const module = (number) =>
    genome.slice(
      (agent * modules + number) * length,
      (agent * modules + number) * length + weights[0].length,
    );
  const inputs = appearance.inputs.length;
  // Outputs may be from a lookup table, without values of hidden units.
  const isMemoryless = !appearance.has_memory && !appearance.is_continuous.some(Boolean);
  const hasTable = inputs <= MAX_TABLE_INPUTS && isMemoryless;
  const evaluateAll = (of) =>
    activations.map((row) => evaluateModule(engine, of, row.subarray(0, inputs)));
  const units = isMemoryless && !hasLearning(engine) ? evaluateAll(module(0)) : activations;
  const arrays = {
    sample_step: Uint32Array.from(samples),
    weights: flattenRows(weights),
    activations: flattenRows(units),
    action: Uint16Array.from(action),
    eaten_in_life: Uint32Array.from(eaten),
  };
  const linked = findLinks(engine, weights[0]);
  if (linked.length) arrays.links = linked;
  if (hasTable)
    arrays.responses = tabulateResponses(engine, weights, inputs, appearance.actions.length);
  if (engine.plan.has_reinforcement) {
    const targets = teacher ? teacherUnits : evaluateAll(module(1));
    Object.assign(arrays, { teacher: module(1), teacher_activations: flattenRows(targets) });
    if (!appearance.answers.length)
      arrays.error = computeErrors(units, targets, appearance.actions.length);
  }
  return arrays;
}

function hasLearning(engine) {
  return engine.resolveValue(engine.plan.tuples.population.leaves.learns.value);
}

/** Return the activations of a module without memory for some inputs. */
function evaluateModule(engine, weights, inputs) {
  const units = engine.array("population.evaluated_units");
  engine.array("population.evaluated_weights").set(weights);
  units.set(inputs);
  engine.call("evaluate_module");
  return units.slice();
}

/** Return the links of a network without layers [link, (from unit, to unit, weight)]. */
function findLinks(engine, weights) {
  engine.array("population.evaluated_weights").set(weights);
  engine.call("find_links");
  return engine
    .array("population.links")
    .slice(0, 3 * Number(engine.array("population.link_count")[0]));
}

/** Return the action of the largest output for each combination of inputs [sample, code]. */
function tabulateResponses(engine, weights, inputs, actions) {
  const codes = Array.from({ length: 2 ** inputs }, (_, code) =>
    Array.from({ length: inputs }, (_, input) => (code >> input) & 1),
  );
  return Uint8Array.from(
    weights.flatMap((row) =>
      codes.map((code) => {
        const outputs = evaluateModule(engine, row, code).slice(-actions);
        return outputs.indexOf(Math.max(...outputs));
      }),
    ),
  );
}

/** Return the root mean square difference between the outputs of two modules [step]. */
function computeErrors(outputs, targets, actions) {
  return Float32Array.from(outputs, (units, step) => {
    const square = units
      .slice(-actions)
      .reduce((sum, output, k) => sum + (output - targets[step].at(k - actions)) ** 2, 0);
    return Math.sqrt(square / actions);
  });
}

function openArrays(engine, names) {
  return Object.fromEntries(names.map((name) => [name, engine.array(`state.${name}`)]));
}

function flattenRows(rows) {
  const values = new Float32Array(rows.length * (rows[0]?.length ?? 0));
  rows.forEach((row, number) => values.set(row, number * row.length));
  return values;
}
