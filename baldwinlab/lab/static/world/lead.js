/** The line above the worlds: a question, and at the end of a lifetime its answer. */

import { createButton, el, formatNumber } from "../core/common.js";

// Seconds of playback before the first meal.
const LEAD_TIME = 0.5;

export class Lead {
  /**
   * @param {import("../core/guide.js").Guide} guide
   * @param {(generation: number) => void} watch shows a generation
   * @param {import("../core/hints.js").Hint|null} [hint] about the worlds
   */
  constructor(guide, watch, hint = null) {
    this.watch = watch;
    this.question = el("strong", { "data-testid": "question" });
    this.note = el("span", { class: "soft", role: "status", "data-testid": "lead-note" });
    this.root = el(
      "div",
      { class: "lead" },
      this.question,
      this.note,
      guide.createDefinitionLink(),
      hint?.element ?? null,
    );
  }

  /**
   * Show the question of one or two worlds.
   * @param {{source: import("../core/sources.js").Source, life: object}[]} panels
   */
  ask(panels) {
    this.question.textContent = formatQuestion(panels);
    this.note.replaceChildren();
  }

  /** Start playback just before the first meal, so that something happens at once. */
  startBefore(firstMeal, player) {
    const step = Math.floor(firstMeal - LEAD_TIME * player.pace);
    if (step > 0 && step < Infinity) player.seek(step);
  }

  /** Say what happened in complete lifetimes, and what to watch next. */
  showEnd(panels, lastGeneration) {
    const results = panels.map((panel) => {
      const { life } = panel;
      const end = life.findPart(life.steps - 1);
      return `${nameCondition(panel)}: ${end.describeEaten(life.steps)}.`;
    });
    const { generation } = panels[0].source;
    const next = generation === 0 ? lastGeneration : 0;
    const text = `Watch generation ${formatNumber(next)}`;
    const button = createButton(text, () => this.watch(next), { "data-testid": "watch-next" });
    this.note.replaceChildren(results.join(" "), " ", ...(lastGeneration ? [button] : []));
  }
}

function formatQuestion(panels) {
  const [first, second] = panels;
  const learns = panels.map(({ life }) => life?.header.learns);
  if (!second)
    return learns[0]
      ? "What do these agents learn during life?"
      : "What can agents do that do not learn?";
  if (learns[0] !== learns[1])
    return "Do agents that learn during life eat more than agents that cannot?";
  if (first.source.generation !== second.source.generation)
    return (
      `What has evolved between generations ${first.source.generation} and ` +
      `${second.source.generation}?`
    );
  return `Which agents eat more: ${nameCondition(first)} or ${nameCondition(second)}?`;
}

function nameCondition({ condition, source }) {
  return condition?.title ?? source.condition;
}
