/** Differences between an experiment and its preset. */

import { showMessage } from "./common.js";

export function parseChanges(text) {
  if (!text) return {};
  try {
    return JSON.parse(text);
  } catch {
    showMessage(
      "The changes in this address cannot be read. The form shows the unchanged preset.",
      "error",
    );
    return {};
  }
}

/** Return the changed fields by path. A list is one field. */
export function findChanges(tree, base, path = "") {
  if (tree === null || typeof tree !== "object" || Array.isArray(tree)) {
    return JSON.stringify(tree) === JSON.stringify(base) ? {} : { [path]: tree };
  }
  return Object.assign(
    {},
    ...Object.entries(tree).map(([key, value]) =>
      findChanges(value, base?.[key], path ? `${path}.${key}` : key)
    ),
  );
}

/** Return a copy of a tree with changed fields. Unknown paths are ignored. */
export function applyChanges(base, changes) {
  const tree = structuredClone(base);
  for (const [path, value] of Object.entries(changes)) {
    const steps = path.split(".");
    const last = steps.pop();
    const holder = steps.reduce((node, step) => node?.[step], tree);
    if (holder && Object.hasOwn(holder, last)) holder[last] = value;
  }
  return tree;
}
