// All controllers at once: a card for each, with what it does at a glance.

import { button, h, setAttribute, setStyle, setText } from "./dom.js";
import { phaseWords } from "./state.js";
import { currentLanguage, milliseconds, sentence, t } from "./words.js";

class Tile {
  constructor(host, open) {
    this.host = host;
    this.title = button("", open);
    this.phase = h("span", { class: "phase" });
    this.facts = h("p", { class: "note" });
    const [names] = host.names;
    this.inputs = Array.from({ length: 8 }, (_, index) => `I${index + 1}`).map((name) => h("li", { title: names.title(name) }, h("i", {}), name));
    this.motors = Array.from({ length: 4 }, (_, index) => {
      const bar = h("i", {});
      const name = h("span", {}, `M${index + 1}`);
      return { bar, name, element: h("li", { title: names.title(`M${index + 1}`, `O${2 * index + 1}`, `O${2 * index + 2}`) }, name, h("div", { class: "gauge" }, bar)) };
    });
    this.driver = h("span", { class: "note" });
    this.lesson = h("p", { class: "note lesson-note" });
    this.element = h("section", { class: "tile" },
      h("header", {}, h("h2", {}, this.title), this.phase), this.facts,
      this.lesson, h("ul", { class: "lights" }, this.inputs), h("ul", { class: "gauges" }, this.motors.map((motor) => motor.element)), this.driver);
  }

  update() {
    const { state, shortTitle: title, address } = this.host;
    if (state && state === this.drawn && title === this.title.textContent) return;
    this.drawn = state;
    setText(this.title, title);
    const phase = state?.link.phase ?? "connecting";
    setAttribute(this.phase, "data-phase", phase);
    setText(this.phase, t(state ? phaseWords(state) : phase));
    if (!state) return setText(this.facts, address);
    const { link, areas, driver, you_drive } = state;
    const [{ alive, inputs, motors }] = areas;
    const facts = [title === address ? link.name : address, link.firmware, `${milliseconds(this.host.cycle)} ms`, ...areas.slice(1).filter((area) => area.alive).map((area) => area.name)];
    const error = this.host.error;
    setText(this.facts, error ? sentence(error) : facts.filter(Boolean).join(" · "));
    setAttribute(this.facts, "data-error", Boolean(error));
    setAttribute(this.element, "data-absent", !alive);
    inputs.forEach((input, index) => setAttribute(this.inputs[index], "data-on", alive && input.digital && input.value !== 0));
    motors.forEach(({ outputs, duty: [first, second] }, index) => {
      const { bar, name } = this.motors[index];
      // Two single outputs turn nothing: the stronger one is shown.
      const duty = outputs ? Math.max(first, second) : first - second;
      setText(name, outputs ? outputName(index, first, second) : `M${index + 1}`);
      setStyle(bar, "transform", `scaleX(${alive ? duty / 512 : 0})`);
      setAttribute(bar, "data-backwards", duty < 0);
    });
    this.showLesson(state.lesson);
    // Where another program drives, nobody on a page does.
    setText(this.driver, !this.host.driven ? "" : you_drive ? t("driving") : driver === null ? t("nobody") : t("somebody", { page: driver }));
  }

  /** How far the pupil is in a lesson. */
  showLesson(lesson) {
    setAttribute(this.lesson, "hidden", !lesson);
    setAttribute(this.element, "data-stuck", Boolean(lesson) && lesson.failed >= STUCK);
    if (!lesson) return;
    const parts = [t("inLesson", { number: lesson.lesson }), lesson.passed.length ? t("passed", { list: lesson.passed.join(", ") }) : t("nonePassed")];
    if (lesson.failed >= STUCK) parts.push(t("stuck", { count: lesson.failed }));
    if (lesson.wrong) parts.push(`${t("lastWrong", { ago: ago(lesson.wrong_ago) })}: ${lesson.wrong[currentLanguage()]}`);
    setText(this.lesson, parts.join(" · "));
  }
}

// So many verdicts without success, and somebody should come by.
const STUCK = 3;

/** Which of two single outputs are on, or both when none is. */
function outputName(motor, first, second) {
  const [one, other] = [`O${2 * motor + 1}`, `O${2 * motor + 2}`];
  if (Boolean(first) === Boolean(second)) return `${one} ${other}`;
  return first ? one : other;
}

/** A time ago in words. */
function ago(seconds) {
  if (seconds === null) return t("agoEarlier");
  return seconds < 60 ? t("agoNow") : t("agoMinutes", { count: Math.floor(seconds / 60) });
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
