/** The share menu: link, replay page, laboratory, picture, movie and freezer. */

import { formatAddress } from "../core/address.js";
import {
  createButton,
  createIcon,
  el,
  getJSON,
  isServerless,
  request,
  showMessage,
} from "../core/common.js";
import { saveFile } from "../core/downloads.js";
import { palette } from "../core/palette.js";
import { createLifetimeQuery } from "../core/sources.js";
import { openKeepDialog } from "./keep_dialog.js";

const SHARE_ICON = "M10 12V3M6.5 6L10 2.5 13.5 6M5 9H4v8h12V9h-1";
// Milliseconds between two requests for the progress of a movie.
const PROGRESS_INTERVAL = 400;
// CSS pixels below each world in a picture.
const CAPTION_HEIGHT = 30;
const KEEP_NOTE = "in the freezer, for other runs";

/**
 * @typedef {object} Panel a visible world
 * @property {import("../core/sources.js").Source} source
 * @property {HTMLCanvasElement} canvas
 * @property {number|null} agent the selected agent
 */

/**
 * Add a button with a menu to `root`.
 * @param {HTMLElement} root
 * @param {() => {panels: Panel[], step: number}} getState the visible state
 * @returns {{close: () => void}}
 */
export function mountShare(root, getState) {
  const menu = el("div", {
    popover: "auto",
    id: "share-menu",
    class: "share-menu",
    role: "dialog",
    "aria-label": "Share",
    "data-testid": "share-menu",
  });
  const button = createButton(
    [createIcon(SHARE_ICON), el("span", { class: "wide" }, "Share")],
    null,
    { popovertarget: "share-menu", "aria-label": "Share", "data-testid": "share" },
  );
  menu.addEventListener(
    "toggle",
    (event) => event.newState === "open" && menu.replaceChildren(...createEntries(getState)),
  );
  // Keys in the menu do not control the world.
  menu.addEventListener("keydown", (event) => event.stopPropagation());
  root.append(button, menu);
  return {
    close() {
      button.remove();
      menu.remove();
    },
  };
}

function createEntries(getState) {
  const fetcher = (kind, extra) => () =>
    fetchFile(kind, { ...listSources(getState()), ...extra() });
  const items = [
    createLinkRow(),
    createSaveEntry("Picture", ".png of this step", "share-png", () => drawPicture(getState())),
  ];
  if (isServerless()) return items;
  return [
    items[0],
    createSaveEntry(
      "Page that plays anywhere",
      ".html, needs no server",
      "share-html",
      fetcher("share", () => ({ step: getState().step })),
    ),
    createSaveEntry(
      "Live laboratory",
      ".html, simulates evolution in the browser",
      "share-laboratory",
      fetcher("laboratory", () => ({})),
    ),
    items[1],
    createSaveEntry(
      "Movie",
      ".mp4, the complete lifetime in 20 s",
      "share-mp4",
      createMovieRequest("mp4", getState),
    ),
    createSaveEntry(
      "Movie for slides and mail",
      ".gif, the same",
      "share-gif",
      createMovieRequest("gif", getState),
    ),
    ...createKeepEntries(getState()),
  ];
}

/** Return an entry for each visible population, and one for the selected agent. */
function createKeepEntries({ panels }) {
  const createKeep = (title, testid, keep) =>
    createEntry([el("span", {}, title), el("span", { class: "soft" }, KEEP_NOTE)], testid, keep);
  const populations = panels.map(({ source }, index) => {
    const title = panels.length > 1
      ? `Keep the population of ${source.condition}`
      : "Keep this population";
    return createKeep(title, `keep-${"ab"[index]}`, () => openKeepDialog(source));
  });
  const agents = panels
    .filter(({ agent }) => agent !== null)
    .map(({ source, agent }) =>
      createKeep(`Keep agent ${agent}`, "keep-agent", () => openKeepDialog(source, agent))
    );
  return [...populations, ...agents];
}

function createEntry(content, testid, act) {
  return createButton(content, act, { class: "share-entry", "data-testid": testid });
}

