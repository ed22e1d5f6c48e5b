/** "Is it innate?": the fitness without learning, and with learning in the same life. */

import {
  createButton,
  createField,
  createQuery,
  createSelect,
  el,
  formatNumber,
} from "../core/common.js";
import { createChartDownloads } from "../core/downloads.js";
import { palette } from "../core/palette.js";
import { createScatterChart } from "../charts/svg_charts.js";
import { findLastLifetime, listRuns } from "./results_runs.js";
import { formatLifetimeAddress } from "../core/sources.js";

// The value of `tab` in the address.
export const INNATE = "innate";
const TABS = [[null, "Comparison"], [INNATE, "Is it innate?"]];

const READING = "If later points are farther to the right, the behavior becomes innate.";
const METHOD =
  "Each agent is simulated twice: same birth, same food, same random numbers, with learning and" +
  " without. Points above the dashed line gain by learning.";
const NO_LEARNER = "No condition of this study learns, so all behavior is innate.";

/** Return the buttons that switch between the comparison and this map. */
export function createTabs({ tab, choose }) {
  const buttons = TABS.map(([key, title]) =>
    createButton(title, () => choose({ tab: key }), {
      "aria-pressed": String((tab ?? null) === key),
      "data-testid": `results-tab-${key ?? "comparison"}`,
    })
  );
  return el("div", { class: "results-switch", role: "group", "aria-label": "Part" }, ...buttons);
}

/** The map of one run. */
export class InnateMap {
  /** @param {import("./view_results.js").ResultsState} view */
  constructor(view) {
    this.view = view;
    this.aborted = new AbortController();
    this.element = el("section", { class: "card innate", "data-testid": "innate" });
    const learners = view.study.conditions.filter(
      ({ name, learns }) => learns && listRuns(view, [name]).length,
    );
    const names = learners.map(({ name }) => name);
    if (!names.length) {
      this.element.append(el("p", {}, NO_LEARNER));
      return;
    }
    this.source = this.findSource(names);
    this.answer = el("strong", { role: "status", "data-testid": "innate-answer" });
    this.plot = el("div", { "data-testid": "behavior-plot" });
    this.element.append(
      this.answer,
      this.plot,
      el(
        "div",
        { class: "innate-side" },
        this.createControls(names),
        el("p", {}, READING),
        el(
          "details",
          { class: "soft", "data-testid": "innate-method" },
          el("summary", {}, "Method"),
          el("p", {}, METHOD),
        ),
      ),
    );
    this.show();
  }

  /** Return the lifetime that the address names, by default the last one of a typical run. */
  findSource(names) {
    const { view } = this;
    const condition = names.includes(view.condition) ? view.condition : names[0];
    const runs = listRuns(view, [condition]).map(({ run }) => run);
    const requested = Number(view.run);
    const run = runs.includes(requested) ? requested : view.results.typical_run[condition];
    return findLastLifetime(view, condition, run);
  }

  createControls(names) {
    const { view: { choose }, source: { condition, run, generation } } = this;
    const runs = listRuns(this.view, [condition]).map((row) => [row.run, `run ${row.run}`]);
    this.kinds = {
      generations: "Means of generations",
      agents: `Agents of generation ${generation}`,
    };
    this.kind = createSelect(Object.entries(this.kinds), "generations", () => this.show(), {
      "data-testid": "behavior-kind",
    });
    const chooseCondition = (name) => choose({ condition: name, run: null });
    return el(
      "div",
      { class: "row results-factors" },
      createField(
        "condition",
        createSelect(names.map((name) => [name, name]), condition, chooseCondition, {
          "data-testid": "innate-condition",
        }),
      ),
      createField(
        "run",
        createSelect(runs, run, (chosen) => choose({ run: chosen }), {
          "data-testid": "innate-run",
        }),
      ),
      createField("points", this.kind),
    );
  }

  /** Request the numbers, and draw them. */
  async show() {
    const { signal } = this.aborted;
    const kind = this.kind.value;
    const query = createQuery({ ...this.source, of: kind });
    this.answer.textContent = this.answer.textContent || "Simulating …";
    try {
      const data = await this.view.load(`api/behavior?${query}`);
      if (signal.aborted || kind !== this.kind.value) return;
      if (data.answer) this.answer.textContent = data.answer;
      this.plot.replaceChildren(...createPlot(data, this.kinds[kind], (patch) => {
        location.hash = formatLifetimeAddress({ ...this.source, ...patch });
      }));
    } catch (error) {
      if (!signal.aborted) this.answer.textContent = error.message;
    }
  }

  destroy() {
    this.aborted.abort();
  }
}

/** Return the plot and its downloads. `data` has agents or generations. */
function createPlot({ outcome, agents, generations, innate, learned }, title, open) {
  const kind = agents ? "agent" : "generation";
  const numbers = agents ?? generations;
  const last = numbers.length - 1;
  const points = numbers.map((number, index) => ({
    x: innate[index],
    y: learned[index],
    label: `${kind} ${number}: ${formatNumber(innate[index])} without learning, ` +
      `${formatNumber(learned[index])} with learning`,
    // Later generations are darker. The first and the last one have their names on the map.
    shade: agents || !last ? 0.5 : index / last,
    name: generations && (!index || index === last) ? `generation ${number}` : "",
  }));
  const options = {
    title,
    points,
    color: palette.accent,
    xLabel: `${outcome} without learning (innate)`,
    yLabel: `${outcome} with learning`,
  };
  const rows = () =>
    numbers.map((number, index) => ({
      [kind]: number,
      innate: innate[index],
      learned: learned[index],
    }));
  return [
    createScatterChart(options, (index) => open({ [kind]: numbers[index] })),
    createChartDownloads("behavior", [kind, "innate", "learned"], rows),
  ];
}
