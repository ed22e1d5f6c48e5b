/** The Results tab: a stored study's curves, boxes and claims, each of which leads to the lifetimes behind it. */

import { boxChart, lineChart, look } from "./charts.js";
import { claimList } from "./claims.js";
import { el, getJSON, message } from "./common.js";

const MEASURES = {
  best: { name: "Best agent", axis: "items eaten by the best agent", title: "What the best agent eats" },
  mean: { name: "Average agent", axis: "items eaten by the average agent", title: "What the average agent eats" },
  share: { name: "Share that eats", axis: "share of the agents that eat", title: "How many agents eat at all" },
};

const WITHOUT_FOOD = {
  best: { name: "Best agent", axis: "fitness of the best agent", title: "Fitness of the best agent" },
  mean: { name: "Average agent", axis: "fitness of the average agent", title: "Fitness of the average agent" },
  share: { name: "Share above 0", axis: "share of the agents", title: "How many agents have fitness above 0" },
};
const measures = (results) => (results.food ? MEASURES : WITHOUT_FOOD);

/** The address of a lifetime in the World tab. */
export function lifeAddress(life) {
  return `#/world?${new URLSearchParams(life)}`;
}

/** As the contract of main.js: shows what `state` says, and tells `navigate` what the reader chooses. */
export function mount(root, state, navigate) {
  const page = el("div", { class: "page results", "data-testid": "results" });
  root.append(page);
  const aborted = new AbortController();
  let listed = null; // the answer of /api/studies
  let shown = null; // {study, measure, hidden, free}: what is drawn, and how its charts are freed

  const show = async (wanted) => {
    listed ??= (await getJSON("/api/studies", aborted.signal)).studies;
    const whole = listed.filter((study) => !study.problem);
    if (!listed.length) return nothing(page, "There is no study here yet", "Make one with `baldwinlab reproduce`, or keep a live run.");
    const study = wanted.study ? listed.find((one) => one.id === wanted.study) : whole[0] ?? listed[0];
    if (!study) return nothing(page, "There is no such study", `${wanted.study} is not in this folder.`, picker(listed, null, choose));
    const measure = wanted.measure in MEASURES ? wanted.measure : "best";
    if (shown?.study === study.id && shown.measure === measure && shown.hidden === (wanted.hidden ?? "")) return;
    const results = shown?.study === study.id ? shown.results : await fetched(study, page, listed, choose, aborted.signal);
    if (!results || aborted.signal.aborted) return;
    shown?.free();
    const given = { study, results, measure, hidden: wanted.hidden ?? "", navigate, choose, listed };
    shown = { study: study.id, results, measure, hidden: given.hidden, free: draw(page, given, (hidden) => (shown.hidden = hidden)) };
  };
  const choose = (patch) => navigate(patch, false);
  const update = (next) => show(next).catch((fault) => aborted.signal.aborted || message(fault.message, "error"));
  update(state);
  return {
    update,
    unmount() {
      aborted.abort();
      shown?.free();
    },
  };
}

/** The results of a study; where there are none, the page says why. */
async function fetched(study, page, listed, choose, signal) {
  const pick = picker(listed, study.id, choose);
  if (study.problem) return nothing(page, "This study cannot be read", study.problem, pick);
  page.replaceChildren(el("div", { class: "row" }, pick), el("div", { class: "card results-waiting" }, el("span", { class: "spinner" }), " Reading the study …"));
  try {
    return await getJSON(`/api/results?${new URLSearchParams({ study: study.id })}`, signal);
  } catch (fault) {
    if (!signal.aborted) nothing(page, "This study has no results to show", fault.message, pick);
    return null;
  }
}

function nothing(page, title, sentence, ...more) {
  page.replaceChildren(el("div", { class: "card empty", "data-testid": "results-empty" }, el("h1", {}, title), el("p", {}, sentence), ...more));
  return null;
}