function listSources({ panels }) {
  return Object.fromEntries(
    panels.map(({ source }, index) => ["ab"[index], createLifetimeQuery(source)]),
  );
}

function createLinkRow() {
  const link = el("input", {
    readonly: true,
    "aria-label": "Link to this view",
    "data-testid": "share-link",
    value: formatAddress(),
    onfocus: () => link.select(),
  });
  const copy = async () => {
    link.value = formatAddress();
    try {
      await navigator.clipboard.writeText(link.value);
      showMessage(
        `The link is copied. It opens this view${isServerless() ? "" : " on this machine"}.`,
        "done",
      );
    } catch {
      // The browser does not allow copying. The user can copy the selected link.
      link.focus();
    }
  };
  return el(
    "div",
    { class: "share-link" },
    link,
    createButton("Copy link", copy, { class: "primary", "data-testid": "share-copy" }),
  );
}

/** Return an entry that creates and downloads a file, and shows the progress. */
function createSaveEntry(title, note, testid, make) {
  const hint = el("span", { class: "soft" }, note);
  const save = async () => {
    button.disabled = true;
    hint.textContent = "creating …";
    try {
      const { blob, name } = await make(
        (share) => (hint.textContent = `creating … ${Math.round(100 * share)} %`),
      );
      saveFile(blob, name);
      showMessage(`Saved as ${name}.`, "done");
    } catch (error) {
      showMessage(error.message, "error");
    }
    button.disabled = false;
    hint.textContent = note;
  };
  const button = createEntry([el("span", {}, title), hint], testid, save);
  return button;
}

/** Request a file from the server. */
async function fetchFile(kind, query) {
  const response = await request(`api/${kind}?${new URLSearchParams(query)}`, {});
  const name = decodeURIComponent(response.headers.get("Content-Disposition").split("''")[1]);
  return { blob: await response.blob(), name };
}

/** Request a movie, and report its progress. */
function createMovieRequest(format, getState) {
  return async (reportProgress) => {
    const ticket = Math.random().toString(36).slice(2);
    let done = false;
    const requestProgress = async () => {
      const { share } = await getJSON(`api/movie/progress?${new URLSearchParams({ ticket })}`);
      if (!done) reportProgress(share);
    };
    const timer = setInterval(requestProgress, PROGRESS_INTERVAL);
    try {
      return await fetchFile("movie", { ...listSources(getState()), format, ticket });
    } finally {
      done = true;
      clearInterval(timer);
    }
  };
}

/** Draw the visible worlds next to each other, with captions. */
async function drawPicture({ panels, step }) {
  // The same resolution as the worlds.
  const pixelRatio = Math.min(devicePixelRatio || 1, 2);
  const width = panels.reduce((sum, { canvas }) => sum + canvas.width, 0);
  const height = Math.max(...panels.map(({ canvas }) => canvas.height));
  const sheet = el("canvas", { width, height: height + CAPTION_HEIGHT * pixelRatio });
  const pen = sheet.getContext("2d");
  const style = getComputedStyle(document.body);
  pen.fillStyle = style.backgroundColor;
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.fillStyle = style.color;
  pen.font = `${13 * pixelRatio}px ${palette.font}`;
  pen.textBaseline = "middle";
  let left = 0;
  for (const { canvas, source } of panels) {
    pen.drawImage(canvas, left, 0);
    pen.fillText(
      `${formatTitle(source)}, step ${step}`,
      left + 12 * pixelRatio,
      height + (CAPTION_HEIGHT * pixelRatio) / 2,
      canvas.width - 24 * pixelRatio,
    );
    left += canvas.width;
  }
  const blob = await new Promise((resolve) => sheet.toBlob(resolve, "image/png"));
  const name = `${panels.map(({ source }) => formatTitle(source)).join(" and ")} step ${step}.png`;
  return { blob, name: name.replace(/[^\w+.]+/g, "-") };
}

/** Return a title such as: evo/A, run 3, generation 90. */
function formatTitle(/** @type {import("../core/sources.js").Source} */ source) {
  const { condition = "live", run, generation } = source;
  return `${condition}, run ${run}, generation ${generation}`;
}
