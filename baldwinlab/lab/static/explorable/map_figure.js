/** The reader's own experiment: an editor, settings, a run, a link, and the command. */

import { createButton, createField, el, formatNumber } from "../core/common.js";
import { EvolutionFigure } from "./evolution_figure.js";
import { formatText } from "./figure.js";
import { fillTemplate, findProgram } from "../engine/program_table.js";
import { MapEditor } from "./map_editor.js";
import {
  adaptProgram,
  applyMap,
  createMapAppearance,
  createMapSettings,
  decodeMap,
  encodeMap,
  formatCommand,
  isOpen,
  KINDS,
  NUMBERS,
} from "./map_settings.js";

const LINK = /^#map=(.+)$/;
const LOCAL_HOSTS = ["", "localhost", "127.0.0.1", "[::1]"];
// The upper end of the axis of the chart, in items.
const MAX_ITEMS = 80;

export class MapFigure extends EvolutionFigure {
  constructor(root, context) {
    super(root, context, MAX_ITEMS);
    this.wantsPlay = false;
    this.scene = this.data.scenes.map;
    this.texts = this.data.strings.editor;
    this.settings = createMapSettings(this.scene.experiment, this.data.seed);
    this.bar.append(createButton(this.texts.link, () => this.copyLink()));
    this.status = el("p", { role: "status" });
    this.command = el("pre", { tabindex: 0, "aria-label": this.texts.command });
    this.form = el("div", { class: "map-form" });
    this.editor = new MapEditor(this.map, this.texts, () => this.showMap());
    root.append(this.status, this.form, el("p", {}, this.texts.command), this.command);
    this.map.canvas.setAttribute("aria-label", this.texts.map);
    if (!this.source.isLive) this.status.textContent = this.texts.no_engine;
    addEventListener("hashchange", () => LINK.test(location.hash) && this.openLink());
    this.openLink();
  }

  /** Show the map of the address, if there is one. */
  openLink() {
    const link = LINK.exec(location.hash);
    const settings = link && decodeMap(link[1]);
    if (settings) {
      this.settings = settings;
      this.root.closest("section").scrollIntoView();
    }
    this.showForm();
    if (link && !settings) this.status.textContent = this.texts.damaged;
  }

  /** Create the form of the current settings. */
  showForm() {
    const changed = () => this.showMap();
    this.editor.edit(this.settings);
    const learning = el("input", { type: "checkbox", checked: this.settings.learning });
    learning.addEventListener("change", () => {
      this.settings.learning = learning.checked;
      changed();
    });
    const fields = Object.entries(NUMBERS).map(([name, { min, max, step }]) => {
      const value = this.settings[name];
      const input = el("input", { type: "number", min, max, step, value });
      input.addEventListener("change", () => {
        this.settings[name] = Math.min(max, Math.max(min, Number(input.value)));
        input.value = String(this.settings[name]);
        changed();
      });
      return createField(this.texts[name], input);
    });
    const learningLabel = el("label", {}, learning, this.texts.learning);
    const numbers = el("div", { class: "numbers" }, learningLabel, ...fields);
    this.form.replaceChildren(this.editor.root, numbers);
    this.showMap();
  }

  /** The reader draws on the complete map. */
  get region() {
    return null;
  }

  get curve() {
    return this.settings.learning ? "learning" : "alone";
  }

  get experiment() {
    return applyMap(this.scene.experiment, this.settings);
  }

  /** Stop the run, and show the map with its shapes. */
  showMap() {
    this.round += 1;
    this.isNew = true;
    this.wantsPlay = this.hasEnded = false;
    this.update();
    const { experiment, settings } = this;
    const appearance = createMapAppearance(this.scene.appearance, settings);
    this.map.showWorld(experiment.world, fillTemplate(appearance, experiment));
    const { start } = this.scene.experiment.world;
    const canRun = isOpen(this.settings, start);
    this.button.disabled = this.endButton.disabled = !canRun || !this.source.isLive;
    if (this.source.isLive) this.status.textContent = canRun ? "" : this.texts.covered;
    this.command.textContent = formatCommand(this.settings);
  }

  showButton() {
    super.showButton();
    if (this.texts && !this.wantsPlay) this.button.textContent = this.texts.run;
  }

  describeRun() {
    const { settings, runLabels } = this;
    return [
      [JSON.stringify(KINDS.map((kind) => settings[kind])), runLabels.map],
      ...Object.keys(NUMBERS).map((name) => [
        settings[name],
        formatText(runLabels[name], { value: formatNumber(settings[name]) }),
      ]),
    ];
  }

  startPopulation() {
    const { experiment, settings } = this;
    const program = findProgram(this.data.programs, experiment);
    const source = /** @type {import("./source.js").LiveSource} */ (this.source);
    return source.startExperiment(
      experiment,
      createMapAppearance(this.scene.appearance, settings),
      [0],
      settings.seed,
      adaptProgram(program, settings, experiment),
    );
  }

  /** Copy a link. The address changes without an event, so a run goes on. */
  async copyLink() {
    history.replaceState(null, "", `#map=${encodeMap(this.settings)}`);
    const { copied, copied_local: copiedLocal, copy_failed: failed } = this.texts;
    // The address of a file has no host.
    const isLocal = LOCAL_HOSTS.includes(location.hostname);
    try {
      await navigator.clipboard.writeText(location.href);
      this.status.textContent = isLocal ? copiedLocal : copied;
    } catch {
      this.status.textContent = isLocal ? `${failed} ${copiedLocal}` : failed;
    }
  }

  showStill() {}
}
