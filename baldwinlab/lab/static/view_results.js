/** The Results tab: curves, boxes and claims of a study, with links to lifetimes. */

import { createRunSwitch } from "./chart_legend.js";
import { createClaimList } from "./claims.js";
import { el, getJSON, showMessage } from "./common.js";
import { createComparisonTable } from "./comparison.js";
import { createReactionNorms } from "./reaction_norms.js";
import { drawBoxes } from "./results_boxes.js";
import { drawCurves, explainCurves } from "./results_curves.js";
import { clearFactorState, createFactorLists, groupConditions } from "./results_factors.js";
import { createHeading, createMeasureSwitch, createStudyPicker } from "./results_header.js";
import {
  MEASURES,
  createGenerationLookup,
  describeMeasures,
  findRuns,
  hasWorldView,
} from "./results_measures.js";
import { createRunTable } from "./results_runs.js";
import { formatLifetimeAddress } from "./sources.js";

// With more curves, the lines of single runs cannot be distinguished.
const MAX_CURVES = 8;

/** Mount the view: show `state`, and report changes with `navigate` (see main.js). */
export function mount(root, state, navigate) {
  const page = el("div", { class: "page results", "data-testid": "results" });
  root.append(page);
  const aborted = new AbortController();
  // The response of /api/studies.
  let studies = null;
  // {study, results, stateKey, free}: the visible state, and the function that frees its charts.
  let shown = null;
  // The responses about the visible study, by address.
  const responses = new Map();
  const load = (path) => {
    if (!responses.has(path)) responses.set(path, getJSON(path, aborted.signal));
    return responses.get(path);
  };

  const show = async (requested) => {
    studies ??= (await getJSON("/api/studies", aborted.signal)).studies;
    const readable = studies.filter((study) => !study.problem);
    if (!studies.length)
      return showEmpty(
        page,
        "This folder contains no study yet",
        "Create one with `baldwinlab reproduce`, or save a live run.",
      );
    const study = requested.study
      ? studies.find(({ id }) => id === requested.study)
      : (readable[0] ?? studies[0]);
    if (!study)
      return showEmpty(
        page,
        "Unknown study",
        `${requested.study} is not in this folder.`,
        createStudyPicker(studies, null, choose),
      );
    const measure = requested.measure in MEASURES ? requested.measure : "best";
    const { hidden = "", ...rest } = requested;
    const formatState = (labels) =>
      new URLSearchParams({ ...rest, study: study.id, measure, hidden: labels }).toString();
    const stateKey = formatState(hidden);
    if (shown?.stateKey === stateKey) return;
    if (shown?.study !== study.id) responses.clear();
    const results =
      shown?.study === study.id
        ? shown.results
        : await fetchResults(study, page, studies, choose, aborted.signal);
    if (!results || aborted.signal.aborted) return;
    shown?.free();
    const view = {
      study,
      results,
      measure,
      hidden,
      navigate,
      choose,
      studies,
      load,
      norm: requested.norm,
      ...groupConditions(results, requested),
    };
    view.hasSingleConditions = view.groups.every(({ conditions }) => conditions.length === 1);
    view.hasRunLines =
      view.hasSingleConditions && view.groups.length <= MAX_CURVES && requested.runs === "each";
    const focused = page.contains(document.activeElement)
      ? document.activeElement.dataset.testid
      : undefined;
    const setHidden = (labels) => {
      shown.stateKey = formatState(labels);
    };
    shown = { study: study.id, results, stateKey, free: draw(page, view, setHidden) };
    if (focused)
      page.querySelector(`[data-testid="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
  };
  const choose = (patch) =>
    navigate("study" in patch ? { ...clearFactorState(shown?.results), ...patch } : patch, false);
  const update = (next) =>
    show(next).catch((error) => aborted.signal.aborted || showMessage(error.message, "error"));
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
async function fetchResults(study, page, studies, choose, signal) {
  const pick = createStudyPicker(studies, study.id, choose);
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
  } catch (error) {
    if (!signal.aborted) showEmpty(page, "This study has no results to show", error.message, pick);
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
function draw(page, view, setHidden) {
  const { study, results, measure, choose, groups } = view;
  if (!groups.length) {
    const sentence = results.conditions.length
      ? "Change one of the filters."
      : "The first run is not finished yet.";
    showEmpty(
      page,
      "No condition to show",
      sentence,
      createStudyPicker(view.studies, study.id, choose),
      createFactorLists(results, view, choose),
    );
    return () => {};
  }
  const curves = el("section", { class: "card", "data-testid": "curves" });
  const boxes = ["best", "mean"].map((kind) =>
    el("section", { class: "card", "data-testid": `final-${kind}` }),
  );
  const last = createGenerationLookup(results);
  const norms = createReactionNorms(
    view.load(`/api/results/reaction?${new URLSearchParams({ study: study.id })}`),
    study.id,
    groups,
    view.norm,
    choose,
  );
  const runs = Object.fromEntries(
    groups.flatMap(({ conditions }) => conditions).map((name) => [name, findRuns(study, name)]),
  );
  const canShowRuns = view.hasSingleConditions && groups.length <= MAX_CURVES;
  const runSwitch =
    canShowRuns &&
    createRunSwitch(view.hasRunLines, (isChecked) => choose({ runs: isChecked ? "each" : null }));
  page.replaceChildren(
    el("h1", { class: "visually-hidden" }, "Results"),
    createHeading(view),
    createFactorLists(results, view, choose) ?? "",
    el(
      "div",
      { class: "row" },
      createMeasureSwitch(results, measure, choose),
      runSwitch,
      el("span", { class: "soft" }, explainCurves(view)),
    ),
    createComparisonTable(results.comparison),
    curves,
    el(
      "div",
      { class: groups.length > MAX_CURVES ? "results-boxes wide" : "results-boxes" },
      ...boxes,
    ),
    createRunTable(results, runs, describeMeasures(results), (name, run) =>
      hasWorldView(view, name)
        ? formatLifetimeAddress({ study: study.id, condition: name, run, generation: last(name) })
        : null,
    ),
    norms.section,
    createClaimList(
      results.claims,
      study,
      (condition) => results.typical_run[condition],
      last,
      results.problem,
    ),
  );
  const drawn = [
    drawCurves(curves, view, setHidden),
    ...["best", "mean"].map((kind, index) => drawBoxes(boxes[index], view, kind)),
    norms,
  ];
  return () => drawn.forEach((chart) => chart.destroy());
}
