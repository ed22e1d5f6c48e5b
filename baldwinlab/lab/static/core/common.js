/** Elements, requests, messages and number formats for all views. */

import { createSvg } from "./drawing.js";

/**
 * Create an element. Attributes that start with "on" are listeners. `null` and `false` are omitted.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Object<string, any>} [attributes]
 * @param {...any} children nodes, texts and arrays of them; null and false are omitted
 * @returns {HTMLElementTagNameMap[Tag]}
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

/** Create an icon of 20 x 20 units in the text color. `path` is the data of an SVG path. */
export function createIcon(path) {
  const attributes = { viewBox: "0 0 20 20", class: "icon", "aria-hidden": "true" };
  return createSvg("svg", attributes, createSvg("path", { d: path }));
}

export const CLOSE_ICON = "M5 5l10 10M15 5L5 15";

/** Create a button with a text or elements. It submits no form. */
export function createButton(content, onclick, attributes = {}) {
  return el("button", { type: "button", onclick, ...attributes }, content);
}

/** Create a button with an icon. The label is its tooltip, and its name for screen readers. */
export function createIconButton(label, path, onclick, attributes = {}) {
  const names = { class: "quiet square", title: label, "aria-label": label };
  return createButton(createIcon(path), onclick, { ...names, ...attributes });
}

/** Create the options of a list from pairs of a value and a text. */
export function createOptions(/** @type {any[][]} */ pairs) {
  return pairs.map(([value, text]) => el("option", { value }, text));
}

/**
 * Create a list of pairs of a value and a text.
 * @param {any[][]} pairs
 * @param {any} selected a value; if it is not in the list, the first one is selected
 * @param {(value: string) => void} changed
 * @param {Object<string, any>} [attributes]
 */
export function createSelect(pairs, selected, changed, attributes = {}) {
  const select = el("select", { ...attributes }, createOptions(pairs));
  select.addEventListener("change", () => changed(select.value));
  const index = pairs.findIndex(([value]) => String(value) === String(selected));
  if (index > 0) select.selectedIndex = index;
  return select;
}

/** Create an input with a title. */
export function createField(title, ...inputs) {
  return el("label", { class: "field" }, el("span", {}, title), ...inputs);
}

/** Create the head of a table. */
export function createTableHead(titles) {
  const cells = titles.map((title) => el("th", { scope: "col" }, title));
  return el("thead", {}, el("tr", {}, cells));
}

/** Create a card with a title, whose content can be folded. */
export function createFold(testid, title, open, ...content) {
  const summary = el("summary", {}, el("h2", {}, title));
  return el("details", { class: "card", open, "data-testid": testid }, summary, ...content);
}

/**
 * Create a menu that closes after a choice.
 * @param {string} title
 * @param {(HTMLElement|null)[]} items
 * @param {string} testid
 */
export function createMenu(title, items, testid) {
  const list = el("div", { class: "menu-items" }, items);
  const menu = el(
    "details",
    { class: "menu", "data-testid": testid },
    el("summary", {}, title),
    list,
  );
  list.addEventListener("click", () => (menu.open = false));
  return menu;
}

/** Create a hint about a command of the terminal. */
export function createCommandHint(sentence, command) {
  return el("p", { class: "soft" }, `${sentence} Run `, el("code", {}, command), ".");
}

/** Open a dialog. It is removed when it closes. */
export function openDialog(/** @type {HTMLDialogElement} */ dialog, closed = () => {}) {
  dialog.addEventListener("close", () => {
    closed();
    dialog.remove();
  });
  document.body.append(dialog);
  dialog.showModal();
}

// Replaces the server on exported pages.
let localServer = null;

/**
 * @param {{get: (path: string, signal?: AbortSignal) => Promise<any>, post: (path: string, body:
 *   any) => Promise<any>}} server
 */
export function useLocalServer(server) {
  localServer = server;
}

/** Return whether there is no server. Features that need a server are then hidden. */
export function isServerless() {
  return localServer !== null;
}

/**
 * Return the parameters of a request or an address.
 * @param {Object<string, any>} parameters
 */
export function createQuery(parameters) {
  const texts = Object.entries(parameters).map(([name, value]) => [name, String(value)]);
  return new URLSearchParams(texts);
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
 * Request a binary container (binary_frames.py).
 * @returns {Promise<{header: Object<string, any>, arrays: Object<string, any>}>}
 */
export async function getBinary(path, signal) {
  if (localServer) return localServer.get(path, signal);
  return unpack(await (await request(path, { signal })).arrayBuffer());
}

const ARRAY_TYPES = {
  int8: Int8Array,
  uint8: Uint8Array,
  int16: Int16Array,
  uint16: Uint16Array,
  int32: Int32Array,
  uint32: Uint32Array,
  float32: Float32Array,
};

/**
 * Return the header and the arrays of a container. Arrays are views of `buffer`, except
 * differences.
 */
export function unpack(buffer) {
  const bytes = new Uint8Array(buffer, 0, 8);
  if (String.fromCharCode(...bytes.subarray(0, 4)) !== "BALD")
    throw new Error("The server sent data that is not a recording.");
  const length = new DataView(buffer).getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, length)));
  /** @type {Object<string, any>} */
  const arrays = {};
  for (const { name, dtype, shape, offset, differences } of header.arrays) {
    const count = shape.reduce((product, size) => product * size, 1);
    arrays[name] = new ARRAY_TYPES[dtype](buffer, 8 + length + offset, count);
    if (differences) arrays[name] = decodeDifferences(arrays[name], shape);
  }
  return { header, arrays };
}

