/** The Results tab: curves, boxes and claims of a study, with links to lifetimes. */

import { boxChart, lineChart, seriesStyle, runSwitch } from "./charts.js";
import { claimList } from "./claims.js";
import { comparisonTable } from "./comparison.js";
import { el, getJSON, message } from "./common.js";
import { reactionNorms } from "./reaction_norms.js";
import { groupConditions, factorChoices, clearedState, combineCurves } from "./results_factors.js";
import { runTable } from "./results_runs.js";
import { chartDownloads, csv, downloadButton } from "./downloads.js";
import { isViewable, lifeAddress } from "./sources.js";

const WITHOUT_FOOD = {
  best: { name: "Best agent", axis: "fitness", title: "Fitness of the best agent" },
  mean: { name: "Average agent", axis: "fitness", title: "Fitness of the average agent" },
  share: {
    name: "Share above 0",
    axis: "share of the agents",
    title: "Share of agents with fitness above 0",
  },
};
const MEASURES = {
  // For foragers, fitness is the energy of the eaten items.
  best: { ...WITHOUT_FOOD.best, axis: "fitness (energy)" },
  mean: { ...WITHOUT_FOOD.mean, axis: "fitness (energy)" },
  share: {
    name: "Share that eats",
    axis: "share of the agents",
    title: "Share of agents that eat",
  },
};
// With more curves, the lines of single runs cannot be distinguished.
const FEW = 8;
const measures = (results) => (results.food ? MEASURES : WITHOUT_FOOD);

