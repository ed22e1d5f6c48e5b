/** The table of responses: the action for each combination of inputs, at birth and now. */

import { createTableHead, el } from "../core/common.js";

export class Responses {
  constructor() {
    this.rows = el("tbody", {});
    this.root = el(
      "table",
      {
        class: "responses",
        "data-testid": "responses",
        "aria-label": "Action for each combination of inputs",
      },
      createTableHead(["senses", "at birth", "now"]),
      this.rows,
    );
  }

  /** Show the responses of the container of /api/agent. */
  set(/** @type {Object<string, any>} */ { header: { appearance }, arrays }) {
    const { responses, sample_step: samples } = arrays;
    this.root.hidden = !responses;
    if (!responses) return;
    const codes = responses.length / samples.length;
    this.actions = appearance.actions;
    this.responses = responses;
    this.samples = samples;
    this.codes = codes;
    this.shown = -1;
    const inputNames = (code) =>
      appearance.inputs.filter((_, input) => (code >> input) & 1).join(", ") || "nothing";
    this.now = Array.from({ length: codes }, () => el("td", {}));
    this.rows.replaceChildren(
      ...this.now.map((now, code) =>
        el(
          "tr",
          {},
          el("th", { scope: "row" }, inputNames(code)),
          el("td", {}, appearance.actions[responses[code]]),
          now,
        )
      ),
    );
  }

  /** Show the table at a step, and mark the row of the current inputs. */
  draw(step, active) {
    if (this.root.hidden) return;
    const after = this.samples.findIndex((sampled) => sampled > step);
    const sample = (after < 0 ? this.samples.length : after) - 1;
    const activeCode = active.reduce(
      (code, input, index) => code | (Number(input > 0) << index),
      0,
    );
    this.now.forEach((cell, code) =>
      cell.parentElement.classList.toggle("current", code === activeCode)
    );
    if (sample === this.shown) return;
    this.shown = sample;
    this.now.forEach((cell, code) => {
      const action = this.responses[sample * this.codes + code];
      cell.textContent = this.actions[action];
      cell.classList.toggle("changed", action !== this.responses[code]);
    });
  }
}
