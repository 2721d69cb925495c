// All controllers at once: a card for each, with what it does at a glance.

import { button, h, setAttribute, setStyle, setText } from "./dom.js";
import { milliseconds, sentence, t } from "./words.js";

class Tile {
  constructor(host, open) {
    this.host = host;
    this.title = button("", open);
    this.phase = h("span", { class: "phase" });
    this.facts = h("p", { class: "note" });
    this.inputs = Array.from({ length: 8 }, (_, index) => h("li", {}, h("i", {}), `I${index + 1}`));
    this.motors = Array.from({ length: 4 }, (_, index) => {
      const bar = h("i", {});
      return { bar, element: h("li", {}, h("span", {}, `M${index + 1}`), h("div", { class: "gauge" }, bar)) };
    });
    this.driver = h("span", { class: "note" });
    this.element = h("section", { class: "tile" },
      h("header", {}, h("h2", {}, this.title), this.phase), this.facts,
      h("ul", { class: "lights" }, this.inputs), h("ul", { class: "gauges" }, this.motors.map((motor) => motor.element)), this.driver);
  }

  update() {
    const { state, shortTitle: title, address } = this.host;
    setText(this.title, title);
    const phase = state?.link.phase ?? "connecting";
    setAttribute(this.phase, "data-phase", phase);
    setText(this.phase, t(phase));
    if (!state) return setText(this.facts, address);
    const { link, areas, driver, you_drive } = state;
    const [{ alive, inputs, motors }] = areas;
    const facts = [title === address ? link.name : address, link.firmware, `${milliseconds(this.host.cycle)} ms`, ...areas.slice(1).filter((area) => area.alive).map((area) => area.name)];
    setText(this.facts, link.error ? sentence(link.error) : facts.filter(Boolean).join(" · "));
    setAttribute(this.facts, "data-error", Boolean(link.error));
    setAttribute(this.element, "data-absent", !alive);
    inputs.forEach((input, index) => setAttribute(this.inputs[index], "data-on", alive && input.digital && input.value !== 0));
    motors.forEach(({ duty: [forward, backwards] }, index) => {
      const { bar } = this.motors[index];
      setStyle(bar, "transform", `scaleX(${alive ? (forward - backwards) / 512 : 0})`);
      setAttribute(bar, "data-backwards", backwards > forward);
    });
    // Where another program drives, nobody on a page does.
    setText(this.driver, !this.host.driven ? "" : you_drive ? t("driving") : driver === null ? t("nobody") : t("somebody", { page: driver }));
  }
}

export class Overview {
  constructor(hosts, open) {
    this.tiles = hosts.map((host) => new Tile(host, () => open(host.id)));
    this.element = h("div", { class: "overview", role: "group", "aria-label": t("overview") }, this.tiles.map((tile) => tile.element));
  }

  update() {
    for (const tile of this.tiles) tile.update();
  }

  close() {}
}