/** Mount the view: show `state`, and report changes with `navigate` (see main.js). */
export function mount(root, state, navigate) {
  const page = el("div", { class: "page results", "data-testid": "results" });
  root.append(page);
  const aborted = new AbortController();
  // The response of /api/studies.
  let listed = null;
  // {study, results, asked, free}: the visible state, and the function that frees its charts.
  let shown = null;
  // The responses about the visible study, by address.
  const answers = new Map();
  const ask = (path) => {
    if (!answers.has(path)) answers.set(path, getJSON(path, aborted.signal));
    return answers.get(path);
  };

  const show = async (requested) => {
    listed ??= (await getJSON("/api/studies", aborted.signal)).studies;
    const readable = listed.filter((study) => !study.problem);
    if (!listed.length)
      return showEmpty(
        page,
        "This folder contains no study yet",
        "Create one with `baldwinlab reproduce`, or save a live run.",
      );
    const study = requested.study
      ? listed.find((line) => line.id === requested.study)
      : (readable[0] ?? listed[0]);
    if (!study)
      return showEmpty(
        page,
        "Study not found",
        `${requested.study} is not in this folder.`,
        picker(listed, null, choose),
      );
    const measure = requested.measure in MEASURES ? requested.measure : "best";
    const { hidden = "", ...rest } = requested;
    const stateKey = new URLSearchParams({ ...rest, study: study.id, measure, hidden }).toString();
    if (shown?.asked === stateKey) return;
    if (shown?.study !== study.id) answers.clear();
    const results =
      shown?.study === study.id
        ? shown.results
        : await fetchResults(study, page, listed, choose, aborted.signal);
    if (!results || aborted.signal.aborted) return;
    shown?.free();
    const given = {
      study,
      results,
      measure,
      hidden,
      navigate,
      choose,
      listed,
      ask,
      norm: requested.norm,
      ...groupConditions(results, requested),
    };
    // Each curve is one condition.
    given.alone = given.groups.every(({ conditions }) => conditions.length === 1);
    given.lines = given.alone && given.groups.length <= FEW && requested.runs === "each";
    const focused = page.contains(document.activeElement)
      ? document.activeElement.dataset.testid
      : undefined;
    const remember = (labels) =>
      (shown.asked = new URLSearchParams({
        ...rest,
        study: study.id,
        measure,
        hidden: labels,
      }).toString());
    shown = { study: study.id, results, asked: stateKey, free: draw(page, given, remember) };
    if (focused)
      page.querySelector(`[data-testid="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
  };
  const choose = (patch) =>
    navigate("study" in patch ? { ...clearedState(shown?.results), ...patch } : patch, false);
  const update = (next) =>
    show(next).catch((fault) => aborted.signal.aborted || message(fault.message, "error"));
  update(state);
  return {
    update,
    unmount() {
      aborted.abort();
      shown?.free();
    },
  };
}

/** Load the results of a study. Without results, the page shows the reason. */
async function fetchResults(study, page, listed, choose, signal) {
  const pick = picker(listed, study.id, choose);
  if (study.problem) return showEmpty(page, "This study cannot be read", study.problem, pick);
  page.replaceChildren(
    el("div", { class: "row" }, pick),
    el(
      "div",
      { class: "card results-waiting" },
      el("span", { class: "spinner" }),
      " Reading the study …",
    ),
  );
  try {
    return await getJSON(`/api/results?${new URLSearchParams({ study: study.id })}`, signal);
  } catch (fault) {
    if (!signal.aborted) showEmpty(page, "This study has no results to show", fault.message, pick);
    return null;
  }
}

function showEmpty(page, title, sentence, ...more) {
  page.replaceChildren(
    el(
      "div",
      { class: "card empty", "data-testid": "results-empty" },
      el("h1", {}, title),
      el("p", {}, sentence),
      ...more.filter(Boolean),
    ),
  );
  return null;
}

/** Fill the page, and return a function that frees its charts. */
function draw(page, given, remember) {
  const { study, results, measure, choose, by, groups } = given;
  if (!groups.length) {
    const sentence = results.conditions.length
      ? "Change one of the filters."
      : "The first run is not finished yet.";
    showEmpty(
      page,
      "No condition to show",
      sentence,
      picker(given.listed, study.id, choose),
      factorChoices(results, given, choose),
    );
    return () => {};
  }
  const curves = el("section", { class: "card", "data-testid": "curves" });
  const boxes = ["best", "mean"].map((kind) =>
    el("section", { class: "card", "data-testid": `final-${kind}` }),
  );
  const last = lastGeneration(results);
  const norms = reactionNorms(
    given.ask(`/api/results/reaction?${new URLSearchParams({ study: study.id })}`),
    study.id,
    groups,
    given.norm,
    choose,
  );
  const runs = Object.fromEntries(
    groups.flatMap(({ conditions }) => conditions).map((name) => [name, runsOf(study, name)]),
  );
  const canShowRuns = given.alone && groups.length <= FEW;
  const eachRun =
    canShowRuns && runSwitch(given.lines, (each) => choose({ runs: each ? "each" : null }));
  page.replaceChildren(
    el("h1", { class: "visually-hidden" }, "Results"),
    heading(given),
    factorChoices(results, given, choose) ?? "",
    el(
      "div",
      { class: "row" },
      measureSwitch(results, measure, choose),
      eachRun,
      el("span", { class: "soft" }, explanation(given)),
    ),
    comparisonTable(results.comparison),
    curves,
    el("div", { class: groups.length > 8 ? "results-boxes wide" : "results-boxes" }, ...boxes),
    runTable(results, runs, measures(results), (name, run) =>
      hasWorldView(given, name)
        ? lifeAddress({ study: study.id, condition: name, run, generation: last(name) })
        : null,
    ),
    norms.section,
    claimList(
      results.claims,
      study,
      (condition) => results.typical_run[condition],
      last,
      results.problem,
    ),
  );
  const drawn = [
    drawCurves(curves, given, remember),
    ...["best", "mean"].map((kind, index) => drawBoxes(boxes[index], given, kind)),
    norms,
  ];
  return () => drawn.forEach((chart) => chart.destroy());
}

function explanation(given) {
  if (!given.alone)
    return (
      `Each curve is the mean of the conditions with one value of ${given.by}. Its ` +
      "band goes from the lowest to the highest condition. Click a curve to see its " +
      "conditions."
    );
  const click = !hasWorldView(given)
    ? ""
    : given.lines
      ? "Click a line to see that generation of its run. "
      : "Click a curve to see that generation of its typical run. ";
  return `${click}The bands are 95 % confidence intervals over runs.`;
}

function runsOf(study, name) {
  return study.conditions.find((condition) => condition.name === name).runs;
}

/** Return one row per generation of each curve. */
function meanRows(generations, series) {
  return series.flatMap(({ label, values, low, high }) =>
    generations.map((generation, index) => ({
      curve: label,
      generation,
      mean: values[index],
      low: low[index],
      high: high[index],
    })),
  );
}

function runRows(generations, series) {
  return series.flatMap(({ label, runs = [] }) =>
    runs.flatMap(({ run, values }) =>
      generations
        .map((generation, index) => ({ curve: label, run, generation, value: values[index] }))
        .filter(({ value }) => value !== null),
    ),
  );
}

/** Return whether the World tab can show a condition, or any condition. */
function hasWorldView({ study }, label) {
  return study.conditions.some(
    (condition) => isViewable(condition) && (label === undefined || condition.name === label),
  );
}

function heading({ study, listed, choose }) {
  const seed = el("span", { class: "badge" }, `seed ${study.seed}`);
  const runs = study.conditions.map((condition) => condition.runs.length);
  const [minRuns, maxRuns] = [Math.min(...runs), Math.max(...runs)];
  const runsBadge = el(
    "span",
    { class: "badge" },
    `${minRuns === maxRuns ? maxRuns : `${minRuns} to ${maxRuns}`} runs per condition`,
  );
  const folder =
    study.id === "." ? "" : `${study.id.split("/").map(encodeURIComponent).join("/")}/`;
  const report =
    study.report &&
    el(
      "a",
      {
        class: "button spread",
        target: "_blank",
        rel: "noopener",
        "data-testid": "report-link",
        href: `/api/report/${folder}report.html`,
      },
      "Full report",
    );
  return el("div", { class: "row" }, picker(listed, study.id, choose), seed, runsBadge, report);
}

function picker(listed, id, choose) {
  const options = listed.map((study) =>
    el(
      "option",
      { value: study.id, selected: study.id === id },
      study.id === "." ? "this study" : study.id,
    ),
  );
  const none = id === null ? [el("option", { value: "", selected: true }, "choose a study")] : [];
  const change = (event) => choose({ study: event.target.value });
  return el(
    "select",
    { "aria-label": "Study", "data-testid": "results-study", onchange: change },
    ...none,
    ...options,
  );
}

function measureSwitch(results, measure, choose) {
  const buttons = Object.entries(measures(results)).map(([key, { name }]) =>
    el(
      "button",
      {
        type: "button",
        "aria-pressed": String(key === measure),
        "data-testid": `measure-${key}`,
        onclick: () => choose({ measure: key }),
      },
      name,
    ),
  );
  return el("div", { class: "results-switch", role: "group", "aria-label": "Measure" }, ...buttons);
}

function drawCurves(
  root,
  { study, results, measure, hidden, navigate, choose, by, groups, lines, ask },
  remember,
) {
  const plot = el("div");
  let series = groups.map(({ label, conditions }, number) => {
    const { mean, low, high } = combineCurves(
      conditions.map((name) => results.curves[name][measure]),
    );
    return { label, values: mean, low, high, ...seriesStyle(number) };
  });
  const chart = lineChart(plot, {
    title: `${measures(results)[measure].title}, generation by generation`,
    x: results.generation,
    xLabel: "generation",
    yLabel: measures(results)[measure].axis,
    height: 320,
    series,
    hidden: hidden ? hidden.split(",") : [],
    onHidden(labels) {
      remember(labels.join(","));
      navigate({ hidden: labels.join(",") || null });
    },
    onPick({ x, label, run }) {
      const { conditions } = groups.find((group) => group.label === label);
      if (conditions.length > 1)
        return choose({ [`only.${by}`]: label, group: null, hidden: null });
      if (!hasWorldView({ study }, conditions[0]))
        return message("This model has no world to show.");
      location.hash = lifeAddress({
        study: study.id,
        condition: conditions[0],
        run: run ?? results.typical_run[conditions[0]],
        generation: x,
      });
    },
  });
  const saves = chartDownloads(
    "curves",
    ["curve", "generation", "mean", "low", "high"],
    () => meanRows(results.generation, series),
    chart.svg,
  );
  root.append(plot, saves);
  let isDestroyed = false;
  const status = el("span", { class: "soft" }, "Reading the runs …");
  const withRuns = async () => {
    saves.append(status);
    const runs = await Promise.all(
      groups.map(({ conditions: [condition] }) =>
        ask(`/api/results/runs?${new URLSearchParams({ study: study.id, condition, measure })}`),
      ),
    );
    if (isDestroyed) return;
    series = series.map((line, number) => ({
      ...line,
      runs: Object.entries(runs[number]).map(([run, values]) => ({
        run: Number(run),
        values: results.generation.map((_, index) => values[index] ?? null),
      })),
    }));
    chart.update(results.generation, series);
    status.replaceWith(
      downloadButton("run-curves.csv", () =>
        csv(["curve", "run", "generation", "value"], runRows(results.generation, series)),
      ),
    );
  };
  if (lines) withRuns().catch((fault) => isDestroyed || (status.textContent = fault.message));
  return {
    destroy() {
      isDestroyed = true;
      chart.destroy();
    },
  };
}

function drawBoxes(root, { study, results, groups }, kind) {
  const last = lastGeneration(results);
  const drawn = groups.map(({ label, conditions }, number) => {
    const points = conditions.flatMap((name) =>
      runsOf(study, name).map((run, index) => ({
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
      color: seriesStyle(number).color,
      describe: (index) =>
        `${points[index].name}, run ${points[index].run}: ` +
        `${points[index].value.toFixed(1)}${results.food ? " energy" : ""}`,
      ...(isLinked && {
        leads: "Open the last generation.",
        href: (index) =>
          lifeAddress({
            study: study.id,
            condition: points[index].name,
            run: points[index].run,
            generation: last(points[index].name),
          }),
      }),
    };
  });
  const plot = el("div");
  const chart = boxChart(plot, {
    title:
      `${measures(results)[kind].name} at the end of each run, ` +
      `${measures(results)[kind].axis}`,
    groups: drawn,
    height: 320,
  });
  const rows = () =>
    drawn.flatMap(({ label, points }) =>
      points.map((point) => ({ box: label, condition: point.name, ...point })),
    );
  root.append(
    plot,
    chartDownloads(`final-${kind}`, ["box", "condition", "run", "value"], rows, chart.svg),
  );
  return chart;
}

/** Return a function that returns the last generation of a condition. */
function lastGeneration(results) {
  return (condition) => {
    const mean = results.curves[condition].best.mean;
    return results.generation[mean.findLastIndex((value) => value !== null)];
  };
}
