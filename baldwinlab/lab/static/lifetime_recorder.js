/**
 * Record lifetimes in the browser, as lab/recording.py and lab/agent_inspector.py. Needs no page.
 */

// Maximum number of samples of the weights over a lifetime, including birth and death.
const MAX_WEIGHT_SAMPLES = 201;
// With more inputs, the table of all input combinations is left out.
const MAX_TABLE_INPUTS = 4;
const MAX_RECORDING_BYTES = 64_000_000;

/** Return the steps of one recording from `first`, limited by its size. */
export function limitSpan({ lifetime: { steps }, population: { size } }, first = 0, last = steps) {
  return {
    first,
    last: Math.min(last, first + Math.max(1, Math.floor(MAX_RECORDING_BYTES / (20 * size))), steps),
  };
}

/**
 * Return the arrays of a recording.
 * @param {import("./simulation.js").Run} run prepared, with the genomes of a generation
 * @param {{generation: number, first: number, last: number, appearance: object}} span
 * @returns {Object<string, ArrayLike<number>>} as in lab/recording.py
 */
export function recordLifetime(run, { generation, first, last, appearance }) {
  const recorder = new LifetimeRecorder(run, appearance, last - first);
  run.startGeneration(generation);
  run.simulateSteps(0, first);
  recorder.recordItems();
  for (let step = first; step < last; step++) {
    recorder.recordBefore(step - first);
    run.simulateSteps(step, step + 1);
    recorder.recordAfter(step - first);
    // The positions after the last step are not part of the recording.
    if (step + 1 < last) recorder.recordMoves(step);
  }
  return recorder.collectArrays();
}

/** Record all agents and items: some variables before a step, and the others after it. */
class LifetimeRecorder {
  constructor({ engine, experiment }, appearance, steps) {
    this.agents = experiment.population.size;
    this.inputs = appearance.inputs.length;
    this.inputBytes = Math.ceil(this.inputs / 8);
    // Inputs are float32 numbers instead of bits.
    this.hasNumbers = appearance.is_continuous.some(Boolean);
    this.state = openArrays(engine, [
      "positions",
      "heading",
      "activations",
      "action",
      "eaten_in_life",
      "item_x",
      "item_y",
      "touched",
    ]);
    this.lanes = this.state.heading.length;
    this.regions = this.state.eaten_in_life.length / this.lanes;
    const teacherArray = engine.plan.teacher_array;
    this.teachers = teacherArray ? engine.array(teacherArray) : null;
    this.arrays = this.allocateArrays(steps * this.agents);
    this.moves = { step: [], item: [], x: [], y: [] };
  }

  /** Return empty arrays with `length` entries, one per step and agent. */
  allocateArrays(length) {
    const arrays = {
      x: new Float32Array(length),
      y: new Float32Array(length),
      heading: new Uint8Array(length),
      sensor: this.hasNumbers
        ? new Float32Array(length * this.inputs)
        : new Uint8Array(length * this.inputBytes),
      action: new Uint8Array(length),
      eaten_in_life: new Uint32Array(length),
    };
    // A rule can store any integer type.
    if (this.teachers) arrays.teacher = new Uint32Array(length);
    return arrays;
  }

  /** Record the positions of items before the first recorded step. */
  recordItems() {
    const { item_x: x, item_y: y } = this.state;
    this.arrays.item_x = x.slice();
    this.arrays.item_y = y.slice();
    this.previous = { x: x.slice(), y: y.slice() };
  }

  /** Record the variables before a step. `row` is the number of recorded steps before it. */
  recordBefore(row) {
    const { arrays, state, agents, lanes } = this;
    const index = row * agents;
    arrays.x.set(state.positions.subarray(0, agents), index);
    arrays.y.set(state.positions.subarray(lanes, lanes + agents), index);
    arrays.heading.set(state.heading.subarray(0, agents), index);
  }

  /** Record the variables after a step. */
  recordAfter(row) {
    const { arrays, state, teachers, agents, lanes, regions } = this;
    const index = row * agents;
    arrays.action.set(state.action.subarray(0, agents), index);
    arrays.teacher?.set(Uint32Array.from(teachers.subarray(0, agents), Number), index);
    for (let agent = 0; agent < agents; agent++) {
      for (let region = 0; region < regions; region++)
        arrays.eaten_in_life[index + agent] += state.eaten_in_life[region * lanes + agent];
      this.recordInputs(index + agent, agent);
    }
  }

  recordInputs(index, agent) {
    const { inputs, inputBytes, lanes, hasNumbers } = this;
    const { sensor } = this.arrays;
    const { activations } = this.state;
    for (let input = 0; input < inputs; input++) {
      const value = activations[input * lanes + agent];
      if (hasNumbers) sensor[index * inputs + input] = value;
      else if (value > 0) sensor[index * inputBytes + (input >> 3)] |= 1 << (input & 7);
    }
  }

  /** Record the items that a step has moved. */
  recordMoves(step) {
    const { moves, previous } = this;
    const { item_x: x, item_y: y, touched } = this.state;
    for (let item = 0; item < touched.length; item++) {
      // A world feature can move items without an agent that touches them.
      const hasMoved = touched[item] === step || x[item] !== previous.x[item] ||
        y[item] !== previous.y[item];
      if (!hasMoved) continue;
      moves.step.push(step + 1);
      moves.item.push(item);
      moves.x.push(x[item]);
      moves.y.push(y[item]);
    }
    previous.x.set(x);
    previous.y.set(y);
  }

