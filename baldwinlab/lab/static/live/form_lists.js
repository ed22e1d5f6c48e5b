/** The lists of a form: numbers or choices in a row, or groups. */

import { createButton, el } from "../core/common.js";
import { createEntryInput } from "./form_inputs.js";
import { chooseNewEntry, formatName, resolve } from "./form_schema.js";

/** Return a list that can grow and shrink: numbers in a row, or groups. */
export function createList(form, node, holder, key, path) {
  const item = resolve(form, node.items);
  // A list that is not set is null, and stays null while it has no entries.
  const emptyList = holder[key] === null ? null : [];
  const listed = () => holder[key] ?? [];
  const title = formatName(key);
  const fault = el("p", { class: "fault", hidden: true });
  const entries = el("div", { class: item.type === "object" ? "form-groups" : "form-row" });
  const add = createButton(
    item.type === "object" ? `Add a ${formatName(item.title)}` : "Add",
    () => redraw([...listed(), chooseNewEntry(form, item, listed())]),
    // There can be no options.
    { class: "quiet", hidden: item.enum?.length === 0, "data-testid": `add-${path}` },
  );
  const draw = () => {
    for (const old of [...form.fields.keys()])
      if (old.startsWith(`${path}.`)) form.fields.delete(old);
    entries.replaceChildren(
      ...listed().map((_, number) =>
        createEntry(form, item, holder, key, number, path, title, redraw)
      ),
    );
    add.disabled = node.maxItems !== undefined && listed().length >= node.maxItems;
  };
  const redraw = (values) => {
    holder[key] = values.length > 0 ? values : emptyList;
    draw();
    if (item["x-chooses"]) form.chosen();
    else form.changed();
  };
  form.fields.set(path, { fault, input: null });
  draw();
  return el(
    "div",
    { class: "form-field", role: "group", "aria-label": title, "data-testid": `list-${path}` },
    el("span", { class: "form-name" }, title),
    node.description ? el("span", { class: "hint" }, node.description) : null,
    entries,
    add,
    fault,
  );
}

function createEntry(form, item, holder, key, number, path, title, redraw) {
  const entryLabel = `${title} ${number + 1}`;
  const remove = createButton(
    item.type === "object" ? `Remove ${entryLabel}` : "×",
    () => redraw(holder[key].filter((_, index) => index !== number)),
    {
      class: "quiet",
      "aria-label": `Remove ${entryLabel}`,
      "data-testid": `remove-${path}.${number}`,
    },
  );
  if (item.type === "object") {
    const entryGroup = form.createGroup(
      form,
      item,
      holder[key][number],
      `${path}.${number}`,
      entryLabel,
    );
    entryGroup.open = true;
    entryGroup.append(remove);
    return entryGroup;
  }
  const input = createEntryInput(form, item, holder[key], number);
  input.setAttribute("aria-label", entryLabel);
  input.setAttribute("data-testid", `field-${path}.${number}`);
  form.fields.set(`${path}.${number}`, { fault: null, input });
  return el("span", { class: "form-entry" }, input, remove);
}
