/** What is shown, to take along: tables as CSV, pictures as SVG. */

import { el } from "./common.js";

const TYPES = { csv: "text/csv", svg: "image/svg+xml", toml: "application/toml" };

/**
 * Two buttons that take a chart along: what it is drawn from, and how it is drawn.
 * @param {string} name of the files, without their endings
 * @param {string[]} columns
 * @param {() => Object<string, any>[]} rows
 * @param {() => string} picture the text of an SVG file
 */
export function chartDownloads(name, columns, rows, picture) {
  return el(
    "div",
    { class: "row chart-saves" },
    downloadButton(`${name}.csv`, () => csv(columns, rows()), "Save as CSV"),
    downloadButton(`${name}.svg`, picture, "Save as SVG"),
  );
}

/** A button that takes a text along as a file of that name; the text is asked for when it is pressed. */
export function downloadButton(name, text, label = `Save as ${name}`) {
  const save = () => {
    const url = URL.createObjectURL(new Blob([text()], { type: TYPES[name.split(".").pop()] }));
    el("a", { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };
  return el(
    "button",
    {
      type: "button",
      class: "quiet",
      "aria-label": label.endsWith(name) ? null : `${label}: ${name}`,
      "data-testid": `download-${name}`,
      onclick: save,
    },
    label,
  );
}

/** Rows as a table that other programs read; a number that does not exist is an empty cell. */
export function csv(columns, rows) {
  const cell = (value) =>
    value === null || value === undefined
      ? ""
      : /[",\n]/.test(value)
        ? `"${String(value).replaceAll('"', '""')}"`
        : value;
  return `${[columns, ...rows.map((row) => columns.map((column) => row[column]))].map((cells) => cells.map(cell).join(",")).join("\n")}\n`;
}
