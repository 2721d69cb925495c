// M1 to M4 where another program drives: what it has commanded, as text, and nothing to click.

import { h, setAttribute, setStyle, setText } from "./dom.js";
import { Progress } from "./progress.js";
import { number, t } from "./words.js";

const FULL = 512;

/** A duty as a bar from the middle, and in words. */
class Shown {
  constructor(terminal, names) {
    const called = names.small(terminal);
    this.words = h("output", { class: "command", "aria-label": names.full(terminal), "data-plot": terminal });
    this.bar = h("i", {});
    this.element = h("div", { class: "shown", "data-named": Boolean(called), "data-on": false }, h("span", { class: "name" }, terminal), called, this.words, h("div", { class: "gauge" }, this.bar));
  }

  /** `null` is a controller that is not there. */
  update(duty, words) {
    setText(this.words, duty === null ? "–" : words);
    setStyle(this.bar, "transform", `scaleX(${(duty ?? 0) / FULL})`);
    setAttribute(this.bar, "data-backwards", duty < 0);
    setAttribute(this.element, "data-on", duty ? (duty < 0 ? "backwards" : "forward") : false);
  }
}

/** A pair of outputs: one motor, or two single outputs. */
class Pair {
  constructor(index, names) {
    const name = `M${index + 1}`;
    this.motor = new Shown(name, names);
    this.outputs = [0, 1].map((half) => new Shown(`O${2 * index + half + 1}`, names));
    this.progress = new Progress(names.full(name));
    this.element = h("li", { class: "terminal" }, h("i", { class: "wire", "aria-hidden": "true" }),
      this.motor.element, this.progress.element, this.outputs.map((output) => output.element));
  }

  update(motor, alive) {
    const { outputs, duty, distance, ready } = motor;
    setAttribute(this.element, "data-kind", outputs ? "outputs" : "motor");
    for (const output of this.outputs) setAttribute(output.element, "hidden", !outputs);
    setAttribute(this.motor.element, "hidden", outputs);
    // A motor that has gone its distance stands, whatever its duty is.
    const turns = distance > 0 && ready ? 0 : duty[0] - duty[1];
    const way = turns < 0 ? "backwards" : "forward";
    this.motor.update(alive ? turns : null, turns ? t(way, { duty: number(Math.abs(turns)) }) : t("stands"));
    this.outputs.forEach((output, half) => output.update(alive ? duty[half] : null, duty[half] ? number(duty[half]) : t("off")));
    this.progress.update(alive && !outputs ? motor : { distance: 0 });
    const on = alive && (outputs ? duty.some((one) => one > 0) : turns !== 0);
    setAttribute(this.element, "data-on", on && (outputs ? "forward" : way));
  }
}

export class Commands {
  constructor(names) {
    this.pairs = Array.from({ length: 4 }, (_, index) => new Pair(index, names));
    this.element = h("ul", { class: "outputs", "aria-label": t("outputs") }, this.pairs.map((pair) => pair.element));
  }

  update(area) {
    area.motors.forEach((motor, index) => this.pairs[index].update(motor, area.alive));
  }
}
