/** The essay: each step has dials in its text, a picture, and a question. */

import { formatNumber, setText } from "../core/common.js";
import { Dials } from "./figure.js";
import { ControlsFigure, CurvesFigure, EvolutionFigure, ForkFigure } from "./evolution_figures.js";
import { AgentFigure, LearningFigure } from "./life_figures.js";
import { MapFigure } from "./map_figure.js";
import { NeedleFigure } from "./needle_figure.js";
import { LiveSource, RecordedSource } from "./source.js";

const FIGURES = {
  agent: AgentFigure,
  evolution: EvolutionFigure,
  learning: LearningFigure,
  both: CurvesFigure,
  controls: ControlsFigure,
  innate: ForkFigure,
  needle: NeedleFigure,
  yours: MapFigure,
};
// The shares of a picture in sight at which the page chooses the picture that plays.
const SIGHT_STEPS = [0, 0.2, 0.4, 0.6, 0.8, 1];
const MIN_SIGHT = 0.2;

/**
 * @param {import("./source.js").PageData} data
 * @param {string} code of a worker
 */
export function openEssay(data, code) {
  const recorded = new RecordedSource(data);
  const source = hasEngine() ? new LiveSource(data, code) : recorded;
  document.getElementById("no-engine").hidden = source.isLive;
  if (source instanceof LiveSource)
    Object.assign(globalThis, { baldwinlab: { simulate: (options) => source.simulate(options) } });
  /** @type {NodeListOf<HTMLElement>} */
  const sections = document.querySelectorAll(".step");
  const figures = [...sections].map((section) => {
    const dials = new Dials(section, (name, value) => formatDial(data, name, value));
    if (!source.isLive && section.id !== "needle") dials.disable();
    connectQuestion(section.querySelector(".question"));
    const setValue = createValueSetter(section);
    const root = section.querySelector("[data-figure]");
    return new FIGURES[section.id](root, { source, recorded, data, dials, setValue });
  });
  playFigureInSight(figures);
  const showStills = () => Promise.all(figures.map((figure) => figure.showStill()));
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) showStills();
  addEventListener("beforeprint", showStills);
}

function hasEngine() {
  return typeof WebAssembly !== "undefined" && typeof Worker !== "undefined";
}

/** Return the text of a dial. Two dials are indices of recorded numbers. */
function formatDial({ needle }, name, value) {
  if (name === "cost") return formatNumber(needle.costs[value]);
  if (name === "period") return formatNumber(needle.periods[value]);
  return formatNumber(value);
}

/** Return a function that shows a value in the text of a step. */
function createValueSetter(section) {
  const outputs = new Map(
    [...section.querySelectorAll("[data-value]")].map((output) => [output.dataset.value, output]),
  );
  return (name, text) => {
    const output = outputs.get(name);
    if (output) setText(output, text);
  };
}

/** Show whether the chosen answer is right. */
function connectQuestion(question) {
  const { answer, right, wrong } = question.dataset;
  const feedback = question.querySelector(".feedback");
  question.addEventListener("change", ({ target }) => {
    const isRight = target.value === answer;
    feedback.textContent = isRight ? right : wrong;
    feedback.classList.toggle("right", isRight);
  });
}

/** Play one picture at a time: the one of which most is in sight. */
function playFigureInSight(figures) {
  const shares = new Map(figures.map((figure) => [figure, 0]));
  const figureOf = new Map(figures.map((figure) => [figure.root, figure]));
  const observer = new IntersectionObserver(
    (entries) => {
      for (const { target, intersectionRatio } of entries)
        shares.set(figureOf.get(target), intersectionRatio);
      const largest = Math.max(...shares.values());
      const chosen = figures.find((figure) => shares.get(figure) === largest);
      for (const figure of figures)
        figure.setInSight(figure === chosen && largest >= MIN_SIGHT);
    },
    { threshold: SIGHT_STEPS },
  );
  for (const { root } of figures) observer.observe(root);
  document.addEventListener("visibilitychange", () => figures.forEach((figure) => figure.update()));
}
