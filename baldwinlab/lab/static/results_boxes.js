/** The final values of all runs, as box plots. */

import { drawBoxChart } from "./box_chart.js";
import { selectSeriesStyle } from "./chart_series.js";
import { el } from "./common.js";
import { createChartDownloads } from "./downloads.js";
import {
  createGenerationLookup,
  describeMeasures,
  findRuns,
  hasWorldView,
} from "./results_measures.js";
import { formatLifetimeAddress } from "./sources.js";

export function drawBoxes(root, { study, results, groups }, kind) {
  const last = createGenerationLookup(results);
  const drawn = groups.map(({ label, conditions }, number) => {
    const points = conditions.flatMap((name) =>
      findRuns(study, name).map((run, index) => ({
        name,
        run,
        value: results.final[name][kind][index],
      })),
    );
    const isLinked = hasWorldView({ study }, conditions[0]);
    return {
      label,
      points,
      values: points.map(({ value }) => value),
      color: selectSeriesStyle(number).color,
      describe: (index) =>
        `${points[index].name}, run ${points[index].run}: ` +
        `${points[index].value.toFixed(1)}${results.food ? " energy" : ""}`,
      ...(isLinked && {
        targetText: "Open the last generation.",
        href: (index) =>
          formatLifetimeAddress({
            study: study.id,
            condition: points[index].name,
            run: points[index].run,
            generation: last(points[index].name),
          }),
      }),
    };
  });
  const plot = el("div");
  const chart = drawBoxChart(plot, {
    title:
      `${describeMeasures(results)[kind].name} at the end of each run, ` +
      `${describeMeasures(results)[kind].axis}`,
    groups: drawn,
    height: 320,
  });
  const rows = () =>
    drawn.flatMap(({ label, points }) =>
      points.map((point) => ({ box: label, condition: point.name, ...point })),
    );
  root.append(
    plot,
    createChartDownloads(
      `final-${kind}`,
      ["box", "condition", "run", "value"],
      rows,
      chart.drawFile,
    ),
  );
  return chart;
}