/** Fills the page, and returns what frees its charts. */
function draw(page, given, remember) {
  const { study, results, measure, choose } = given;
  const curves = el("section", { class: "card", "data-testid": "curves" });
  const boxes = ["best", "mean"].map((kind) => el("section", { class: "card", "data-testid": `final-${kind}` }));
  page.replaceChildren(
    el("h1", { class: "visually-hidden" }, "Results"),
    heading(given),
    el("div", { class: "row" }, measureSwitch(results, measure, choose), el("span", { class: "soft" }, `${watched(given) ? "Click a curve to replay that generation of its typical run; shaded" : "Shaded"}: 95 % bands over runs.`)),
    curves,
    el("div", { class: results.conditions.length > 8 ? "results-boxes wide" : "results-boxes" }, ...boxes),
    claimList(results.claims, study, (condition) => results.typical_run[condition], lastGeneration(results)),
  );
  const line = drawCurves(curves, given, remember);
  const drawn = ["best", "mean"].map((kind, place) => drawBoxes(boxes[place], given, kind));
  return () => [line, ...drawn].forEach((chart) => chart.destroy());
}

/** Whether lives of a condition, or of any, can be watched. */
function watched({ study }, label) {
  return study.conditions.some(({ name, steps }) => steps && (label === undefined || name === label));
}

function heading({ study, listed, choose }) {
  const seed = el("span", { class: "badge" }, `seed ${study.seed}`);
  const runs = study.conditions.map((condition) => condition.runs.length);
  const [least, most] = [Math.min(...runs), Math.max(...runs)];
  const counted = el("span", { class: "badge" }, `${least === most ? most : `${least} to ${most}`} runs a condition`);
  const report = study.report && el("a", { class: "button spread", target: "_blank", rel: "noopener", "data-testid": "report-link",
    href: `/api/report?${new URLSearchParams({ study: study.id })}` }, "Full report");
  return el("div", { class: "row" }, picker(listed, study.id, choose), seed, counted, report);
}

function picker(listed, id, choose) {
  const options = listed.map((study) => el("option", { value: study.id, selected: study.id === id }, study.id === "." ? "this study" : study.id));
  const none = id === null ? [el("option", { value: "", selected: true }, "choose a study")] : [];
  const change = (event) => choose({ study: event.target.value, hidden: null });
  return el("select", { "aria-label": "Study", "data-testid": "results-study", onchange: change }, ...none, ...options);
}

function measureSwitch(results, measure, choose) {
  const buttons = Object.entries(measures(results)).map(([key, { name }]) => el("button", {
    type: "button", "aria-pressed": String(key === measure), "data-testid": `measure-${key}`, onclick: () => choose({ measure: key }),
  }, name));
  return el("div", { class: "results-switch", role: "group", "aria-label": "Measure" }, ...buttons);
}

function drawCurves(root, { study, results, measure, hidden, navigate }, remember) {
  const series = results.conditions.map((label, number) => {
    const { mean, low, high } = results.curves[label][measure];
    return { label, values: mean, low, high, ...look(number) };
  });
  return lineChart(root, {
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
    onPick({ x, label }) {
      if (!watched({ study }, label)) return message("Lives of this model have no world to watch.");
      location.hash = lifeAddress({ study: study.id, condition: label, run: results.typical_run[label], generation: x });
    },
  });
}

function drawBoxes(root, { study, results }, kind) {
  const last = lastGeneration(results);
  const groups = results.conditions.map((label, number) => {
    const { runs } = study.conditions.find((condition) => condition.name === label);
    const [values, seen] = [results.final[label][kind], watched({ study }, label)];
    return {
      label,
      values,
      color: look(number).color,
      describe: (index) => `${label}, run ${runs[index]}: ${values[index].toFixed(1)}${results.food ? " items" : ""}${seen ? ". Replay its last generation." : ""}`,
      ...(seen && { href: (index) => lifeAddress({ study: study.id, condition: label, run: runs[index], generation: last(label) }) }),
    };
  });
  return boxChart(root, { title: `${measures(results)[kind].name} at the end, each run a point`, groups, height: 320 });
}

/** A condition's last generation, by its name. */
function lastGeneration(results) {
  return (condition) => {
    const mean = results.curves[condition].best.mean;
    return results.generation[mean.findLastIndex((value) => value !== null)];
  };
}
