/** A laboratory in one file: the lab's live runs, with an engine of the page's own in the place of a server (export.py). */

import { asked, follow, followed, navigate } from "./address.js";
import { useLocalServer, message } from "./common.js";
import { Guide } from "./guide.js";
import { BrowserLab } from "./browser_lab.js";
import { setFeedFactory } from "./live_feed.js";
import { LIVE } from "./topics.js";
import { mount } from "./view_live.js";

/**
 * @param {HTMLElement} root is filled; the page has elements for #about, #actions and #messages, too
 * @param {import("./browser_lab.js").Laboratory} laboratory
 * @param {string} code of a worker
 */
export function open(root, laboratory, code) {
  const here = new BrowserLab(laboratory, code);
  useLocalServer(here);
  setFeedFactory((id) => here.feed(id));
  window.baldwinlab = { simulate: (wanted) => here.simulate(wanted) };
  addEventListener("unhandledrejection", (event) => {
    event.preventDefault();
    if (event.reason?.name !== "AbortError")
      message(event.reason?.message ?? String(event.reason), "error");
  });
  const place = asked(["live"], "live");
  follow({ ...place, state: { seed: laboratory.seed, ...place.state } });
  const guide = new Guide(document.getElementById("about"));
  const [{ name, about }] = laboratory.presets;
  guide.begin("live", [
    ...LIVE,
    ...about.map(({ title, text }) => ({ title: `${name}: ${title.toLowerCase()}`, text })),
  ]);
  guide.follow(followed().state);
  root.append(guide.root);
  const view = mount(root, followed().state, navigate, guide);
  addEventListener("hashchange", () => {
    follow(asked(["live"], "live"));
    guide.follow(followed().state);
    view.update(followed().state);
  });
}