  collectArrays() {
    const { step, item, x, y } = this.moves;
    return {
      ...this.arrays,
      move_step: Uint32Array.from(step),
      move_item: Uint32Array.from(item),
      move_x: Float32Array.from(x),
      move_y: Float32Array.from(y),
    };
  }
}

/**
 * Return the arrays about one agent.
 * @returns {Object<string, ArrayLike<number>>} as in lab/agent_inspector.py
 */
export function inspectAgent(run, { generation, first, last, appearance, agent }) {
  const { engine } = run;
  const recorded = recordAgent(run, { generation, first, last, agent });
  const { samples, weights, activations } = recorded;
  const inputs = appearance.inputs.length;
  const actions = appearance.actions.length;
  const evaluateAll = (moduleWeights) =>
    activations.map((row) => evaluateModule(engine, moduleWeights, row.subarray(0, inputs)));
  const genomeOf = (module) => readModuleGenome(engine, agent, module, weights[0].length);
  // Outputs may be from a lookup table, without values of hidden units.
  const isMemoryless = !appearance.has_memory && !appearance.is_continuous.some(Boolean);
  const units = isMemoryless && !hasLearning(engine) ? evaluateAll(genomeOf(0)) : activations;
  const arrays = {
    sample_step: Uint32Array.from(samples),
    weights: flattenRows(weights),
    activations: flattenRows(units),
    action: Uint16Array.from(recorded.action),
    eaten_in_life: Uint32Array.from(recorded.eaten),
  };
  const links = findLinks(engine, weights[0]);
  if (links.length) arrays.links = links;
  if (isMemoryless && inputs <= MAX_TABLE_INPUTS)
    arrays.responses = tabulateResponses(engine, weights, inputs, actions);
  if (engine.plan.has_reinforcement) {
    const targets = recorded.teacherUnits ?? evaluateAll(genomeOf(1));
    Object.assign(arrays, { teacher: genomeOf(1), teacher_activations: flattenRows(targets) });
    if (!appearance.answers.length) arrays.error = computeErrors(units, targets, actions);
  }
  return arrays;
}

/**
 * Simulate a complete lifetime and record one agent: weights at some steps, and the other variables
 * from `first` up to, but not including, `last`.
 */
function recordAgent(run, { generation, first, last, agent }) {
  const { engine } = run;
  const { steps } = run.experiment.lifetime;
  const names = ["weights", "activations", "action", "eaten_in_life", "heading"];
  const state = openArrays(engine, names);
  const lanes = state.heading.length;
  const readColumn = (array) =>
    Float32Array.from({ length: array.length / lanes }, (_, row) => array[row * lanes + agent]);
  const hasTeacher = "state.lookup.activations" in engine.arrays;
  const teacher = hasTeacher ? engine.array("state.lookup.activations") : null;
  const samples = chooseSampleSteps(steps);
  const recorded = { samples, weights: [], activations: [], action: [], eaten: [] };
  if (hasTeacher) recorded.teacherUnits = [];
  run.startGeneration(generation);
  for (let step = 0; step <= steps; step++) {
    if (samples[recorded.weights.length] === step) recorded.weights.push(readColumn(state.weights));
    // The last sample is at death, after the last step.
    if (step === steps) break;
    run.simulateSteps(step, step + 1);
    if (step < first || step >= last) continue;
    recorded.activations.push(readColumn(state.activations));
    recorded.action.push(state.action[agent]);
    recorded.eaten.push(readColumn(state.eaten_in_life).reduce((sum, items) => sum + items, 0));
    recorded.teacherUnits?.push(readColumn(teacher));
  }
  return recorded;
}

/** Return the steps at which weights are recorded, from birth to death. */
function chooseSampleSteps(steps) {
  const evenlySpaced = Array.from(
    { length: MAX_WEIGHT_SAMPLES },
    (_, number) => Math.floor((steps * number) / (MAX_WEIGHT_SAMPLES - 1)),
  );
  // A short lifetime has fewer steps than samples.
  return [...new Set(evenlySpaced)];
}

/** Return the weights of a module at birth. */
function readModuleGenome(engine, agent, module, weightCount) {
  const genome = engine.array("population.genome");
  const [, modules, genomeLength] = engine.shape("population.genome");
  const start = (agent * modules + module) * genomeLength;
  return genome.slice(start, start + weightCount);
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
  const codes = Array.from(
    { length: 2 ** inputs },
    (_, code) => Array.from({ length: inputs }, (_, input) => (code >> input) & 1),
  );
  return Uint8Array.from(
    weights.flatMap((row) =>
      codes.map((code) => {
        const outputs = evaluateModule(engine, row, code).slice(-actions);
        return outputs.indexOf(Math.max(...outputs));
      })
    ),
  );
}

/** Return the root mean square difference between the outputs of two modules [step]. */
function computeErrors(outputs, targets, actions) {
  return Float32Array.from(outputs, (units, step) => {
    const square = units
      .slice(-actions)
      .reduce((sum, output, action) => sum + (output - targets[step].at(action - actions)) ** 2, 0);
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
