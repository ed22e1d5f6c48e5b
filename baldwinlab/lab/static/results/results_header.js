/** The controls at the top of the Results tab: study, comparison, report and measure. */

import { createButton, createSelect, el } from "../core/common.js";

export function createHeading({ study, studies, choose }) {
  const folder = study.id === "."
    ? ""
    : `${study.id.split("/").map(encodeURIComponent).join("/")}/`;
  const report = study.report &&
    el(
      "a",
      {
        class: "button",
        target: "_blank",
        rel: "noopener",
        "data-testid": "report-link",
        href: `api/report/${folder}report.html`,
      },
      "Full report",
    );
  return el(
    "div",
    { class: "row" },
    createStudyPicker(studies, study.id, choose),
    el("span", { class: "spread" }),
    createCompareLink(study),
    report,
  );
}

/** Return a link to the dialog of comparisons. The presets of the study are ticked. */
function createCompareLink({ conditions }) {
  const presets = conditions.map(({ name }) => name);
  const query = new URLSearchParams({ compare: JSON.stringify({ presets }) });
  return el(
    "a",
    { class: "button", "data-testid": "compare-link", href: `#/live?${query}` },
    "Compare …",
  );
}

export function createStudyPicker(studies, id, choose) {
  const names = studies.map((study) => [study.id, study.id === "." ? "this study" : study.id]);
  const options = id === null ? [["", "choose a study"], ...names] : names;
  return createSelect(options, id, (study) => choose({ study }), {
    "aria-label": "Study",
    "data-testid": "results-study",
  });
}

export function createMeasureSwitch(results, measure, choose) {
  const buttons = Object.entries(results.measures).map(([key, { name }]) =>
    createButton(name, () => choose({ measure: key }), {
      "aria-pressed": String(key === measure),
      "data-testid": `measure-${key}`,
    })
  );
  return el("div", { class: "results-switch", role: "group", "aria-label": "Measure" }, ...buttons);
}
