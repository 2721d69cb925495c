// One controller as it lies on the table: inputs left, outputs right, and its housing with the display between them.

import { Commands } from "./commands.js";
import { Counters } from "./counters.js";
import { h, setAttribute, setDisabled, setText } from "./dom.js";
import { Inputs } from "./inputs.js";
import { Outputs } from "./outputs.js";
import { milliseconds, t } from "./words.js";

export class Board {
  /** `area` is 0 for the master, else the number of the extension. */
  constructor(host, area, send) {
    // Where another program drives there is nothing to click.
    const commands = host.driven ? (command) => send({ ...command, host: host.id, area }) : null;
    this.host = host;
    this.area = area;
    const names = host.names[area];
    this.inputs = new Inputs(host.histories[area], names, commands);
    this.counters = new Counters(names, commands);
    this.outputs = commands ? new Outputs(`${host.address} ${area}`, names, commands) : new Commands(names);
    this.title = h("strong", {});
    this.line = h("span", {});
    this.cycle = h("b", {});
    this.phase = h("span", { class: "phase" });
    this.display = h("div", { class: "display" }, this.title, this.line, h("span", { class: "pace" }, this.cycle, h("small", {}, " ms")), this.phase);
    const housing = h("div", { class: "housing" },
      h("div", { class: "badge" }, h("i", { "aria-hidden": "true" }), area ? t("extension") : "ROBOTICS TXT"), this.display, this.counters.element);
    this.element = h("fieldset", { class: "board", "data-shown": !commands, "data-area": area, "aria-label": area ? `${t("extension")} ${area}` : host.address },
      this.inputs.element, housing, this.outputs.element);
  }

  update(state, may) {
    const area = state.areas[this.area];
    if (!area) return;
    if (this.host.driven) setDisabled(this.element, !may || !area.alive);
    setAttribute(this.element, "data-absent", !area.alive);
    setText(this.title, this.area ? area.name : this.host.title);
    setText(this.line, this.area ? this.host.title : [state.link.firmware, this.host.simulated ? t("simulated") : ""].filter(Boolean).join(" · "));
    setText(this.cycle, milliseconds(this.host.cycle));
    const phase = area.alive || !this.area ? state.link.phase : "absent";
    setAttribute(this.phase, "data-phase", phase);
    setText(this.phase, phase === "absent" ? t("absent", { name: area.name }) : t(phase));
    this.inputs.update(area);
    this.counters.update(area);
    this.outputs.update(area);
  }

  close() {
    this.inputs.close();
  }
}
