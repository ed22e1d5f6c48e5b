/**
 * The engine in a browser: compiled functions, and their memory layout from browser_layout.py.
 *
 * This file contains no model. It needs no page, so workers, Node and tests can use it.
 */

// Memory grows in pages.
const PAGE_BYTES = 65536;
// Arrays are aligned to a multiple of this number.
const ALIGNMENT_BYTES = 64;
const ARRAY_TYPES = {
  f4: Float32Array,
  f8: Float64Array,
  i4: Int32Array,
  i8: BigInt64Array,
  u4: Uint32Array,
  bool: Uint8Array,
};
const NUMBER_WRITERS = {
  f4: (view, address, value) => view.setFloat32(address, value, true),
  f8: (view, address, value) => view.setFloat64(address, value, true),
  i8: (view, address, value) => view.setBigInt64(address, BigInt(Math.trunc(value)), true),
  bool: (view, address, value) => view.setUint8(address, value ? 1 : 0),
};
// Bytes of an array descriptor before its shape.
const SHAPE_OFFSET = 32;

export const MEMORY_ERROR =
  "The browser did not provide enough memory for this experiment. Use fewer agents, " +
  "items or units.";

/** @typedef {{plan: Object<string, any>, code: WebAssembly.Module}} Program */

export class Engine {
  /** @param {Program} program as returned by `compileProgram` */
  constructor({ plan, code }) {
    this.plan = plan;
    this.memory = allocateOrThrow(() => new WebAssembly.Memory({ initial: 16 }));
    /** @type {Object<string, any>} */
    this.functions = new WebAssembly.Instance(code, { env: { memory: this.memory } }).exports;
    this.heapStart = this.functions.__heap_base.value;
  }

  /** Allocate the memory of a run, and write its constants. */
  prepare(experiment, { seed, run }) {
    this.experiment = experiment;
    this.parameters = { seed, run };
    this.free = this.heapStart;
    this.measured = {};
    this.tuples = {};
    this.arrays = {};
    this.allocateTuple("setting");
    this.call("measure");
    const measured = this.array("setting.measured");
    this.plan.measured.forEach((name, number) => (this.measured[name] = measured[number]));
    for (const name of ["model", "state", "population"]) this.allocateTuple(name);
    this.call("init_world");
  }

  /** Call an entry point with the addresses of its tuples. */
  call(name) {
    this.functions[name](...this.plan.arguments[name].map((tuple) => this.tuples[tuple]));
  }

  /** Return the array of a name such as "state.weights". `prepare` invalidates it. */
  array(name) {
    const { type, data, size } = this.arrays[name];
    return new ARRAY_TYPES[type](this.memory.buffer, data, size);
  }

  /** Write the number of a name such as "population.generation". */
  set(name, value) {
    const [tuple, leaf] = splitName(name);
    const { offset, type } = this.plan.tuples[tuple].leaves[leaf];
    NUMBER_WRITERS[type](new DataView(this.memory.buffer), this.tuples[tuple] + offset, value);
  }

  /** Allocate a tuple and its arrays. */
  allocateTuple(tuple) {
    const { bytes, leaves } = this.plan.tuples[tuple];
    this.tuples[tuple] = this.allocate(bytes);
    for (const [leaf, spec] of Object.entries(leaves)) {
      if ("value" in spec) this.set(`${tuple}.${leaf}`, this.resolveValue(spec.value));
      else this.allocateArray(`${tuple}.${leaf}`, this.tuples[tuple] + spec.offset, spec);
    }
  }

  /** Allocate and fill an array, and write its descriptor. */
  allocateArray(name, address, { type, fill = 0, ...spec }) {
    const content = this.resolveContent(spec);
    const shape = spec.table
      ? [content.length / spec.columns.length, spec.columns.length]
      : this.resolveSizes(spec.shape ?? [content.length]);
    const size = shape.reduce((product, length) => product * length, 1);
    const width = ARRAY_TYPES[type].BYTES_PER_ELEMENT;
    const data = this.allocate(size * width);
    this.arrays[name] = { type, data, size, shape };
    const number = type === "i8" ? (value) => BigInt(value) : Number;
    if (content) this.array(name).set(content.map(number));
    else this.array(name).fill(number(fill));
    const view = new DataView(this.memory.buffer);
    const writeInteger = (offset, value) => view.setBigInt64(address + offset, BigInt(value), true);
    view.setUint32(address, 0, true);
    view.setUint32(address + 4, 0, true);
    writeInteger(8, size);
    writeInteger(16, width);
    view.setUint32(address + 24, data, true);
    let stride = size * width;
    shape.forEach((length, axis) => {
      stride = shape.slice(axis + 1).reduce((product, below) => product * below, width);
      writeInteger(SHAPE_OFFSET + 8 * axis, length);
      writeInteger(SHAPE_OFFSET + 8 * (shape.length + axis), stride);
    });
  }

  /** Return the initial values of an array that the layout lists. */
  resolveContent(/** @type {Object<string, any>} */ spec) {
    const { values, table, columns, added_rows: addedRows } = spec;
    if (values) return values.flatMap((value) => this.resolveValue(value));
    if (!table) return null;
    const rows = lookUp(this.experiment, table).map((row) =>
      columns.map((column) => (typeof column === "string" ? lookUp(row, column) : column))
    );
    return [...rows, ...addedRows].flat();
  }

  resolveSizes(names) {
    return names.map((name) =>
      typeof name === "string"
        ? (this.measured[name] ?? this.resolveValue(this.plan.sizes[name]))
        : name
    );
  }

  /** Return a value of the layout for this run. */
  resolveValue(value) {
    if (value === null || typeof value !== "object")
      return typeof value === "string" ? Number(value) : value;
    if ("measured" in value) return this.measured[value.measured];
    if ("argument" in value) return this.parameters[value.argument];
    const current = lookUp(this.experiment, value.path) ?? value.default;
    if ("equals" in value) return current === value.equals;
    if ("choices" in value) return value.choices.indexOf(current);
    if ("lower_limit" in value) return current > value.lower_limit;
    return current;
  }

  /** Return the address of new memory. It may contain old values. Throw an Error without memory. */
  allocate(bytes) {
    const address = Math.ceil(this.free / ALIGNMENT_BYTES) * ALIGNMENT_BYTES;
    this.free = address + bytes;
    const missing = Math.ceil((this.free - this.memory.buffer.byteLength) / PAGE_BYTES);
    if (missing > 0) allocateOrThrow(() => this.memory.grow(missing));
    return address;
  }
}

/** Compile a module. Throw an Error if the browser does not support it. */
export async function compileProgram(bytes, plan) {
  if (typeof WebAssembly === "undefined" || !WebAssembly.validate(bytes)) {
    throw new Error(
      "This browser does not support WebAssembly with SIMD. Use a browser released in " +
        "2021 or later.",
    );
  }
  return { plan, code: await WebAssembly.compile(bytes) };
}

function allocateOrThrow(make) {
  try {
    return make();
  } catch {
    throw new Error(MEMORY_ERROR);
  }
}

/** Return the value at a dotted path, or undefined. */
export function lookUp(tree, path) {
  return path.split(".").reduce((below, step) => below?.[step] ?? undefined, tree);
}

function splitName(name) {
  const dot = name.indexOf(".");
  return [name.slice(0, dot), name.slice(dot + 1)];
}
