/** The current colors by name and the font, from `baldwinlab/analysis` through CSS. */

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

/** Wait for the fonts, because a canvas is not drawn again when they arrive. */
export async function loadFonts() {
  await Promise.allSettled(
    [400, 600].map((weight) => document.fonts.load(`${weight} 12px ${palette.font}`)),
  );
}

/** Return the value of a color name, or "#rrggbb" unchanged. */
export function resolveColor(color) {
  return color.startsWith("#") ? color : palette[color];
}

/** Return a color for CSS, which follows the light or dark scheme. */
export function formatColor(color) {
  return color.startsWith("#") ? color : `var(--${color})`;
}
