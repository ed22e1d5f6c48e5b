/** What every view uses: elements, requests, messages, numbers. */

/**
 * An element. Attributes that begin with "on" are listeners; `null` and `false` leave an attribute out.
 * @param {string} tag
 * @param {Object<string, any>} [attributes]
 * @param {...(Node|string|number|null)} children
 * @returns {HTMLElement}
 */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(
    ...children.flat().filter((child) => child !== null && child !== undefined && child !== false),
  );
  return element;
}

/** An icon of 20 by 20 units, drawn with the colour of the text. `path` is the data of an SVG path. */
export function icon(path) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("class", "icon");
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
  line.setAttribute("d", path);
  svg.append(line);
  return svg;
}

/** What the server refused, in its own sentence. */
export class Refusal extends Error {
  constructor(readError, status) {
    super(readError);
    this.status = status;
  }
}

let localServer = null; // answers in the place of a server, in a page that has none

/** @param {{get: (path: string, signal?: AbortSignal) => Promise<any>, post: (path: string, body: any) => Promise<any>}} answerer */
export function useLocalServer(answerer) {
  localServer = answerer;
}

/** Whether there is no server, and what needs one is not to be offered. */
export function isServerless() {
  return localServer !== null;
}

/** @returns {Promise<any>} */
export async function getJSON(path, signal) {
  if (localServer) return localServer.get(path, signal);
  return (await request(path, { signal })).json();
}

/** @returns {Promise<any>} */
export async function postJSON(path, body, signal) {
  if (localServer) return localServer.post(path, body);
  const headers = { "Content-Type": "application/json" };
  return (
    await request(path, { method: "POST", headers, body: JSON.stringify(body), signal })
  ).json();
}

/**
 * A binary container (frames.py).
 * @returns {Promise<{header: Object<string, any>, arrays: Object<string, ArrayLike<number>>}>}
 */
export async function getBinary(path, signal) {
  if (localServer) return localServer.get(path, signal);
  return unpack(await (await request(path, { signal })).arrayBuffer());
}

const TYPES = {
  int8: Int8Array,
  uint8: Uint8Array,
  int16: Int16Array,
  uint16: Uint16Array,
  int32: Int32Array,
  uint32: Uint32Array,
  float32: Float32Array,
};

/** The header and arrays of a container; the arrays look into `buffer`, nothing is copied but what is kept as differences. */
export function unpack(buffer) {
  const bytes = new Uint8Array(buffer, 0, 8);
  if (String.fromCharCode(...bytes.subarray(0, 4)) !== "BALD")
    throw new Error("The server sent data that is not a recording.");
  const length = new DataView(buffer).getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, length)));
  const arrays = {};
  for (const { name, dtype, shape, offset, differences } of header.arrays) {
    const count = shape.reduce((product, size) => product * size, 1);
    arrays[name] = new TYPES[dtype](buffer, 8 + length + offset, count);
    if (differences) arrays[name] = summed(arrays[name], shape);
  }
  return { header, arrays };
}

/** An array [row, column] of which the differences from row to row are kept, column by column: sums of bits. */
function summed(encoded, [rows, columns]) {
  const bits = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[encoded.BYTES_PER_ELEMENT];
  const differences = new bits(encoded.buffer, encoded.byteOffset, encoded.length);
  const sums = new bits(encoded.length);
  for (let column = 0; column < columns; column++) {
    for (let row = 0; row < rows; row++) {
      sums[row * columns + column] =
        differences[column * rows + row] + (row ? sums[(row - 1) * columns + column] : 0);
    }
  }
  return new encoded.constructor(sums.buffer);
}

/** Base64 of deflated bytes, unpacked. @returns {Promise<ArrayBuffer>} */
export async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(
    new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw")),
  ).arrayBuffer();
}

/** A request that waits, with a banner, while there is no connection, and then goes on. Raises Refusal. */
export async function request(path, options) {
  for (;;) {
    let answer;
    try {
      answer = await fetch(path, options);
    } catch (fault) {
      if (fault.name === "AbortError") throw fault;
      connection(false);
      await new Promise((resolve) => setTimeout(resolve, 1000));
      options.signal?.throwIfAborted();
      continue;
    }
    connection(true);
    if (answer.ok) return answer;
    const refusal = new Refusal(await readError(answer), answer.status);
    if (answer.status === 401) connection(false, refusal.message); // stays in sight, as nothing else will be answered
    throw refusal;
  }
}

async function readError(answer) {
  try {
    return (await answer.json()).error;
  } catch {
    return `The server answered ${answer.status} ${answer.statusText}.`;
  }
}

const LOST = "There is no connection to baldwinlab. Trying again …";

/** Show or hide the banner of a lost connection. @param {boolean} isConnected @param {string} [reason] */
export function connection(isConnected, reason = LOST) {
  const banner = document.getElementById("connection");
  if (!banner) return;
  banner.hidden = isConnected;
  banner.textContent = reason;
}

/**
 * A sentence for the reader, also read aloud by screen readers; goes by itself, or at a click.
 * @param {string} text
 * @param {"error"|"done"|"info"} [kind]
 */
export function message(text, kind = "info") {
  const container = document.getElementById("messages");
  for (const old of container.children) if (old.firstChild.textContent === text) old.remove();
  const note = el(
    "div",
    { class: `message ${kind}`, "data-testid": `message-${kind}` },
    el("p", {}, text),
  );
  note.append(
    el(
      "button",
      { type: "button", class: "quiet", "aria-label": "Dismiss", onclick: () => note.remove() },
      "×",
    ),
  );
  container.append(note);
  setTimeout(() => note.remove(), kind === "error" ? 12000 : 6000);
}

const formats = [0, 1, 2, 3].map(
  (digits) => new Intl.NumberFormat("en", { maximumFractionDigits: digits }),
);

/** A number for people: 12,345; 12.3; 0.012. */
export function format(number) {
  if (number === null || number === undefined || Number.isNaN(number)) return "–";
  const size = Math.abs(number);
  if (size !== 0 && size < 0.001) return number.toExponential(1);
  return formats[
    Number.isInteger(number) || size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3
  ].format(number);
}
