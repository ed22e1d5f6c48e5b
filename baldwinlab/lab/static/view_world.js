/** The World tab. */

import { el } from "./common.js";

export function mount(root) {
  root.append(el("p", {}, "World"));
  return { update() {}, unmount() {} };
}
