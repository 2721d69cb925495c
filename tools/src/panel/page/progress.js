// How far a motor is on its distance.

import { h, setAttribute, setStyle, setText } from "./dom.js";
import { number, t } from "./words.js";

export class Progress {
  constructor(name) {
    this.bar = h("i", {});
    this.text = h("span", {});
    this.element = h("div", { class: "progress", role: "progressbar", "aria-label": t("progressOf", { name }), "aria-valuemin": 0, hidden: true }, this.bar, this.text);
  }

  update({ distance, done, ready, with: partner }) {
    setAttribute(this.element, "hidden", !distance);
    if (!distance) return;
    setStyle(this.bar, "transform", `scaleX(${Math.min(1, done / distance)})`);
    setAttribute(this.element, "aria-valuemax", distance);
    setAttribute(this.element, "aria-valuenow", done);
    setAttribute(this.element, "data-ready", ready);
    const together = partner === null ? "" : ` · ${t("together", { name: `M${partner + 1}` })}`;
    setText(this.text, `${number(done)} / ${number(distance)}${together}${ready ? " ✓" : ""}`);
  }
}
