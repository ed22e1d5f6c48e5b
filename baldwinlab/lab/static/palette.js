/** The colours in force, by name, and the font of what is drawn. `baldwinlab/analysis/figures/palette.py` has them; the page has them as CSS. */

export const FONT = '"Inter", "Segoe UI", Roboto, "Helvetica Neue", Arial, system-ui, sans-serif';

let colors = {};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (colors = {}));

/** `palette.text` is what `var(--text)` is now. @type {Object<string, string>} */
export const palette = new Proxy(
  {},
  {
    get: (_, name) =>
      (colors[name] ??= getComputedStyle(document.documentElement)
        .getPropertyValue(`--${name}`)
        .trim()),
  },
);

/** A colour as a recording gives it: by name, or "#rrggbb". */
export function resolveColor(colour) {
  return colour.startsWith("#") ? colour : palette[colour];
}

/** The same in CSS, where it follows the reader's light or dark. */
export function cssColor(colour) {
  return colour.startsWith("#") ? colour : `var(--${colour})`;
}
