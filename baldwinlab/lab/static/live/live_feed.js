/** The state of a live run from the server. A feed remains when the user opens another view. */

import { request, showConnection } from "../core/common.js";

// Milliseconds until the next attempt to connect.
const RETRY_INTERVAL = 1000;
// The text and the tone of each state of a run.
const STATES = {
  preparing: ["Preparing", ""],
  running: ["Running", "good"],
  paused: ["Paused", "warm"],
  done: ["Done", "good"],
  stopped: ["Stopped", ""],
  failed: ["Failed", "warm"],
  removed: ["Removed", "warm"],
};
const END_STATES = ["done", "stopped", "failed", "removed"];

/** @type {Map<string, Feed>} */
const feeds = new Map();
let createFeed = (id) => new Feed(id);

/** @param {(id: string) => Feed} maker creates feeds without a server */
export function setFeedFactory(maker) {
  createFeed = maker;
}

/**
 * Open the feed of a run. Feeds of other finished runs are closed, so that the server can free
 * them.
 */
export function openFeed(id) {
  for (const feed of [...feeds.values()]) if (feed.id !== id && feed.ended) feed.close();
  return feeds.get(id) ?? createFeed(id);
}

/** Show the state of a run or a comparison. */
export function showState(badge, state) {
  const [word, tone] = STATES[state];
  badge.className = `badge ${tone}`;
  badge.textContent = word;
}

/**
 * @typedef {object} Summary of a run
 * @property {string} id
 * @property {Object<string, any>} experiment
 * @property {number} runs
 * @property {number} seed
 * @property {Object<string, Object<string, string>>} measures texts of best, mean and share
 * @property {number} seconds least duration of a generation
 * @property {string} saved_as the study, or empty
 * @property {boolean} [alleles] whether the model has alleles instead of a world
 * @property {object[]} [species]
 * @property {object[]} [species_curves]
 */

/**
 * @typedef {{mean: number[], low?: number[], high?: number[], runs?: number[][]}} Band one entry
 *   per generation; with several runs also the 95 % interval of the mean, and the values of all
 *   runs
 */
export class Feed {
  constructor(id) {
    this.id = id;
    /** @type {Summary|null} */
    this.summary = null;
    this.state = "preparing";
    this.message = "";
    this.onUpdate = () => {};
    this.onError = (/** @type {string} */ _message) => {};
    this.closed = false;
    this.reset();
    feeds.set(id, this);
    this.connect();
  }

  reset() {
    /** @type {Object<string, Band>} */
    this.bands = { best: { mean: [] }, mean: { mean: [] }, share: { mean: [] } };
  }

  get generationsDone() {
    return this.bands.best.mean.length;
  }

  get ended() {
    return END_STATES.includes(this.state);
  }

  connect() {
    // "ws" from "http", and "wss" from "https".
    const address = new URL(`api/live/${encodeURIComponent(this.id)}`, document.baseURI);
    address.protocol = address.protocol.replace("http", "ws");
    this.socket = new WebSocket(address);
    this.socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    this.socket.onclose = () => {
      if (this.closed || this.state === "removed") return;
      showConnection(false);
      this.retry = setTimeout(() => this.reconnect(), RETRY_INTERVAL);
    };
  }

  /**
   * Connect after the server responds to a request, because a rejected websocket gives no reason.
   */
  async reconnect() {
    await request("api/live", {});
    if (!this.closed) this.connect();
  }

  receive(update) {
    if (update.type === "run") {
      showConnection(true);
      this.summary = update;
      // All generations follow, also after a lost connection.
      this.reset();
    } else if (update.type === "generations") this.add(update);
    else if (update.type === "state") [this.state, this.message] = [update.state, update.message];
    else this.onError(update.message);
    if (this.state === "removed") showConnection(true);
    this.onUpdate();
  }

  /** Add generations to the bands of all measures. Species have measures such as `mean:prey`. */
  add(/** @type {Object<string, any>} */ update) {
    const { type: _type, first: _first, ...measures } = update;
    for (const [name, added] of Object.entries(measures)) {
      const band = (this.bands[name] ??= { mean: [] });
      for (const [part, values] of Object.entries(added)) (band[part] ??= []).push(...values);
    }
  }

  /** @param {{command: "pause"|"resume"|"stop"}|{command: "pace", seconds: number}} order */
  send(order) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(order));
    else this.onError("There is no connection to the lab. The page tries again.");
  }

  disconnect() {
    clearTimeout(this.retry);
    this.socket.close();
  }

  close() {
    this.closed = true;
    this.disconnect();
    feeds.delete(this.id);
  }
}
