/** The world of the latest generation of a live run; when its life is over, the one that is the latest then. */

import { el, getBinary, message } from "./common.js";
import { Player, SPEEDS } from "./player.js";
import { Lifetime, Recording } from "./recording.js";
import { mountShare } from "./share.js";
import { WorldView } from "./world.js";

export class LiveWorld {
  /** @param {{id: string, runs: number, speed: number, onSpeed: (speed: number) => void}} options */
  constructor({ id, runs, speed, onSpeed }) {
    this.id = id;
    this.run = 0;
    this.lived = 0;
    this.generation = null; // that is shown
    this.life = this.coming = this.kept = null;
    this.canvas = el("canvas", { "data-testid": "live-canvas", role: "img", "aria-label": "The world of the generation that is shown" });
    this.caption = el("p", { class: "number soft", "data-testid": "live-caption" }, "The first generation lives …");
    this.open = el("a", { class: "button quiet", hidden: true, "data-testid": "live-open-world" }, "Open in World"); // once the run is kept
    this.element = el("section", { class: "card live-world" },
      el("div", { class: "row" }, el("h2", {}, "The latest generation"), el("span", { class: "spread" }), this.runPicker(runs), this.speedPicker(speed, onSpeed)),
      el("div", { class: "live-map" }, this.canvas),
      el("div", { class: "row" }, this.caption, el("span", { class: "spread" }), this.open));
    this.player = new Player((time) => this.show(time));
    this.player.changed = () => this.next();
    this.player.setSpeed(speed);
    this.sized = new ResizeObserver(() => {
      this.view ??= new WorldView(this.canvas);
      this.view.resize();
      this.player.invalidate();
    });
    this.sized.observe(this.canvas);
  }

  runPicker(runs) {
    if (runs === 1) return null;
    const options = Array.from({ length: runs }, (_, run) => el("option", { value: run }, `run ${run}`));
    const picker = el("select", { "aria-label": "Which run's world is shown", "data-testid": "live-run" }, ...options);
    picker.addEventListener("change", () => {
      this.run = Number(picker.value);
      this.load(this.generation ?? 0);
    });
    return picker;
  }

  speedPicker(speed, onSpeed) {
    const options = SPEEDS.map((each) => el("option", { value: each }, `${each}×`));
    const picker = el("select", { "aria-label": "Speed of the world", "data-testid": "live-speed" }, ...options);
    picker.value = String(speed);
    picker.addEventListener("change", () => {
      this.player.setSpeed(picker.value);
      onSpeed(Number(picker.value));
    });
    return picker;
  }

  /** So many generations have lived. */
  offer(lived) {
    this.lived = lived;
    if (lived && this.generation === null && !this.coming) this.load(lived - 1);
  }

  /** Show a generation that has lived, once it is there. */
  load(generation) {
    this.coming?.close();
    const { id, run } = this;
    const query = { live: id, run, generation };
    const life = new Lifetime(
      async (part, signal) => new Recording(await getBinary(`/api/recording?${new URLSearchParams({ ...query, ...part })}`, signal)),
      () => (life === this.coming ? this.begin(life, query) : this.player.invalidate()),
      (fault) => message(fault.message, "error"),
    );
    this.coming = life;
  }

  begin(life, query) {
    this.coming = null;
    if (!life.length) return;
    this.life?.close();
    this.life = life;
    this.generation = query.generation;
    this.share ??= mountShare(document.getElementById("actions"), () => this.shared());
    this.link();
    this.player.last = life.steps - 1;
    this.player.time = 0;
    this.player.play();
    this.player.invalidate();
  }

  /** What the share menu takes along. */
  shared() {
    const source = String(new URLSearchParams({ live: this.id, run: this.run, generation: this.generation }));
    return { panels: [{ source, canvas: this.canvas }], step: Math.floor(this.player.time) };
  }

  /** The run is kept as a study: from there, the World tab shows more of what is seen here. */
  keptAs(study, condition) {
    this.kept = { study, condition };
    this.link();
  }

  link() {
    this.open.hidden = !this.kept || this.generation === null;
    this.open.href = `#/world?${new URLSearchParams({ ...this.kept, run: this.run, generation: this.generation })}`;
  }

  /** When a life is over: the latest one, or where there is no newer one, the same again. */
  next() {
    const { player } = this;
    if (player.playing || !this.life || player.time < player.last || this.coming) return;
    if (this.lived - 1 > this.generation) this.load(this.lived - 1);
    else player.play();
  }

  show(time) {
    const recording = this.life?.at(Math.floor(time));
    if (!this.view || (this.life && !recording)) return false;
    this.view.draw(recording ?? null, time);
    if (recording) this.tell(Math.floor(time), recording);
    return true;
  }

  tell(step, recording) {
    let eaten = 0;
    for (let agent = 0; agent < recording.agents; agent++) eaten += recording.eatenBefore(step + 1, agent);
    const run = this.run ? ` of run ${this.run}` : "";
    this.caption.textContent = `Generation ${this.generation}${run}, step ${step.toLocaleString("en")} of ${recording.steps.toLocaleString("en")}: ${eaten.toLocaleString("en")} items eaten`;
  }

  close() {
    this.share?.close();
    this.sized.disconnect();
    this.player.close();
    this.coming?.close();
    this.life?.close();
  }
}
