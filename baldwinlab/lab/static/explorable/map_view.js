/** A map of the essay with a caption. */

import { el, formatNumber, setText } from "../core/common.js";
import { palette } from "../core/palette.js";
import { WorldView } from "../world/world_view.js";
import { formatText } from "./figure.js";

// Narrower maps have no trails, which take half of the time of a picture.
const MIN_TRAIL_WIDTH = 420;
// In CSS pixels.
const LABEL_SIZE = 13;

export class MapView {
  /**
   * @param {Object<string, string>} strings
   * @param {string} caption
   * @param {() => void} invalidate called when the map must be drawn again
   * @param {number[]|null} [region] the shown part of the map: its left, right, upper and lower
   *   edge. null: the complete map
   */
  constructor(strings, caption, invalidate, region = null) {
    this.strings = strings;
    this.region = region;
    this.recording = null;
    this.agent = null;
    const label = formatText(strings.map, { name: caption });
    this.canvas = el("canvas", { role: "img", "aria-label": label });
    this.view = new WorldView(this.canvas);
    this.count = el("span", { class: "number" }, strings.waiting);
    this.caption = el("span", {}, caption);
    const foot = el("figcaption", {}, this.caption, " ", this.count);
    this.root = el("figure", { class: "map" }, this.canvas, foot);
    if (region) {
      const [left, right, upper, lower] = region;
      this.canvas.style.aspectRatio = String((right - left) / (lower - upper));
    }
    this.view.followSize(() => {
      this.fitRegion();
      invalidate();
    });
  }

  fitRegion() {
    if (!this.region) return;
    const [left, right, upper, lower] = this.region;
    const { view } = this;
    const { width, height } = view.world;
    const scale = Math.min(view.width / (right - left), view.height / (lower - upper));
    const zoom = view.camera.zoom * (scale / view.scale);
    view.setCamera((left + right) / 2 / width, (upper + lower) / 2 / height, zoom);
    // An enlarged map of the lab moves with a finger. Here, a finger scrolls the page.
    this.canvas.style.touchAction = "";
  }

  /**
   * @param {import("../world/recording.js").Recording} recording
   * @param {number|null} agent gets a ring
   */
  show(recording, agent = null) {
    this.recording = recording;
    this.agent = agent;
  }

  /** Show a world without agents. */
  showWorld(world, appearance) {
    this.recording = null;
    this.view.setWorld({ world, appearance });
    this.count.textContent = "";
    this.draw(0);
  }

  /**
   * Draw a shape on the map that is not part of the world yet.
   * @param {string} color
   * @param {number[]} shape its left, right, upper and lower edge
   */
  showSketch(color, shape) {
    const [left, right, upper, lower] = shape;
    const { marks } = this.view.world;
    const sketch = { kind: "rectangle", x: left, y: upper, color, label: "", solid: false };
    this.view.world.marks = [...marks, { ...sketch, width: right - left, height: lower - upper }];
    this.drawWorld();
    this.view.world.marks = marks;
  }

  draw(time) {
    const { recording, agent } = this;
    if (!recording) return this.drawWorld();
    const moment = Math.min(time, recording.last - 1);
    const trails = this.view.width < MIN_TRAIL_WIDTH ? "off" : "recent";
    this.view.draw(recording, moment, { selectedAgent: agent, trails });
    this.drawLabel();
    const items = formatNumber(this.countItems(moment));
    setText(this.count, formatText(this.strings.eaten, { items }));
  }

  /** Draw the map without agents. */
  drawWorld() {
    this.view.draw(null, 0);
    this.drawLabel();
  }

  /** Write the name of the area where all agents start above it. */
  drawLabel() {
    const { view } = this;
    const { pen, origin: [left, top], scale, pixelRatio } = view;
    const start = view.world.marks.find(({ kind }) => kind === "disc");
    if (!start) return;
    pen.setTransform(pixelRatio, 0, 0, pixelRatio, 0, 0);
    pen.font = `${LABEL_SIZE}px ${palette.font}`;
    pen.fillStyle = palette.soft;
    pen.textAlign = "center";
    pen.textBaseline = "alphabetic";
    const x = left + scale * (start.x + start.width / 2);
    pen.fillText(this.strings.start, x, top + scale * start.y - LABEL_SIZE / 3);
  }

  /** Return the number of items that all agents have eaten. */
  countItems(time) {
    return this.recording.countAllEaten(Math.floor(time) + 1).items;
  }
}

/** Return the agent in the middle: about half of the agents eat more in their lives. */
export function findMiddleAgent(recording) {
  const eaten = Array.from(
    { length: recording.agents },
    (_, agent) => recording.countEaten(recording.last, agent),
  );
  const agents = eaten.map((_, agent) => agent);
  agents.sort((first, second) => eaten[first] - eaten[second]);
  return agents[agents.length >> 1];
}
