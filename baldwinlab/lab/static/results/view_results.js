/** The Results tab: curves, boxes and claims of a study, with links to lifetimes. */

import { createClaimList } from "./claims.js";
import { el, getJSON, showMessage } from "../core/common.js";
import { createComparisonTable, formatAnswer } from "./comparison.js";
import {
  createSpeciesCards,
  drawSpeciesCharts,
  explainCurves,
  ResultsCurves,
} from "./results_curves.js";
import {
  clearFactorState,
  createFactorLists,
  createPanels,
  groupConditions,
} from "./results_factors.js";
import {
  createFactorSection,
  createFinals,
  createHeading,
  createMeasureSwitch,
  createNorms,
  createStudyPicker,
} from "./results_sections.js";
import { createTabs, INNATE, InnateMap } from "./innate_map.js";
import { findNewest } from "../core/sources.js";

// With more curves, the lines of single runs cannot be distinguished.
const MAX_CURVES = 8;

/**
 * @typedef {object} ResultsState the visible results
 * @property {object} study of /api/studies
 * @property {object[]} studies all studies
 * @property {object} results of /api/results
 * @property {string} measure a key of `results.measures`
 * @property {string} hidden labels of hidden curves, joined by commas
 * @property {string} [tab] INNATE for the map of behavior, by default the comparison
 * @property {string} [condition] of the map of behavior
 * @property {string} [run] of the map of behavior
 * @property {string} [norm] the changed setting of the reaction norms
 * @property {string|null} by the factor that groups conditions
 * @property {import("./results_factors.js").Group[]} groups one per curve
 * @property {{map: string, groups: import("./results_factors.js").Group[]}[]} panels of the curves
 * @property {boolean} hasSingleConditions whether each group is one condition
 * @property {boolean} canShowRuns whether the lines of runs can be distinguished
 * @property {boolean} hasRunLines whether each run is drawn
 * @property {(patch: Object<string, any>, replace?: boolean) => void} navigate
 * @property {(patch: Object<string, any>) => void} choose changes the state of the address
 * @property {(path: string) => Promise<any>} load requests data about the study, once
 * @property {import("../core/guide.js").Guide} guide
 */

/** Mount the view: show `state`, and report changes with `navigate` (see main.js). */
export function mount(root, state, navigate, guide) {
  const view = new ResultsView(root, navigate, guide);
  view.update(state);
  return view;
}

class ResultsView {
  constructor(root, navigate, guide) {
    this.guide = guide;
    this.page = el("div", { class: "page results", "data-testid": "results" });
    root.append(this.page);
    this.navigate = navigate;
    this.aborted = new AbortController();
    // The response of /api/studies.
    this.studies = null;
    // {study, results, stateKey, free}: the visible state, and the function that frees its charts.
    this.shown = null;
    // The responses about the visible study, by address.
    this.responses = new Map();
    this.choose = (patch) => this.changeState(patch);
    this.load = (path) => this.loadOnce(path);
  }

  update(state) {
    const { signal } = this.aborted;
    this.show(state).catch((error) => signal.aborted || showMessage(error.message, "error"));
  }

  unmount() {
    this.aborted.abort();
    this.shown?.free();
  }

  /** Change the state of the address. Another study resets the state of factors. */
  changeState(patch) {
    const reset = "study" in patch ? clearFactorState(this.shown?.results) : {};
    this.navigate({ ...reset, ...patch }, false);
  }

  loadOnce(path) {
    if (!this.responses.has(path)) this.responses.set(path, getJSON(path, this.aborted.signal));
    return this.responses.get(path);
  }

  async show(requested) {
    const { signal } = this.aborted;
    this.studies ??= (await getJSON("api/studies", signal)).studies;
    const study = this.findStudy(requested.study);
    if (!study) return this.showNoStudy(requested.study);
    const { hidden = "", ...rest } = requested;
    const formatStateKey = (labels) =>
      new URLSearchParams({ ...rest, study: study.id, hidden: labels }).toString();
    const stateKey = formatStateKey(hidden);
    if (this.shown?.stateKey === stateKey) return;
    const results = await this.loadResults(study);
    if (!results || signal.aborted) return;
    this.shown?.free();
    const view = this.createViewState(study, results, { ...requested, hidden });
    const restoreFolds = rememberFolds(this.page);
    const restoreFocus = rememberFocus(this.page);
    // A change of hidden curves does not draw the page again.
    const setHidden = (labels) => {
      this.shown.stateKey = formatStateKey(labels);
    };
    this.shown = { study: study.id, results, stateKey, free: draw(this.page, view, setHidden) };
    restoreFolds();
    restoreFocus();
  }

  /** Return the requested study. Without a request, return the newest readable study. */
  findStudy(id) {
    if (id) return this.studies.find((study) => study.id === id);
    return findNewest(this.studies.filter(({ problem }) => !problem)) ?? this.studies[0];
  }

  showNoStudy(id) {
    if (!this.studies.length)
      return showEmpty(
        this.page,
        "This folder contains no study yet",
        "Start a live run and save it, or compare conditions.",
        el("a", { class: "button primary", href: "#/live" }, "Live run"),
      );
    return showEmpty(
      this.page,
      "Unknown study",
      `${id} is not in this folder.`,
      createStudyPicker(this.studies, null, this.choose),
    );
  }

