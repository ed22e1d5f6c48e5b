/** The reader's own map and settings: link, experiment, compiled module and command. */

import { applyChanges } from "../core/experiment_changes.js";

export const KINDS = ["food", "wall", "poison"];
export const MAX_SHAPES = 16;
// The sides of a map, and the grid of the edges of shapes.
export const MAP_SIZE = 640;
const GRID = 10;
// A thinner wall could be stepped over.
const MIN_SIDE = 20;
const FOOD_ITEMS = 50;
const POISON_ITEMS = 20;
const POISON_ENERGY = -1;
// The numbers of the form, with their limits.
export const NUMBERS = {
  rate: { path: "learning.rate", min: 0, max: 0.1, step: 0.005, factor: 1 },
  agents: { path: "population.size", min: 4, max: 40, step: 2, factor: 1 },
  mutation_rate: { path: "evolution.mutation_rate", min: 0, max: 30, step: 1, factor: 0.01 },
  seed: { path: null, min: 0, max: 999, step: 1, factor: 1 },
};

/**
 * @typedef {object} MapSettings
 * @property {number[][]} food rectangles: left, right, upper and lower edge
 * @property {number[][]} wall
 * @property {number[][]} poison
 * @property {boolean} learning
 * @property {number} rate
 * @property {number} agents
 * @property {number} mutation_rate in percent
 * @property {number} seed
 */

/** Return the map of the essay. */
export function createMapSettings({ world, learning, population, evolution }, seed) {
  return {
    food: world.food.map(({ x, y }) => [...x, ...y]),
    wall: [],
    poison: [],
    learning: true,
    rate: learning.rate,
    agents: population.size,
    mutation_rate: round(100 * evolution.mutation_rate),
    seed,
  };
}

/**
 * Return a rectangle between two points, on the grid and on the map.
 * @param {number[]} from x and y
 * @param {number[]} to x and y
 */
export function createShape([x1, y1], [x2, y2]) {
  return [...createSpan(x1, x2), ...createSpan(y1, y2)];
}

function createSpan(from, to) {
  const clamp = (value) => Math.min(MAP_SIZE, Math.max(0, Math.round(value / GRID) * GRID));
  const low = Math.min(clamp(Math.min(from, to)), MAP_SIZE - MIN_SIDE);
  return [low, Math.max(clamp(Math.max(from, to)), low + MIN_SIDE)];
}

/** Return whether no wall covers the start or a food region completely. */
export function isOpen(settings, { x, y, radius }) {
  const regions = [[x - radius, x + radius, y - radius, y + radius], ...settings.food];
  return settings.wall.every((wall) =>
    regions.every(
      ([left, right, upper, lower]) =>
        wall[0] > left || wall[1] < right || wall[2] > upper || wall[3] < lower,
    )
  );
}

