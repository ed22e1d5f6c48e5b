/** Downloads of the visible data: tables as CSV, charts as PNG. */

import { createButton, createMenu, el } from "./common.js";

export const CURVE_COLUMNS = ["curve", "generation", "value", "low", "high"];
const MEDIA_TYPES = { csv: "text/csv", png: "image/png", toml: "application/toml" };

/**
 * Return a menu that downloads the data of a chart, and its picture if it has one.
 * @param {string} name of the chart
 * @param {string[]} columns
 * @param {() => Object<string, any>[]} rows
 * @param {(() => Promise<Blob>)|null} [drawPicture] returns a PNG file
 * @param {string} [file] name of the files without suffix, by default that of the chart
 */
export function createChartDownloads(name, columns, rows, drawPicture = null, file = name) {
  const formatRows = () => formatCsv(columns, rows());
  const items = [
    createDownloadButton(`${name}.csv`, formatRows, "Save as CSV", `${file}.csv`),
    drawPicture && createDownloadButton(`${name}.png`, drawPicture, "Save as PNG", `${file}.png`),
  ];
  return createMenu("Save", items, `saves-${name}`);
}

/**
 * Return links that download a figure of the report in all formats, drawn by the server.
 * @param {string} study
 * @param {"fitness"|"final-fitness"|"responses"} figure
 * @param {string[]} conditions
 * @param {Object<string, string>} [selection] the measure of the visible curves
 */
export function createFigureLinks(study, figure, conditions, selection = {}) {
  const createLink = (format) => {
    const query = new URLSearchParams({ study, figure, format, ...selection });
    for (const condition of conditions) query.append("condition", condition);
    return el(
      "a",
      {
        href: `api/results/figure?${query}`,
        download: "",
        "aria-label": `Save figure as ${format.toUpperCase()}`,
        "data-testid": `save-${figure}-${format}`,
      },
      format.toUpperCase(),
    );
  };
  return el(
    "details",
    { class: "chart-saves", "data-testid": `save-${figure}` },
    el("summary", {}, "Save figure"),
    el("p", { class: "row" }, ...["svg", "pdf", "png", "csv"].map(createLink)),
  );
}

/**
 * Return a button that downloads a file.
 * @param {string} name
 * @param {() => string|Promise<Blob>} create is called when the button is pressed
 */
export function createDownloadButton(name, create, label = `Save as ${name}`, file = name) {
  const save = async () => {
    const type = MEDIA_TYPES[name.split(".").pop()];
    saveFile(new Blob([await create()], { type }), file);
  };
  return createButton(label, save, {
    class: "quiet",
    "aria-label": label.endsWith(name) ? null : `${label}: ${name}`,
    "data-testid": `download-${name}`,
  });
}

/** Let the browser save a file. */
export function saveFile(blob, name) {
  const url = URL.createObjectURL(blob);
  el("a", { href: url, download: name }).click();
  // The browser has read the file after a minute.
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** Return one row per generation of each curve. The values have a name, such as "median". */
export function listCurveRows(generations, series, name = "value") {
  return series.flatMap(({ label, values, low, high }) =>
    generations.map((generation, index) => ({
      curve: label,
      generation,
      [name]: values[index],
      low: low?.[index],
      high: high?.[index],
    }))
  );
}

/** Return rows as CSV. A missing number is an empty cell. */
export function formatCsv(columns, rows) {
  const formatCell = (value) => {
    if (value === null || value === undefined) return "";
    return /[",\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : value;
  };
  const table = [columns, ...rows.map((row) => columns.map((column) => row[column]))];
  return `${table.map((cells) => cells.map(formatCell).join(",")).join("\n")}\n`;
}
