/**
 * The current colors by name, from `baldwinlab/analysis/palette.py` through CSS, and the
 * font.
 */

export const FONT = '"Inter", "Segoe UI", Roboto, "Helvetica Neue", Arial, system-ui, sans-serif';

let colors = {};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (colors = {}));

/**
 * `palette.text` is the value of `var(--text)`.
 * @type {Object<string, string>}
 */
export const palette = new Proxy(
  {},
  {
    get: (
      _,
      /** @type {string} */ name,
    ) => (colors[name] ??= getComputedStyle(document.documentElement)
      .getPropertyValue(`--${name}`)
      .trim()),
  },
);

/** Return the value of a color name, or "#rrggbb" unchanged. */
export function resolveColor(color) {
  return color.startsWith("#") ? color : palette[color];
}

/** Return a color for CSS, which follows the light or dark scheme. */
export function formatColor(color) {
  return color.startsWith("#") ? color : `var(--${color})`;
}