/** Return the settings as text for the address. */
export function encodeMap(settings) {
  return btoa(JSON.stringify(settings)).replace(/\+/g, "-").replace(/\//g, "_").replace(/=/g, "");
}

/** Return the settings in a text, or null if it is damaged. */
export function decodeMap(text) {
  try {
    const settings = JSON.parse(atob(text.replace(/-/g, "+").replace(/_/g, "/")));
    return isValid(settings) ? settings : null;
  } catch {
    return null;
  }
}

function isValid(settings) {
  const isSpan = (low, high) =>
    Number.isFinite(low) && Number.isFinite(high) && low >= 0 && high - low >= MIN_SIDE;
  const isShape = ([left, right, upper, lower]) =>
    isSpan(left, right) && isSpan(upper, lower) && Math.max(right, lower) <= MAP_SIZE;
  return (
    KINDS.every((kind) => settings[kind].length <= MAX_SHAPES && settings[kind].every(isShape)) &&
    Object.entries(NUMBERS).every(
      ([name, { min, max }]) =>
        Number.isFinite(settings[name]) && settings[name] >= min && settings[name] <= max,
    ) &&
    typeof settings.learning === "boolean"
  );
}

/** Return the experiment of a map: the scene `map` with the settings. */
export function applyMap(experiment, settings) {
  const changed = applyChanges(experiment, Object.fromEntries(listNumbers(settings)));
  changed.world.food = settings.food.map(([left, right, upper, lower]) => ({
    x: [left, right],
    y: [upper, lower],
    count: FOOD_ITEMS,
    energy: 1,
  }));
  if (!settings.learning) changed.learning.rule = "none";
  return changed;
}

/** Return the settings of the numbers: pairs of a path and a value. */
function listNumbers(settings) {
  return Object.entries(NUMBERS)
    .filter(([, { path }]) => path)
    .map(([name, { path, factor }]) => [path, round(settings[name] * factor)]);
}

/** Return a compiled module with the walls and the poison of a map in its memory layout. */
export function adaptProgram(program, settings, { world, senses }) {
  const plan = structuredClone(program.plan);
  const { leaves } = plan.tuples.state;
  const edges = listEdges(settings.wall, world, senses.visual_radius);
  Object.assign(leaves["features.0.edges"], { values: edges.flat(), shape: [edges.length, 4] });
  leaves["features.0.count"].value = settings.wall.length;
  const poisonKind = plan.sizes["item kinds"] - 1;
  plan.tuples.setting.leaves.regions.added_rows = settings.poison.map((edgesOfPatch) => [
    ...edgesOfPatch,
    POISON_ITEMS,
    POISON_ENERGY,
    poisonKind,
  ]);
  const name = `${program.name} ${JSON.stringify([settings.wall, settings.poison])}`;
  return { ...program, name, plan };
}

/** Return the walls and their images that are visible from the map, as features/walls.py. */
function listEdges(walls, { width, height }, sight) {
  const sides = [-1, 0, 1];
  const shifts = sides.flatMap((x) => sides.map((y) => [x * width, y * height]));
  const images = walls.flatMap(([left, right, upper, lower]) =>
    shifts
      .filter(([x, y]) => x || y)
      .map(([x, y]) => [left + x, right + x, upper + y, lower + y])
  );
  const isVisible = ([left, right, upper, lower]) =>
    right >= -sight && left <= width + sight && lower >= -sight && upper <= height + sight;
  return [...walls, ...images.filter(isVisible)];
}

/** Return the appearance of a map: the template of the scene, with the drawn shapes. */
export function createMapAppearance(template, settings) {
  const findMark = (label) => template.marks.find((mark) => mark.label === label);
  const createMarks = (label, shapes) =>
    shapes.map(([left, right, upper, lower]) => ({
      ...findMark(label),
      x: left,
      y: upper,
      width: right - left,
      height: lower - upper,
    }));
  const [food] = template.item_kinds;
  const patch = template.item_kinds.find(({ name }) => name === "patch");
  return {
    ...template,
    item_kinds: [food, ...settings.poison.map(() => ({ ...patch, number: POISON_ITEMS }))],
    marks: [
      template.marks[0],
      ...createMarks("patch", settings.poison),
      findMark("start"),
      ...createMarks("wall", settings.wall),
    ],
  };
}

/** Return the command that repeats the map at full scale. */
export function formatCommand(settings) {
  const { learning, food, wall, poison } = settings;
  const preset = learning ? "evo+self-taught/A" : "evo/A";
  const regions = food.map(
    ([left, right, upper, lower]) =>
      `{x=[${left},${right}],y=[${upper},${lower}],count=${FOOD_ITEMS}}`,
  );
  const features = [wall.length && '"walls"', poison.length && '"patches"'].filter(Boolean);
  const patches = poison.map((edges) => [...edges, POISON_ITEMS, POISON_ENERGY]);
  const assignments = [
    `'world.food=[${regions}]'`,
    features.length && `'world.features=[${features}]'`,
    wall.length && `'world.walls.boxes=${JSON.stringify(wall)}'`,
    poison.length && `'world.patches.patches=${JSON.stringify(patches)}'`,
    ...listNumbers(settings)
      .filter(([path]) => learning || path !== NUMBERS.rate.path)
      .map(([path, value]) => `${path}=${value}`),
  ].filter(Boolean);
  return (
    `baldwinlab run ${preset} --runs 30 --seed ${settings.seed} --out my-map ` +
    `--set ${assignments.join(" ")}`
  );
}

/** Remove the error of a decimal factor. */
function round(value) {
  return Number(value.toPrecision(12));
}
