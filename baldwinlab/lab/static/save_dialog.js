/** The dialog that asks for the name of a study or a file. */

import { el } from "./common.js";

/**
 * Open a dialog that asks for a name until `save` succeeds.
 * @param {string} title
 * @param {string} label of the name
 * @param {string} initialName
 * @param {(name: string) => Promise<void>} save
 */
export function openSaveDialog(title, label, initialName, save) {
  const name = el("input", {
    value: initialName,
    spellcheck: "false",
    maxlength: 100,
    "data-testid": "save-name",
  });
  const fault = el("p", {
    class: "fault",
    hidden: true,
    role: "alert",
    "data-testid": "save-fault",
  });
  const saveButton = el(
    "button",
    { type: "submit", class: "primary", "data-testid": "save-submit" },
    "Save",
  );
  const form = createForm(title, label, name, fault, saveButton, () => dialog.close());
  const dialog = el("dialog", {}, form);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    saveButton.disabled = true;
    try {
      await save(name.value.trim());
      dialog.close();
    } catch (error) {
      fault.textContent = error.message;
      fault.hidden = false;
    }
    saveButton.disabled = false;
  });
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
  name.select();
}

function createForm(title, label, name, fault, saveButton, cancel) {
  return el(
    "form",
    { class: "live-save" },
    el("h2", {}, title),
    el("label", { class: "field" }, el("span", {}, label), name),
    fault,
    el(
      "div",
      { class: "row" },
      el("span", { class: "spread" }),
      el("button", { type: "button", class: "quiet", onclick: cancel }, "Cancel"),
      saveButton,
    ),
  );
}
