// I1 to I8: mode, moving line, value and unit, each wired to its socket.

import { h, select, setAttribute, setText, setValue } from "./dom.js";
import { Trace } from "./trace.js";
import { INPUT_MODES, number, t } from "./words.js";

// The smallest range of a line, by mode, in the mode's unit.
const LEAST = { voltage: 500, resistance: 250, resistance15k: 750, ultrasonic: 10 };

class Input {
  /** Without `send` the mode is text. */
  constructor(index, names, history, send) {
    const terminal = `I${index + 1}`;
    const name = names.full(terminal);
    const called = names.small(terminal);
    this.history = history;
    this.mode = send ? this.choice(name, index, send) : h("span", { class: "mode" });
    this.trace = new Trace(t("lineOf", { name }));
    this.trace.element.dataset.plot = terminal;
    this.value = h("b", {});
    this.unit = h("small", {});
    this.element = h("li", { class: "input", "data-named": Boolean(called) },
      h("span", { class: "name" }, terminal), called, this.mode, this.trace.element,
      h("output", { class: "value", "aria-label": name, "data-plot": terminal }, this.value, this.unit), h("i", { class: "wire", "aria-hidden": "true" }));
  }

  choice(name, index, send) {
    return select(t("modeOf", { name }), INPUT_MODES.map((mode) => [mode, t(mode)]), (value) => {
      const [mode, digital] = value.split("/");
      send({ do: "uni", input: index, mode, digital: digital === "1" });
    });
  }

  update({ mode, digital, value, unit, overrun }, alive) {
    const chosen = `${mode}/${digital ? 1 : 0}`;
    if (this.mode.matches("select")) setValue(this.mode, chosen);
    else setText(this.mode, alive && mode ? t(chosen) : "");
    setText(this.value, !alive ? "–" : overrun ? t("overrun") : number(value));
    setText(this.unit, !alive || digital || overrun ? "" : unit);
    setAttribute(this.element, "data-on", alive && digital && value !== 0);
    setAttribute(this.element, "data-over", alive && overrun);
    setAttribute(this.element, "data-digital", digital);
    this.trace.draw(this.history, { steps: digital, least: digital ? 1 : LEAST[mode] ?? 1 });
  }
}

export class Inputs {
  constructor(histories, names, send) {
    this.inputs = histories.map((history, index) => new Input(index, names, history, send));
    this.element = h("ul", { class: "inputs", "aria-label": t("inputs") }, this.inputs.map((input) => input.element));
  }

  update(area) {
    area.inputs.forEach((input, index) => this.inputs[index].update(input, area.alive));
  }

  close() {
    for (const input of this.inputs) input.trace.close();
  }
}
