/** Validate an experiment against its JSON schema and rules between fields. */

import { lookUp } from "./engine.js";
import { resolve } from "../live/form_schema.js";
import { isTable } from "./program_table.js";

/** @type {Object<string, [(value: any, limit: any) => boolean, string]>} */
const LIMITS = {
  minimum: [(value, limit) => value >= limit, "greater than or equal to"],
  exclusiveMinimum: [(value, limit) => value > limit, "greater than"],
  maximum: [(value, limit) => value <= limit, "less than or equal to"],
  exclusiveMaximum: [(value, limit) => value < limit, "less than"],
};
const TYPES = {
  integer: [Number.isInteger, "a whole number"],
  number: [Number.isFinite, "a number"],
  boolean: [(value) => typeof value === "boolean", "true or false"],
  string: [(value) => typeof value === "string", "text"],
  array: [Array.isArray, "a list"],
  object: [isTable, "a table"],
};

/**
 * @param {Object<string, any>} schema of a table
 * @param {any} tree
 * @param {{path: string, than: string, share?: number, equal?: boolean, message: string}[]} rules
 *   one number is less than another
 * @returns {{path: string, message: string}[]}
 */
export function validateTree(schema, tree, rules) {
  const errors = [...findTableErrors({ schema }, schema, tree, "")];
  return errors.length ? errors : rules.flatMap((rule) => findRuleErrors(rule, tree));
}

function* findTableErrors(form, node, table, path) {
  const fields = node.properties ?? {};
  for (const [name, value] of Object.entries(table)) {
    const fieldPath = path ? `${path}.${name}` : name;
    if (name in fields) yield* findValueErrors(form, resolve(form, fields[name]), value, fieldPath);
    else
      yield {
        path: fieldPath,
        message: `${fieldPath}: there is no such field; there are: ` +
          `${Object.keys(fields).join(", ")}`,
      };
  }
}

function* findValueErrors(form, node, value, path) {
  if (value === null && node.empty) return;
  const error = (sentence) => ({
    path,
    message: `${path} = ${JSON.stringify(value)}: ${sentence}`,
  });
  if ("const" in node) {
    if (JSON.stringify(value) !== JSON.stringify(node.const))
      yield error(`input should be ${JSON.stringify(node.const)}, for which this page was made`);
    return;
  }
  if (node.enum) {
    if (!node.enum.includes(value))
      yield error(`input should be one of ${node.enum.map((option) => `'${option}'`).join(", ")}`);
    return;
  }
  const [isValid, kind] = TYPES[node.type] ?? [() => true];
  if (!isValid(value)) return yield error(`input should be ${kind}`);
  for (const [name, [isWithin, phrase]] of Object.entries(LIMITS)) {
    if (node[name] !== undefined && !isWithin(value, node[name]))
      yield error(`input should be ${phrase} ${node[name]}`);
  }
  if (node.type === "object") yield* findTableErrors(form, node, value, path);
  if (node.type === "array") yield* findListErrors(form, node, value, path, error);
  if (node.pattern && !new RegExp(node.pattern).test(value))
    yield error("this is no name: letters, digits and + _ . - / may be in it");
}

function* findListErrors(form, node, list, path, error) {
  if (node.maxItems !== undefined && list.length > node.maxItems)
    yield error(`at most ${node.maxItems} entries are allowed`);
  if (node.minItems !== undefined && list.length < node.minItems)
    yield error(`at least ${node.minItems} entries are needed`);
  for (const [number, value] of list.entries()) {
    const item = node.prefixItems?.[number] ?? node.items;
    if (item) yield* findValueErrors(form, resolve(form, item), value, `${path}.${number}`);
  }
}

/** Check a rule. A * in its path means all entries of a list. */
function findRuleErrors(rule, tree) {
  if (rule.path.includes("*")) {
    const entries = lookUp(tree, rule.path.split(".*")[0]) ?? [];
    const fillIndex = (text, number) => text.replace("*", String(number));
    return entries.flatMap((_, number) =>
      findRuleErrors(
        { ...rule, path: fillIndex(rule.path, number), than: fillIndex(rule.than, number) },
        tree,
      )
    );
  }
  const value = lookUp(tree, rule.path);
  const limit = (rule.share ?? 1) * lookUp(tree, rule.than);
  return value < limit || (rule.equal && value === limit)
    ? []
    : [{ path: rule.path, message: `${rule.path} = ${value}: ${rule.message}, ${limit}` }];
}