/** Decode an array [row, column] that is stored as bit differences, column by column. */
function decodeDifferences(encoded, [rows, columns]) {
  const BitArray = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[encoded.BYTES_PER_ELEMENT];
  const differences = new BitArray(encoded.buffer, encoded.byteOffset, encoded.length);
  const sums = new BitArray(encoded.length);
  for (let column = 0; column < columns; column++) {
    for (let row = 0; row < rows; row++) {
      sums[row * columns + column] = differences[column * rows + row] +
        (row ? sums[(row - 1) * columns + column] : 0);
    }
  }
  return new encoded.constructor(sums.buffer);
}

/**
 * Decode base64 of deflated bytes.
 * @returns {Promise<ArrayBuffer>}
 */
export async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(
    new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw")),
  ).arrayBuffer();
}

/**
 * Send a request. Without a connection, show a banner and retry.
 *
 * Throw an Error for an error status.
 */
export async function request(path, options) {
  for (;;) {
    let response;
    try {
      response = await fetch(path, options);
    } catch (error) {
      if (error.name === "AbortError") throw error;
      showConnection(false);
      await new Promise((resolve) => setTimeout(resolve, 1000));
      options.signal?.throwIfAborted();
      continue;
    }
    showConnection(true);
    if (response.ok) return response;
    const error = new Error(await readError(response));
    // The banner stays, because the server rejects all further requests.
    if (response.status === 401) showConnection(false, error.message);
    throw error;
  }
}

async function readError(response) {
  try {
    return (await response.json()).error;
  } catch {
    return `The server answered ${response.status} ${response.statusText}.`;
  }
}

const CONNECTION_LOST = "There is no connection to baldwinlab. Trying again …";

/**
 * Show or hide the banner about the connection.
 * @param {boolean} isConnected
 * @param {string} [reason]
 */
export function showConnection(isConnected, reason = CONNECTION_LOST) {
  const banner = document.getElementById("connection");
  if (!banner) return;
  banner.hidden = isConnected;
  banner.textContent = reason;
}

/**
 * Show a message, also to screen readers. It disappears after some seconds or at a click.
 * @param {string} text
 * @param {"error"|"done"|"info"} [kind]
 */
export function showMessage(text, kind = "info") {
  const container = document.getElementById("messages");
  const banner = document.getElementById("connection");
  // The banner shows this message until the problem is solved.
  if (banner && !banner.hidden && banner.textContent === text) return;
  for (const old of container.children) if (old.firstChild.textContent === text) old.remove();
  const note = el(
    "div",
    { class: `message ${kind}`, "data-testid": `message-${kind}` },
    el("p", {}, text),
  );
  note.append(
    createButton("×", () => note.remove(), { class: "quiet", "aria-label": "Dismiss" }),
  );
  container.append(note);
  setTimeout(() => note.remove(), kind === "error" ? 12000 : 6000);
}

/** Show the errors of requests that no view handles. */
export function showUnhandledErrors() {
  addEventListener("unhandledrejection", (event) => {
    event.preventDefault();
    if (event.reason?.name !== "AbortError")
      showMessage(event.reason?.message ?? String(event.reason), "error");
  });
}

/** Set the text of an element. An equal text causes no layout. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const formats = [0, 1, 2, 3].map((digits) => createNumberFormat({ maximumFractionDigits: digits }));

/** Return a format of the page's language, which can differ from that of the browser. */
function createNumberFormat(options) {
  return new Intl.NumberFormat(document.documentElement.lang, options);
}

/** Format a number with a fixed number of decimals. */
export function formatDecimals(number, digits) {
  const options = { minimumFractionDigits: digits, maximumFractionDigits: digits };
  return createNumberFormat(options).format(number);
}

/** Format a number for reading: 12,345 or 12.3 or 0.012. */
export function formatNumber(number) {
  if (number === null || number === undefined || Number.isNaN(number)) return "–";
  const size = Math.abs(number);
  // Reports have the same notation of exponents, with two digits.
  if (size !== 0 && size < 0.001) return number.toExponential(1).replace(/e-(?=\d$)/, "e-0");
  if (Number.isInteger(number) || size >= 100) return formats[0].format(number);
  if (size >= 10) return formats[1].format(number);
  return formats[size >= 1 ? 2 : 3].format(number);
}

/** Format a share, such as "34 %" or "0.3 %". Only the shares 0 and 1 are "0 %" and "100 %". */
export function formatPercentage(share) {
  const isExact = share === 0 || share === 1;
  const isRounded = (digits) => [0, 100].includes(Number((100 * share).toFixed(digits)));
  let digits = 0;
  while (!isExact && digits < 20 && isRounded(digits)) digits += 1;
  return `${formatDecimals(100 * share, digits)} %`;
}

export class Tooltip {
  /** @param {HTMLElement} root contains the tooltip */
  constructor(root) {
    this.root = root;
    this.element = el("div", { class: "tip number", "aria-hidden": "true", hidden: true });
    root.append(this.element);
  }

  /**
   * @param {string|null} text null hides the tooltip
   * @param {number} [x] CSS pixels from the left of `root`
   * @param {number} [y] CSS pixels from its top
   */
  show(text, x = 0, y = 0) {
    this.element.hidden = text === null;
    if (text === null) return;
    this.element.textContent = text;
    const maxLeft = this.root.clientWidth - this.element.offsetWidth - 4;
    this.element.style.left = `${Math.max(4, Math.min(x + 12, maxLeft))}px`;
    this.element.style.top = `${y - 30}px`;
  }
}
