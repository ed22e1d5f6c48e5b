/** The founders of a run in the form: files of the freezer, each with a share. */

import { createButton, createSelect, el, showMessage } from "../core/common.js";
import { describeOrigin, listFrozenFiles } from "./freezer_panel.js";

/**
 * @typedef {{path: string, sha256?: string, share: number}} Founders
 */

/**
 * Return the rows of the founders.
 * @param {Founders[]} founders
 * @param {(founders: Founders[]) => void} set called after each change
 */
export function createFoundersField(founders, set) {
  const root = el("div", { class: "form-groups" });
  let files = [];
  const change = (changed) => {
    founders = changed;
    set(founders);
    draw();
  };
  const draw = () => root.replaceChildren(...createRows(founders, files, change));
  draw();
  listFrozenFiles()
    .then((listed) => {
      files = listed.filter(({ problem }) => !problem);
      draw();
    })
    .catch((error) => showMessage(error.message, "error"));
  return root;
}

function createRows(founders, files, change) {
  const add = createButton(
    files.length ? "Add founders" : "The freezer is empty",
    () => change(shareEqually([...founders, { path: files[0].path, share: 1 }])),
    { class: "quiet", disabled: !files.length, "data-testid": "add-founders" },
  );
  return [...founders.map((_, row) => createRow(founders, row, files, change)), add];
}

/** Give all files the same share, because the shares must add up to 1. */
function shareEqually(founders) {
  return founders.map((entry) => ({ ...entry, share: 1 / founders.length }));
}

function createRow(founders, row, files, change) {
  const { path, share } = founders[row];
  const replace = (entry) => change(founders.map((old, index) => (index === row ? entry : old)));
  const options = files.map((file) => [file.path, `${file.name}: ${describeOrigin(file)}`]);
  // A run can have founders that are not in the freezer.
  if (!files.some((file) => file.path === path)) options.push([path, path]);
  const list = createSelect(options, path, (chosen) => replace({ path: chosen, share }), {
    "aria-label": `Founders ${row + 1}`,
    "data-testid": `founders-${row}`,
  });
  const shareInput = el("input", {
    type: "number",
    min: 0,
    max: 1,
    step: "any",
    value: share,
    "aria-label": `Share of founders ${row + 1}`,
    "data-testid": `share-${row}`,
    onchange: () => replace({ path, share: shareInput.valueAsNumber }),
  });
  const remove = createButton(
    "×",
    () => change(shareEqually(founders.filter((_, index) => index !== row))),
    { class: "quiet", "aria-label": `Remove founders ${row + 1}` },
  );
  return el("div", { class: "form-inputs founders-row" }, list, shareInput, remove);
}
