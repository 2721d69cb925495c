// Distance and synchronised commands of one motor, with their progress.

import { button, h, hold, select } from "./dom.js";
import { Progress } from "./progress.js";
import { t } from "./words.js";

const PULSES_MAX = 65535;

export class Distance {
  /** `name` is the motor's for people. `duty` gives the speed and direction that are set. */
  constructor(index, name, send, duty) {
    this.pulses = h("input", { type: "number", min: 1, max: PULSES_MAX, step: 1, value: 200, inputmode: "numeric", title: t("pulsesHint"), "aria-label": t("pulsesOf", { name }) });
    const others = [0, 1, 2, 3].filter((other) => other !== index);
    this.with = select(t("withOf", { name }), [["", t("alone")], ...others.flatMap((other) => ["together", "against"].map((way) => [`${other}/${way}`, t(way, { name: `M${other + 1}` })]))],
      (value) => {
        hold(this.with);
        // Two motors may turn together without end.
        this.pulses.min = value ? 0 : 1;
      });
    this.go = button(t("go"), () => {
      if (!this.pulses.reportValidity()) return;
      const [partner, way] = this.with.value.split("/");
      send({ do: "distance", motor: index, duty: duty(), pulses: Number(this.pulses.value), with: partner ? Number(partner) : null, opposite: way === "against" });
    }, { class: "small", "aria-label": t("goOf", { name }) });
    this.progress = new Progress(name);
    this.element = h("div", { class: "distance" }, this.pulses, h("span", { class: "unit" }, t("pulses")), this.with, this.go, this.progress.element);
  }

  update(motor) {
    this.progress.update(motor);
  }
}
