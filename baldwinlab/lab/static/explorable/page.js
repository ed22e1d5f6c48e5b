/** The essay: each step has dials in its text, a picture, and a question. */

import { formatNumber, setText } from "../core/common.js";
import { Dials } from "./dials.js";
import { EvolutionFigure } from "./evolution_figure.js";
import { wait } from "./figure.js";
import { ForagerFigure } from "./forager_figure.js";
import { LandscapeFigure } from "./landscape_figure.js";
import { LessonFigure } from "./lesson_figure.js";
import { AgentFigure } from "./life_figures.js";
import { MapFigure } from "./map_figure.js";
import { LiveSource, RecordedSource } from "./source.js";
import { ChangingFigure, PuzzleFigure } from "./string_figures.js";

const FIGURES = {
  agent: AgentFigure,
  evolution: EvolutionFigure,
  learning: LessonFigure,
  puzzle: PuzzleFigure,
  changing: ChangingFigure,
  landscape: LandscapeFigure,
  foragers: ForagerFigure,
  yours: MapFigure,
};
// Steps whose pictures are simulated without WebAssembly.
const PLAIN_STEPS = ["puzzle", "changing", "landscape"];
// The shares of a picture in sight at which the page chooses the picture that plays.
const SIGHT_STEPS = [0, 0.2, 0.4, 0.6, 0.8, 1];
const MIN_SIGHT = 0.2;

/**
 * @param {import("./source.js").PageData} data
 * @param {string} code of a worker
 */
export async function openEssay(data, code) {
  const recorded = new RecordedSource(data);
  const source = hasEngine() ? new LiveSource(data, code) : recorded;
  document.getElementById("no-engine").hidden = source.isLive;
  if (source instanceof LiveSource)
    Object.assign(globalThis, { baldwinlab: { simulate: (options) => source.simulate(options) } });
  /** @type {NodeListOf<HTMLElement>} */
  const sections = document.querySelectorAll(".step");
  const figures = [...sections].map((section) => {
    const dials = new Dials(section, (name, value) => formatDial(data, name, value));
    if (!source.isLive && !PLAIN_STEPS.includes(section.id)) dials.disable();
    connectQuestion(section.querySelector(".question"));
    const setValue = createValueSetter(section);
    const root = section.querySelector("[data-figure]");
    return new FIGURES[section.id](root, { source, recorded, data, dials, setValue });
  });
  playFigureInSight(figures);
  const showStills = () => figures.forEach((figure) => figure.showStill());
  // A browser prints right after this event, so the pictures are drawn without waiting.
  addEventListener("beforeprint", showStills);
  await recorded.loadLives();
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  for (const figure of figures) {
    figure.showStill();
    // The page scrolls between two pictures.
    await wait(0);
  }
}

function hasEngine() {
  return typeof WebAssembly !== "undefined" && typeof Worker !== "undefined";
}

/** Return the text of a dial. Some dials are indices in lists of numbers. */
function formatDial({ needle, strings }, name, value) {
  const lists = { trials: needle.trials, cost: needle.costs, period: needle.periods };
  const number = name in lists ? lists[name][value] : value;
  return name === "period" && number === 0 ? strings.figures.never_changes : formatNumber(number);
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
  if (!question) return;
  const { answer, right, wrong } = question.dataset;
  const feedback = question.querySelector(".feedback");
  question.addEventListener("change", ({ target }) => {
    feedback.textContent = target.value === answer ? right : wrong;
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
