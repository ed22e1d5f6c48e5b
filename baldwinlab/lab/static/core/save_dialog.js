/** The dialog that asks for the name of a study or a file. */

import { createButton, createField, el, openDialog } from "./common.js";

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
  const saveButton = createButton("Save", null, {
    type: "submit",
    class: "primary",
    "data-testid": "save-submit",
  });
  const cancelButton = createButton("Cancel", () => dialog.close(), { class: "quiet" });
  const form = el(
    "form",
    { class: "live-save" },
    el("h2", {}, title),
    createField(label, name),
    fault,
    el("div", { class: "row" }, el("span", { class: "spread" }), cancelButton, saveButton),
  );
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
  openDialog(dialog);
  name.select();
}