  /**
   * Return the results of a study. Results of the visible study are not requested again. Without
   * results, the page shows the reason.
   */
  async loadResults(study) {
    if (this.shown?.study === study.id) return this.shown.results;
    this.responses.clear();
    const { page, aborted: { signal } } = this;
    const picker = createStudyPicker(this.studies, study.id, this.choose);
    if (study.problem) return showEmpty(page, "This study cannot be read", study.problem, picker);
    const spinner = el("span", { class: "spinner" });
    page.replaceChildren(
      el("div", { class: "row" }, picker),
      el("div", { class: "card results-waiting" }, spinner, " Reading the study …"),
    );
    try {
      return await getJSON(`api/results?${new URLSearchParams({ study: study.id })}`, signal);
    } catch (error) {
      if (!signal.aborted)
        showEmpty(page, "This study has no results to show", error.message, picker);
      return null;
    }
  }

  /** @returns {ResultsState} */
  createViewState(study, results, requested) {
    const { hidden, norm, runs, tab, condition, run } = requested;
    // The results of a study without runs have no measures.
    const [defaultMeasure, ...others] = Object.keys(results.measures ?? {});
    const measure = others.includes(requested.measure) ? requested.measure : defaultMeasure;
    const { navigate, choose, studies, load, guide } = this;
    const grouping = groupConditions(results, requested);
    const hasSingleConditions = grouping.groups.every(({ conditions }) => conditions.length === 1);
    const panels = createPanels(results, grouping.groups);
    const canShowRuns = hasSingleConditions && grouping.groups.length <= MAX_CURVES;
    return {
      study,
      studies,
      results,
      measure,
      hidden,
      norm,
      tab,
      condition,
      run,
      navigate,
      choose,
      load,
      guide,
      ...grouping,
      panels,
      groups: panels.flatMap(({ groups }) => groups),
      hasSingleConditions,
      canShowRuns,
      hasRunLines: canShowRuns && runs === "each",
    };
  }
}

/** Return a function that moves the focus back to the focused control of a redrawn page. */
function rememberFocus(page) {
  const focused = page.contains(document.activeElement)
    ? document.activeElement.getAttribute("data-testid")
    : undefined;
  if (!focused) return () => {};
  const selector = `[data-testid="${CSS.escape(focused)}"]`;
  return () => page.querySelector(selector)?.focus({ preventScroll: true });
}

/** Return a function that opens the sections of a redrawn page that are open now. */
function rememberFolds(page) {
  const open = [...page.querySelectorAll("details[open]")].map(({ dataset }) => dataset.testid);
  return () => {
    for (const fold of page.querySelectorAll("details"))
      if (open.includes(fold.dataset.testid)) fold.open = true;
  };
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
  if (!view.groups.length) {
    showNoCondition(page, view);
    return () => {};
  }
  if (view.tab === INNATE) return drawInnate(page, view);
  const curves = el("section", { class: "card", "data-testid": "curves" });
  const folds = [createFinals(view), createNorms(view)];
  const speciesCards = createSpeciesCards(view);
  page.replaceChildren(
    el("h1", { class: "visually-hidden" }, "Results"),
    createHeading(view),
    createTabs(view),
    createLead(view),
    createMissingNote(view.study),
    createMeasureSwitch(view.results, view.measure, view.choose),
    curves,
    el("p", { class: "soft" }, explainCurves(view)),
    createComparisonTable(view.results.comparison, false),
    createFactorSection(view),
    speciesCards ?? "",
    ...folds.map(({ element }) => element),
    createClaimList(view),
  );
  // Charts need the width of their elements on the page.
  const charts = [
    new ResultsCurves(curves, view, setHidden),
    ...drawSpeciesCharts(speciesCards, view),
    ...folds,
  ];
  return () => charts.forEach((chart) => chart.destroy());
}

/** Fill the page with the map of behavior, and return a function that stops its requests. */
function drawInnate(page, view) {
  const map = new InnateMap(view);
  page.replaceChildren(
    el("h1", { class: "visually-hidden" }, "Results: is it innate?"),
    createHeading(view),
    createTabs(view),
    map.element,
  );
  return () => map.destroy();
}

function showNoCondition(page, { study, studies, results, by, only, choose }) {
  const sentence = results.conditions.length
    ? "Change one of the filters."
    : "The first run is not finished yet.";
  showEmpty(
    page,
    "No condition to show",
    sentence,
    createStudyPicker(studies, study.id, choose),
    createFactorLists(results, { by, only }, choose),
  );
}

/** Return the answer of the study, and the link to the definition of the Baldwin effect. */
function createLead({ results, guide }) {
  return el(
    "div",
    { class: "lead" },
    el("strong", { "data-testid": "answer" }, formatAnswer(results.comparison)),
    guide.createDefinitionLink(),
  );
}

/** Return why lifetimes of the study cannot be played, or "". */
function createMissingNote({ missing }) {
  return missing && el("p", { "data-testid": "missing-parts" }, missing);
}
