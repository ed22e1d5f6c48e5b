/** The colours of a world, told apart with every kind of colour vision (Okabe and Ito, 2008), and the font of what is drawn. */

export const FONT = '"Inter", "Segoe UI", Roboto, "Helvetica Neue", Arial, system-ui, sans-serif';

export const LIGHT = {
  ground: "#eceff3",
  map: "#ffffff",
  grid: "#eef1f4",
  edge: "#c3cbd5",
  region: "#009e73",
  text: "#17202a",
  soft: "#55616f",
  food: "#009e73",
  agent: "#0072b2",
  hungry: "#ffffff",
  outline: "#56616e",
  trail: "#0072b2",
  chosen: "#d55e00",
  sight: "#0072b2",
  lit: "#e69f00",
  flash: "#e69f00",
};
export const DARK = {
  ground: "#0b0f13",
  map: "#141b22",
  grid: "#1a222b",
  edge: "#36424f",
  region: "#22b78a",
  text: "#e7edf3",
  soft: "#9aa8b6",
  food: "#22b78a",
  agent: "#56b4e9",
  hungry: "#141b22",
  outline: "#8796a5",
  trail: "#56b4e9",
  chosen: "#ff8a3d",
  sight: "#56b4e9",
  lit: "#f0b429",
  flash: "#ffd166",
};
