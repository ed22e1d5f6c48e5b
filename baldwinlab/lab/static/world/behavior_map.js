/** The map of behavior: fitness at birth without learning, and with learning in the same life. */

import {
  createButton,
  createSelect,
  el,
  formatNumber,
  getJSON,
  openDialog,
} from "../core/common.js";
import { createChartDownloads } from "../core/downloads.js";
import { palette } from "../core/palette.js";
import { createScatterChart } from "../charts/svg_charts.js";
import { createLifetimeQuery } from "../core/sources.js";

const MEASURED =
  "Each agent is simulated twice: same birth, same food, same random numbers, with learning and" +
  " without. Agents above the dashed line gain by learning. If points move to the right over the" +
  " generations, the behavior becomes innate.";

/**
 * Open the map of a generation.
 * @param {import("../core/sources.js").Source} source
 * @param {{agent: (agent: number) => void, generation: (generation: number) => void}} open called
 *   to show the lifetime of a point
 */
export function openBehaviorMap(source, open) {
  const plot = el("div", { "data-testid": "behavior-plot" });
  const status = el("p", { class: "soft", role: "status" });
  const kinds = {
    agents: `Agents of generation ${source.generation}`,
    generations: `Means of generations up to ${source.generation}`,
  };
  const list = createSelect(Object.entries(kinds), "agents", () => show(), {
    "aria-label": "Points",
    "data-testid": "behavior-kind",
  });
  const dialog = el(
    "dialog",
    { class: "behavior", "aria-label": "Map of behavior" },
    el("h2", {}, "Map of behavior"),
    list,
    plot,
    status,
    el("p", { class: "soft" }, MEASURED),
    createButton("Close", () => dialog.close()),
  );
  const stop = new AbortController();
  const show = async () => {
    plot.replaceChildren();
    status.textContent = "Simulating …";
    const query = createLifetimeQuery(source);
    query.set("of", list.value);
    try {
      const data = await getJSON(`api/behavior?${query}`, stop.signal);
      plot.replaceChildren(
        ...createPlot(data, kinds[list.value], (kind, value) => {
          dialog.close();
          open[kind](value);
        }),
      );
      status.textContent = "Press a point to watch this lifetime.";
    } catch (error) {
      if (error.name !== "AbortError") status.textContent = error.message;
    }
  };
  openDialog(dialog, () => stop.abort());
  return show();
}

/** Return the plot and its downloads. `data` has agents or generations. */
function createPlot({ outcome, agents, generations, innate, learned }, title, open) {
  const kind = agents ? "agent" : "generation";
  const numbers = agents ?? generations;
  const points = numbers.map((number, index) => ({
    x: innate[index],
    y: learned[index],
    label: `${kind} ${number}: ${formatNumber(innate[index])} without learning, ` +
      `${formatNumber(learned[index])} with learning`,
    // Later generations are darker.
    shade: agents || numbers.length < 2 ? 0.5 : index / (numbers.length - 1),
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
    createScatterChart(options, (index) => open(kind, numbers[index])),
    createChartDownloads("behavior", [kind, "innate", "learned"], rows),
  ];
}
