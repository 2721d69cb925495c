// C1 to C4: level, count, reset, and whether the input is inverted.

import { button, h, select, setAttribute, setText, setValue } from "./dom.js";
import { number, t } from "./words.js";

class Counter {
  /** Without `send` there is nothing to click. */
  constructor(index, names, send) {
    const terminal = `C${index + 1}`;
    const name = names.full(terminal);
    this.value = h("output", { class: "count", "aria-label": name, "data-plot": terminal });
    this.mode = send && select(t("modeOf", { name }), ["normal", "inverted"].map((mode) => [mode, t(mode)]),
      (mode) => send({ do: "counter_mode", counter: index, mode }));
    this.reset = send && button(t("resetShort"), () => send({ do: "reset_counter", counter: index }),
      { "aria-label": t("reset", { name }), class: "small" });
    this.element = h("li", { class: "counter" },
      h("span", { class: "name" }, h("i", { class: "socket", "aria-hidden": "true" }), terminal), [this.reset, names.small(terminal), this.value, this.mode]);
  }

  update({ mode, value, level, resetting }, alive) {
    setText(this.value, alive ? number(value) : "–");
    setAttribute(this.element, "data-on", alive && Boolean(level));
    if (!this.reset) return;
    setValue(this.mode, mode);
    setAttribute(this.reset, "data-busy", resetting);
  }
}

export class Counters {
  constructor(names, send) {
    this.counters = Array.from({ length: 4 }, (_, index) => new Counter(index, names, send));
    this.element = h("ul", { class: "counters", "aria-label": t("counters") }, this.counters.map((counter) => counter.element));
  }

  update(area) {
    area.counters.forEach((counter, index) => this.counters[index].update(counter, area.alive));
  }
}
