/** Read a JSON schema: references, defaults, and names of fields. */

export function resolve(form, node) {
  if (node.anyOf?.length === 2 && node.anyOf.some(({ type }) => type === "null")) {
    const { anyOf, ...rest } = node;
    return {
      ...resolve(
        form,
        anyOf.find(({ type }) => type !== "null"),
      ),
      ...rest,
      // The value of an empty input is null.
      empty: true,
    };
  }
  if (!node.$ref) return node;
  const { $ref, ...rest } = node;
  return { ...resolve(form, form.schema.$defs[$ref.split("/").pop()]), ...rest };
}

/**
 * Return the initial value of a new entry: an unused option, a copy of the last entry, or a
 * default.
 */
export function chooseNewEntry(form, item, entries) {
  if (item.enum) return item.enum.find((option) => !entries.includes(option)) ?? item.enum[0];
  return structuredClone(entries.at(-1)) ?? chooseDefault(form, item);
}

/** Return the default value of a field, or a value within its limits. */
function chooseDefault(form, node) {
  const resolved = resolve(form, node);
  if (resolved.default !== undefined) return structuredClone(resolved.default);
  if (resolved.type === "object")
    return Object.fromEntries(
      Object.entries(resolved.properties).map(([name, child]) => [
        name,
        chooseDefault(form, child),
      ]),
    );
  if (resolved.prefixItems) return resolved.prefixItems.map((_, number) => 100 * number);
  return resolved.minimum ?? 0;
}

/**
 * Return the name of a setting in words, and the rest of its description: "Width of the map, in
 * units of length." is the name "Width of the map", and the hint "in units of length.". Without a
 * description, the name is that of the key.
 * @param {string} key
 * @param {string} [description]
 */
export function describeSetting(key, description = "") {
  const [, name, hint] = /^([^.,:;(]*)[.,:;]?\s*(.*)$/s.exec(description);
  return { name: name.trim() || formatName(key), hint };
}

/** Return `FoodRegion` and `food_region` as "food region". */
export function formatName(name) {
  return name
    .replace(/_/g, " ")
    .replace(/([a-z])([A-Z])/g, "$1 $2")
    .toLowerCase();
}
