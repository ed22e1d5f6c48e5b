/** What is wrong with an experiment, by its JSON schema and by rules between its fields, each in a sentence of its own. */

import { lookUp } from "./engine.js";
import { resolve } from "./form.js";

const LIMITS = {
  minimum: [(value, limit) => value >= limit, "greater than or equal to"],
  exclusiveMinimum: [(value, limit) => value > limit, "greater than"],
  maximum: [(value, limit) => value <= limit, "less than or equal to"],
  exclusiveMaximum: [(value, limit) => value < limit, "less than"],
};
const KINDS = {
  integer: [Number.isInteger, "a whole number"],
  number: [Number.isFinite, "a number"],
  boolean: [(value) => typeof value === "boolean", "true or false"],
  string: [(value) => typeof value === "string", "text"],
  array: [Array.isArray, "a list"],
  object: [
    (value) => value !== null && typeof value === "object" && !Array.isArray(value),
    "a table",
  ],
};

/**
 * @param {Object<string, any>} schema of a table
 * @param {any} tree
 * @param {{path: string, than: string, share?: number, equal?: boolean, says: string}[]} rules that one number is smaller than another
 * @returns {{path: string, message: string}[]}
 */
export function validateTree(schema, tree, rules) {
  const found = [...ofTable({ schema }, schema, tree, "")];
  return found.length ? found : rules.flatMap((rule) => broken(rule, tree));
}

function* ofTable(form, node, table, path) {
  const there = node.properties ?? {};
  for (const [name, value] of Object.entries(table)) {
    const at = path ? `${path}.${name}` : name;
    if (name in there) yield* ofValue(form, resolve(form, there[name]), value, at);
    else
      yield {
        path: at,
        message: `${at}: there is no such field; there are: ${Object.keys(there).join(", ")}`,
      };
  }
}

function* ofValue(form, node, value, path) {
  if (value === null && node.empty) return;
  const wrong = (sentence) => ({
    path,
    message: `${path} = ${JSON.stringify(value)}: ${sentence}`,
  });
  if ("const" in node) {
    if (JSON.stringify(value) !== JSON.stringify(node.const))
      yield wrong(`input should be ${JSON.stringify(node.const)}, for which this page was made`);
    return;
  }
  if (node.enum) {
    if (!node.enum.includes(value))
      yield wrong(`input should be one of ${node.enum.map((each) => `'${each}'`).join(", ")}`);
    return;
  }
  const [is, kind] = KINDS[node.type] ?? [() => true];
  if (!is(value)) return yield wrong(`input should be ${kind}`);
  for (const [name, [holds, words]] of Object.entries(LIMITS)) {
    if (node[name] !== undefined && !holds(value, node[name]))
      yield wrong(`input should be ${words} ${node[name]}`);
  }
  if (node.type === "object") yield* ofTable(form, node, value, path);
  if (node.type === "array") yield* ofList(form, node, value, path, wrong);
  if (node.pattern && !new RegExp(node.pattern).test(value))
    yield wrong("this is no name: letters, digits and + _ . - / may be in it");
}

function* ofList(form, node, list, path, wrong) {
  if (node.maxItems !== undefined && list.length > node.maxItems)
    yield wrong(`at most ${node.maxItems} entries are allowed`);
  if (node.minItems !== undefined && list.length < node.minItems)
    yield wrong(`at least ${node.minItems} entries are needed`);
  for (const [number, value] of list.entries()) {
    const item = node.prefixItems?.[number] ?? node.items;
    if (item) yield* ofValue(form, resolve(form, item), value, `${path}.${number}`);
  }
}

/** A rule with a * in it is one of every entry of a list. */
function broken(rule, tree) {
  if (rule.path.includes("*")) {
    const entries = lookUp(tree, rule.path.split(".*")[0]) ?? [];
    const one = (text, number) => text.replace("*", String(number));
    return entries.flatMap((_, number) =>
      broken({ ...rule, path: one(rule.path, number), than: one(rule.than, number) }, tree),
    );
  }
  const [value, limit] = [lookUp(tree, rule.path), (rule.share ?? 1) * lookUp(tree, rule.than)];
  return value < limit || (rule.equal && value === limit)
    ? []
    : [{ path: rule.path, message: `${rule.path} = ${value}: ${rule.says}, ${limit}` }];
}
