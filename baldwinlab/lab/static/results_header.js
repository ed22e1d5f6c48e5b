/** The controls at the top of the Results tab: study, comparison, report and measure. */

import { el } from "./common.js";

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
  const options = studies.map((study) =>
    el(
      "option",
      { value: study.id, selected: study.id === id },
      study.id === "." ? "this study" : study.id,
    )
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

export function createMeasureSwitch(results, measure, choose) {
  const buttons = Object.entries(results.measures).map(([key, { name }]) =>
    el(
      "button",
      {
        type: "button",
        "aria-pressed": String(key === measure),
        "data-testid": `measure-${key}`,
        onclick: () => choose({ measure: key }),
      },
      name,
    )
  );
  return el("div", { class: "results-switch", role: "group", "aria-label": "Measure" }, ...buttons);
}
