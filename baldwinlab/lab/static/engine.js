/**
 * The engine in a browser: compiled functions, and their memory layout from browser_layout.py.
 *
 * This file contains no model. It needs no page, so workers, Node and tests can use it.
 */

// Bytes. Memory grows in pages.
const PAGE = 65536;
// Bytes. Arrays are aligned to a multiple of this number.
const ALIGNED = 64;
const ARRAYS = {
  f4: Float32Array,
  f8: Float64Array,
  i4: Int32Array,
  i8: BigInt64Array,
  u4: Uint32Array,
  bool: Uint8Array,
};
const NUMBERS = {
  f4: (view, at, value) => view.setFloat32(at, value, true),
  f8: (view, at, value) => view.setFloat64(at, value, true),
  i8: (view, at, value) => view.setBigInt64(at, BigInt(Math.trunc(value)), true),
  bool: (view, at, value) => view.setUint8(at, value ? 1 : 0),
};
// Bytes of an array descriptor before its shape.
const HEAD = 32;

export const REFUSED =
  "The browser did not provide enough memory for this experiment. Use fewer agents, " +
  "items or units.";

/** @typedef {{plan: Object<string, any>, code: WebAssembly.Module}} Program */

export class Engine {
  /** @param {Program} program as returned by `load` */
  constructor({ plan, code }) {
    this.plan = plan;
    this.memory = orRefuse(() => new WebAssembly.Memory({ initial: 16 }));
    this.made = new WebAssembly.Instance(code, { env: { memory: this.memory } }).exports;
    this.first = this.made.__heap_base.value;
  }

  /** Allocate the memory of a run, and write its constants. */
  prepare(experiment, { seed, run }) {
    Object.assign(this, {
      experiment,
      given: { seed, run },
      free: this.first,
      measured: {},
      tuples: {},
      arrays: {},
    });
    this.allocateTuple("setting");
    this.call("measure");
    const answers = this.array("setting.measured");
    this.plan.measured.forEach((name, number) => (this.measured[name] = answers[number]));
    for (const name of ["model", "state", "population"]) this.allocateTuple(name);
    this.call("init_world");
  }

  /** Call an entry point with the addresses of its tuples. */
  call(name) {
    this.made[name](...this.plan.takes[name].map((tuple) => this.tuples[tuple]));
  }

  /** Return the array of a name such as "state.weights". `prepare` invalidates it. */
  array(name) {
    const { type, data, size } = this.arrays[name];
    return new ARRAYS[type](this.memory.buffer, data, size);
  }

  /**
   * Return the shape of an array.
   * @returns {number[]}
   */
  shape(name) {
    return this.arrays[name].shape;
  }

  /** Write the number of a name such as "population.generation". */
  set(name, value) {
    const [tuple, leaf] = split(name);
    const { at, type } = this.plan.tuples[tuple].leaves[leaf];
    NUMBERS[type](new DataView(this.memory.buffer), this.tuples[tuple] + at, value);
  }

  /** Allocate a tuple and its arrays. */
  allocateTuple(tuple) {
    const { bytes, leaves } = this.plan.tuples[tuple];
    this.tuples[tuple] = this.allocate(bytes);
    for (const [leaf, spec] of Object.entries(leaves)) {
      if ("value" in spec) this.set(`${tuple}.${leaf}`, this.value(spec.value));
      else this.allocateArray(`${tuple}.${leaf}`, this.tuples[tuple] + spec.at, spec);
    }
  }

  /** Allocate and fill an array, and write its descriptor. */
  allocateArray(name, at, { type, fill = 0, ...spec }) {
    const content = this.content(spec);
    const shape = spec.table
      ? [content.length / spec.columns.length, spec.columns.length]
      : this.sizes(spec.shape ?? [content.length]);
    const size = shape.reduce((product, length) => product * length, 1);
    const width = ARRAYS[type].BYTES_PER_ELEMENT;
    const data = this.allocate(size * width);
    this.arrays[name] = { type, data, size, shape };
    const number = type === "i8" ? (value) => BigInt(value) : Number;
    if (content) this.array(name).set(content.map(number));
    else this.array(name).fill(number(fill));
    const view = new DataView(this.memory.buffer);
    const writeInteger = (offset, value) => view.setBigInt64(at + offset, BigInt(value), true);
    view.setUint32(at, 0, true);
    view.setUint32(at + 4, 0, true);
    writeInteger(8, size);
    writeInteger(16, width);
    view.setUint32(at + 24, data, true);
    let stride = size * width;
    shape.forEach((length, axis) => {
      stride = shape.slice(axis + 1).reduce((product, below) => product * below, width);
      writeInteger(HEAD + 8 * axis, length);
      writeInteger(HEAD + 8 * (shape.length + axis), stride);
    });
  }

  /** Return the initial values of an array that the layout lists. */
  content({ values, table, columns, then }) {
    if (values) return values.flatMap((value) => this.value(value));
    if (!table) return null;
    const rows = lookUp(this.experiment, table).map((row) =>
      columns.map((column) => (typeof column === "string" ? lookUp(row, column) : column)),
    );
    return [...rows, ...then].flat();
  }

  sizes(names) {
    return names.map((name) =>
      typeof name === "string" ? (this.measured[name] ?? this.value(this.plan.sizes[name])) : name,
    );
  }

  /** Return a value of the layout for this run. */
  value(value) {
    if (value === null || typeof value !== "object")
      return typeof value === "string" ? Number(value) : value;
    if ("measured" in value) return this.measured[value.measured];
    if ("given" in value) return this.given[value.given];
    const current = lookUp(this.experiment, value.path) ?? value.absent;
    if ("is" in value) return current === value.is;
    if ("among" in value) return value.among.indexOf(current);
    if ("above" in value) return current > value.above;
    return current;
  }

  /** Return the address of new memory. It may contain old values. Throw an Error without memory. */
  allocate(bytes) {
    const at = Math.ceil(this.free / ALIGNED) * ALIGNED;
    this.free = at + bytes;
    const missing = Math.ceil((this.free - this.memory.buffer.byteLength) / PAGE);
    if (missing > 0) orRefuse(() => this.memory.grow(missing));
    return at;
  }
}

/** Compile a module. Throw an Error if the browser does not support it. */
export async function load(bytes, plan) {
  if (typeof WebAssembly === "undefined" || !WebAssembly.validate(bytes)) {
    throw new Error(
      "This browser does not support WebAssembly with SIMD. Use a browser released in " +
        "2021 or later.",
    );
  }
  return { plan, code: await WebAssembly.compile(bytes) };
}

function orRefuse(make) {
  try {
    return make();
  } catch {
    throw new Error(REFUSED);
  }
}

/** Return the value at a dotted path, or undefined. */
export function lookUp(tree, path) {
  return path.split(".").reduce((below, step) => below?.[step] ?? undefined, tree);
}

function split(name) {
  const dot = name.indexOf(".");
  return [name.slice(0, dot), name.slice(dot + 1)];
}
