/** The dialog that saves a live run as a study. */

import { el } from "./common.js";

/** Open a dialog that asks for the name of a study until `save` succeeds. */
export function openSaveDialog(initialName, save) {
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
  const done = el(
    "button",
    { type: "submit", class: "primary", "data-testid": "save-submit" },
    "Save",
  );
  const cancel = el(
    "button",
    { type: "button", class: "quiet", onclick: () => dialog.close() },
    "Cancel",
  );
  const form = el(
    "form",
    { class: "live-save" },
    el("h2", {}, "Save this run as a study"),
    el(
      "label",
      { class: "field" },
      el("span", {}, "Name of the study in the folder of this lab"),
      name,
    ),
    fault,
    el("div", { class: "row" }, el("span", { class: "spread" }), cancel, done),
  );
  const dialog = el("dialog", {}, form);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    done.disabled = true;
    try {
      await save(name.value.trim());
      dialog.close();
    } catch (error) {
      fault.textContent = error.message;
      fault.hidden = false;
    }
    done.disabled = false;
  });
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
  name.select();
}
