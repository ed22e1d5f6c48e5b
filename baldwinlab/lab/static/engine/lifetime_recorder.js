/** Record lifetimes in the browser, as lab/recording.py. Needs no page. */

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

function openArrays(engine, names) {
  return Object.fromEntries(names.map((name) => [name, engine.array(`state.${name}`)]));
}
