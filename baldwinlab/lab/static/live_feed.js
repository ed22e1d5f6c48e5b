/** What the server tells of a live run. A feed outlives the view, so a run goes on while its page shows something else. */

import { connection, request } from "./common.js";

const AGAIN = 1000; // ms until a lost connection is tried again
const ENDS = ["done", "stopped", "failed", "gone"];

/** @type {Map<string, Feed>} */
const feeds = new Map();
let make = (id) => new Feed(id);

/** @param {(id: string) => Feed} maker of feeds that are not a server's */
export function setFeedFactory(maker) {
  make = maker;
}

/** The feed of a run. Those of other runs that have ended are closed, so that the server can forget them. */
export function openFeed(id) {
  for (const feed of [...feeds.values()]) if (feed.id !== id && feed.ended) feed.close();
  return feeds.get(id) ?? make(id);
}

/**
 * @typedef {{mean: number[], low?: number[], high?: number[], each?: number[][]}} Band one entry a generation; where there are
 *   several runs, the edges of the mean's 95 % interval, and the numbers of each run
 */
export class Feed {
  constructor(id) {
    this.id = id;
    /** @type {{experiment: Object<string, any>, runs: number, seed: number, seconds: number, kept: string}|null} */
    this.about = null;
    this.state = "preparing";
    this.message = "";
    this.heard = () => {};
    this.failed = () => {};
    this.closed = false;
    this.forget();
    feeds.set(id, this);
    this.connect();
  }

  forget() {
    /** @type {Object<string, Band>} */
    this.bands = { best: { mean: [] }, mean: { mean: [] }, share: { mean: [] } };
  }

  get lived() {
    return this.bands.best.mean.length;
  }

  get ended() {
    return ENDS.includes(this.state);
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/api/live/${encodeURIComponent(this.id)}`);
    this.socket.onmessage = (event) => this.hear(JSON.parse(event.data));
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

  hear(news) {
    if (news.type === "run") {
      connection(true);
      this.about = news;
      this.forget(); // all that has lived follows, also after a lost connection
    } else if (news.type === "generations") this.add(news);
    else if (news.type === "state") [this.state, this.message] = [news.state, news.message];
    else this.failed(news.message);
    if (this.state === "gone") connection(true);
    this.heard();
  }

  add(news) {
    for (const [name, band] of Object.entries(this.bands)) {
      for (const [part, values] of Object.entries(news[name])) (band[part] ??= []).push(...values);
    }
  }

  /** @param {{do: "pause"|"resume"|"stop"}|{do: "pace", seconds: number}} order */
  send(order) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(order));
    else this.failed("There is no connection to the lab. The page tries again.");
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
