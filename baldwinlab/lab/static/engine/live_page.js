/**
 * An exported page: the Live run tab with an engine in the browser instead of a server (export.py).
 */

import { getCurrentView, navigate, readAddress, setCurrentView } from "../core/address.js";
import { showUnhandledErrors, useLocalServer } from "../core/common.js";
import { Guide, LIVE } from "../core/guide.js";
import { BrowserLab } from "./browser_lab.js";
import { createContrast, LearningContrast } from "../live/learning_contrast.js";
import { setFeedFactory } from "../live/live_feed.js";
import { mount } from "../live/view_live.js";

/**
 * Fill the page.
 * @param {HTMLElement} root is filled; the page also has #about, #actions and #messages
 * @param {import("./browser_lab.js").Laboratory} laboratory
 * @param {string} code of a worker
 */
export function openPage(root, laboratory, code) {
  const lab = new BrowserLab(laboratory, code);
  useLocalServer(lab);
  setFeedFactory((id) => lab.openFeed(id));
  Object.assign(globalThis, { baldwinlab: { simulate: (options) => lab.simulate(options) } });
  showUnhandledErrors();
  const target = readAddress(["live"], "live");
  setCurrentView({ ...target, state: { seed: laboratory.seed, ...target.state } });
  const guide = new Guide(document.getElementById("about"));
  const [{ name, topics }] = laboratory.presets;
  guide.setTexts(
    LIVE,
    topics.map(({ title, text }) => ({ title: `${name}: ${title.toLowerCase()}`, text })),
  );
  guide.applyState(getCurrentView().state);
  root.append(guide.root);
  const isPlain = !["id", "preset", "set"].some((name) => name in target.state);
  const experiments = isPlain && createContrast(lab, laboratory.presets[0].experiment);
  const opening = experiments && new LearningContrast(lab, experiments, laboratory.seed, guide);
  const view = mount(root, getCurrentView().state, navigate, guide, opening);
  addEventListener("hashchange", () => {
    setCurrentView(readAddress(["live"], "live"));
    guide.applyState(getCurrentView().state);
    view.update(getCurrentView().state);
  });
}
