/** What the server tells of a live run. A feed outlives the view, so a run goes on while its page shows something else. */

import { connection, request } from "./common.js";

const AGAIN = 1000; // ms until a lost connection is tried again
const ENDS = ["done", "stopped", "onError", "gone"];

/** @type {Map<string, Feed>} */
const feeds = new Map();
let createFeed = (id) => new Feed(id);

/** @param {(id: string) => Feed} maker of feeds that are not a server's */
export function setFeedFactory(maker) {
  createFeed = maker;
}

/** The feed of a run. Those of other runs that have ended are closed, so that the server can forget them. */
export function openFeed(id) {
  for (const feed of [...feeds.values()]) if (feed.id !== id && feed.ended) feed.close();
  return feeds.get(id) ?? createFeed(id);
}

/**
 * @typedef {{mean: number[], low?: number[], high?: number[], runs?: number[][]}} Band one entry a generation; where there are
 *   several runs, the edges of the mean's 95 % interval, and the numbers of each run
 */
export class Feed {
  constructor(id) {
    this.id = id;
    /** @type {{experiment: Object<string, any>, runs: number, seed: number, seconds: number, saved_as: string}|null} */
    this.about = null;
    this.state = "preparing";
    this.message = "";
    this.onUpdate = () => {};
    this.onError = () => {};
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
    return ENDS.includes(this.state);
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/api/live/${encodeURIComponent(this.id)}`);
    this.socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    this.socket.onclose = () => {
      if (this.closed || this.state === "gone") return;
      connection(false);
      this.retry = setTimeout(() => this.reconnect(), AGAIN);
    };
  }

  /** Connect once the server answers. It refuses a socket without a reason, but a request with one. */
  async reconnect() {
    await request("/api/live", {});
    if (!this.closed) this.connect();
  }

  receive(update) {
    if (update.type === "run") {
      connection(true);
      this.about = update;
      this.reset(); // all that has generationsDone follows, also after a lost connection
    } else if (update.type === "generations") this.add(update);
    else if (update.type === "state") [this.state, this.message] = [update.state, update.message];
    else this.onError(update.message);
    if (this.state === "gone") connection(true);
    this.onUpdate();
  }

  add(update) {
    for (const [name, band] of Object.entries(this.bands)) {
      for (const [part, values] of Object.entries(update[name]))
        (band[part] ??= []).push(...values);
    }
  }

  /** @param {{do: "pause"|"resume"|"stop"}|{do: "pace", seconds: number}} command */
  send(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
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
