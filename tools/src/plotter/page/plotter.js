// The plotter: which terminals are seen, which time, and where the cursor is.

import { button, h, select, setAttribute, setText, watchSeen } from "./dom.js";
import { Chart, forgetColours, LEFT, RIGHT } from "./chart.js";
import { valueAt } from "./line.js";

const WINDOWS = [10, 30, 60, 120, 300, 600];
const SHORTEST = 0.05;
const COLOURS = 8;
/** How wide the handle of a slider is. */
const HANDLE = 20;
/** How many seconds before and after a moment are shown with it. */
const AROUND = 10;
/** How near to a mark the cursor shows what it is, in pixels. */
const NEAR = 5;
// How often a moving picture is drawn at most and at least, in ms.
const OFTEN = 100;
const SELDOM = 500;
const KINDS = ["digital", "mV", "Ω", "cm", "pulses", "duty"];

export class Plotter {
  /**
   * `source` has `begin`, `end`, `gaps`, `areas()`, `terminals(area, chosen)` and `line(id)`, and perhaps `dayTime(time)`
   * and `moments`, each with `at`, `number` and `what`. One that goes on is `live`, and has `frozen()`. `changed` gets the chosen terminals; `close` is there if the plotter can be closed.
   */
  constructor(source, words, { chosen = [], area = 0, changed = () => {}, close = null }) {
    this.source = source;
    this.words = words;
    this.changed = changed;
    this.chosen = chosen.map((id, index) => ({ id, colour: (index % COLOURS) + 1 }));
    this.area = area;
    this.window = 30;
    // What is seen while it stands still, and its data.
    this.still = source.live ? null : source;
    this.span = [source.begin, source.end];
    // Where the cursor is, in seconds since `zero`.
    this.cursor = null;
    this.charts = [];
    this.drawnAt = 0;
    this.element = watchSeen(h("div", { class: "plotter", role: "group", "aria-label": this.t("plotter") }, h("div", { class: "plot-top" }, this.bar(close)), this.chooser(), this.middle(), this.slider()));
    this.sized = new ResizeObserver(() => this.draw());
    this.sized.observe(this.place);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.recolour = () => {
      forgetColours();
      this.draw();
    };
    this.dark.addEventListener("change", this.recolour);
  }

  t(key, values) {
    return this.words.t(key, values);
  }

  get live() {
    return this.still === null;
  }

  get data() {
    return this.still ?? this.source;
  }

  get moments() {
    return this.source.moments ?? [];
  }

  /** What is seen, as times of the source. */
  get range() {
    return this.live ? [this.source.end - this.window, this.source.end] : this.span;
  }

  /** What times are counted from: the newest values, or the beginning of a recording. */
  get zero() {
    return this.source.live ? this.data.end : 0;
  }

  bar(close) {
    const sign = (text, word, clicked) => button(text, clicked, { class: "plot-sign", "aria-label": this.t(word), title: this.t(word) });
    const moves = [sign("◀", "back", () => this.shift(-1)), sign("▶", "on", () => this.shift(1)), sign("−", "longer", () => this.zoom(2)), sign("+", "shorter", () => this.zoom(0.5)), button(this.t("all"), () => this.all(), { class: "plot-all" })];
    if (this.source.live) {
      this.windows = select(this.t("window"), WINDOWS.map((seconds) => [seconds, this.words.span(seconds)]), (seconds) => this.setWindow(Number(seconds)));
      this.windows.value = this.window;
      this.pause = button("", () => (this.live ? this.freeze() : this.goOn()), { class: "plot-pause" });
    }
    const parts = [h("div", { class: "plot-bar" }, this.windows, this.pause, h("div", { class: "plot-moves" }, moves))];
    if (close) parts.push(button("×", close, { class: "quiet plot-close", "aria-label": this.t("close"), title: this.t("close") }));
    return parts;
  }

  /** The terminals to choose from. */
  chooser() {
    this.areas = h("span", {});
    this.chips = h("div", { class: "chips plot-chips", role: "group", "aria-label": this.t("terminals") });
    return h("div", { class: "plot-choose" }, this.areas, this.chips);
  }

  middle() {
    this.empty = h("p", { class: "note plot-empty" }, this.t(this.source.live ? "nothingLive" : "nothing"));
    this.place = h("div", { class: "plot-charts" });
    return h("div", {}, this.empty, this.place);
  }

  /** The cursor for fingers and keys; its text is for a screen reader, too. */
  slider() {
    this.cursorSlider = h("input", { type: "range", class: "plot-cursor", min: 0, max: 1000, value: 1000, "aria-label": this.t("cursor") });
    this.cursorSlider.addEventListener("input", () => {
      const [from, to] = this.range;
      this.cursor = from + ((to - from) * Number(this.cursorSlider.value)) / 1000 - this.zero;
      this.point();
    });
    this.time = h("output", { class: "plot-time" });
    this.below = h("div", { class: "plot-below" }, this.cursorSlider, this.time);
    // The middle of its handle is below the cursor's line.
    this.below.style.paddingLeft = `${LEFT - HANDLE / 2}px`;
    this.below.style.paddingRight = `${RIGHT - HANDLE / 2}px`;
    return this.below;
  }

  /** Adds a terminal, or takes it away. */
  toggle(id) {
    const known = this.chosen.findIndex((one) => one.id === id);
    if (known >= 0) this.chosen.splice(known, 1);
    else this.chosen.push({ id, colour: this.freeColour() });
    this.chosen.sort((one, other) => one.id.localeCompare(other.id, "en", { numeric: true }));
    this.changed(this.chosen.map((one) => one.id));
    this.draw();
  }

  freeColour() {
    const uses = (number) => this.chosen.filter((one) => one.colour === number).length;
    const numbers = Array.from({ length: COLOURS }, (_, index) => index + 1);
    return numbers.reduce((best, number) => (uses(number) < uses(best) ? number : best));
  }

  setWindow(seconds) {
    this.window = seconds;
    if (!this.live) this.setSpan(this.span[1] - seconds, this.span[1]);
    this.draw();
  }

  freeze() {
    this.span = this.range;
    this.still = this.source.frozen();
    this.draw();
  }

  goOn() {
    this.still = null;
    this.cursor = null;
    this.draw();
  }

  /** Shows this stretch, as far as there is something. */
  setSpan(from, to) {
    if (this.live) this.freeze();
    const { begin, end } = this.data;
    const most = Math.max(end - begin, this.source.live ? this.window : SHORTEST);
    const length = Math.min(Math.max(to - from, SHORTEST), most);
    const first = Math.min(Math.max((from + to - length) / 2, begin), end - length);
    this.span = [first, first + length];
    this.draw();
  }

  /** Shows a moment, with the cursor at it. */
  show(time) {
    this.setSpan(time - AROUND, time + AROUND);
    // uPlot takes the cursor away when it draws another stretch, which it does a moment later.
    queueMicrotask(() => {
      this.cursor = time - this.zero;
      this.point();
    });
  }

  shift(direction) {
    const [from, to] = this.range;
    const way = (direction * (to - from)) / 2;
    this.setSpan(from + way, to + way);
  }

  /** Makes what is seen longer or shorter, around the cursor if there is one. */
  zoom(factor) {
    if (this.live) {
      const next = WINDOWS.indexOf(this.window) + Math.sign(factor - 1);
      this.windows.value = WINDOWS[next] ?? this.window;
      return this.setWindow(WINDOWS[next] ?? this.window);
    }
    const [from, to] = this.range;
    const middle = this.cursor === null ? (from + to) / 2 : Math.min(Math.max(this.cursor + this.zero, from), to);
    this.setSpan(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  all() {
    if (!this.live) return this.setSpan(this.data.begin, this.data.end);
    this.windows.value = WINDOWS[WINDOWS.length - 1];
    this.setWindow(WINDOWS[WINDOWS.length - 1]);
  }

  /** Something new has come. A long time moves slowly, so it is drawn seldom. */
  update() {
    if (!this.live || this.element.isSeen === false) return;
    const now = performance.now();
    const pixel = (this.window * 1000) / Math.max(100, this.place.clientWidth);
    if (now - this.drawnAt < Math.min(Math.max(pixel, OFTEN), SELDOM)) return;
    this.draw();
  }

  draw() {
    this.drawnAt = performance.now();
    this.showChooser();
    const lines = this.chosen.map(({ id, colour }) => [this.data.line(id), colour]).filter(([line]) => line);
    this.makeCharts(lines);
    setAttribute(this.empty, "hidden", lines.length > 0);
    setAttribute(this.below, "hidden", !lines.length);
    if (this.pause) {
      setText(this.pause, this.t(this.live ? "pause" : "goOn"));
      setAttribute(this.pause, "data-paused", !this.live);
    }
    const width = Math.floor(this.place.clientWidth);
    if (!width) return;
    const gaps = this.data.gaps.map((gap) => gap.map((time) => time - this.zero));
    const marks = this.moments.map(({ at, number }) => ({ x: at - this.zero, number }));
    for (const { chart, kind } of this.charts) {
      chart.resize(width);
      chart.draw(lines.filter(([line]) => line.kind === kind).map(([line]) => line), gaps, marks, this.range, this.zero);
    }
    this.point();
  }

  /** One chart for each unit, made anew when other terminals are chosen. */
  makeCharts(lines) {
    const shape = lines.map(([line, colour]) => `${line.id} ${line.kind} ${colour}`).join();
    if (shape === this.shape) return;
    this.shape = shape;
    for (const { chart } of this.charts) chart.close();
    const kinds = [...new Set(lines.map(([line]) => line.kind))].sort((one, other) => KINDS.indexOf(one) - KINDS.indexOf(other));
    const on = {
      cursor: (x) => {
        this.cursor = x;
        this.point();
      },
      select: (from, to) => {
        this.cursor = null;
        this.setSpan(from + this.zero, to + this.zero);
      },
      all: () => this.all(),
    };
    const format = (time) => (this.source.dayTime ? `${this.format(time)}\n${this.source.dayTime(time + this.zero, this.words)}` : this.format(time));
    const place = (index) => ({ isFirst: index === 0 && this.moments.length > 0, isLast: index === kinds.length - 1, dayTimeLetters: this.source.dayTimeLetters?.(this.words) ?? 0 });
    this.charts = kinds.map((kind, index) => ({ kind, chart: new Chart(kind, lines.filter(([line]) => line.kind === kind), place(index), this.words, format, on) }));
    this.place.replaceChildren(...this.charts.map(({ chart }) => chart.element));
  }

  /** The values at the cursor, or the last ones that are seen. */
  point() {
    const [from, to] = this.range;
    const at = this.cursor === null ? to : this.cursor + this.zero;
    const texts = [];
    for (const { chart, kind } of this.charts) {
      const lines = this.chosen.map(({ id }) => this.data.line(id)).filter((line) => line?.kind === kind);
      const values = lines.map((line) => this.value(line, at));
      chart.point(values, this.cursor);
      lines.forEach((line, index) => texts.push(`${line.name} ${values[index]}`));
    }
    const time = [this.format(at - this.zero), this.source.dayTime?.(at, this.words), this.momentNear(at)].filter(Boolean).join(" · ");
    setText(this.time, time);
    setAttribute(this.cursorSlider, "aria-valuetext", this.t("ofCursor", { time, values: texts.join(", ") }));
    const share = String(Math.round(Math.min(Math.max((at - from) / (to - from), 0), 1) * 1000));
    if (this.cursorSlider.value !== share) this.cursorSlider.value = share;
    this.cursorSlider.style.setProperty("--fill", `${Number(share) / 10}%`);
  }

  /** What was unusual at the cursor. */
  momentNear(at) {
    const [from, to] = this.range;
    const near = ((to - from) / Math.max(100, this.place.clientWidth - LEFT - RIGHT)) * NEAR;
    const distance = (moment) => Math.abs(moment.at - at);
    const nearest = this.moments.reduce((best, moment) => (best && distance(best) <= distance(moment) ? best : moment), null);
    if (this.cursor === null || !nearest || distance(nearest) > near) return null;
    return nearest.number === null ? nearest.what : `${nearest.number}: ${nearest.what}`;
  }

  value(line, at) {
    const value = valueAt(line, at);
    if (Number.isNaN(value)) return "–";
    const unit = ["mV", "Ω", "cm"].includes(line.kind) ? ` ${line.kind}` : "";
    return `${this.words.number(value)}${unit}`;
  }

  /** A time since `zero`. */
  format(time) {
    const rounded = Math.round(time * 1000) / 1000;
    if (this.source.live && rounded === 0) return this.t("newest");
    const sign = rounded < 0 ? "−" : "";
    const seconds = Math.abs(rounded);
    if (seconds < 120 && this.source.end - this.source.begin <= 120) return this.t("seconds", { count: sign + this.words.number(seconds) });
    const [hours, minutes] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60];
    const rest = this.words.number(seconds % 60);
    const full = /^\d(\D|$)/.test(rest) ? `0${rest}` : rest;
    return hours ? `${sign}${hours}:${String(minutes).padStart(2, "0")}:${full}` : `${sign}${minutes}:${full}`;
  }

  showChooser() {
    const areas = this.source.areas();
    if (!areas.includes(this.area)) this.area = areas[0] ?? 0;
    const ids = this.chosen.map((one) => one.id);
    const offered = this.source.terminals(this.area, ids);
    const key = [areas, this.area, ...offered.map((one) => one.id)].join();
    if (key !== this.offered) this.makeChips(areas, offered);
    this.offered = key;
    for (const [id, chip] of this.chipOf) {
      const chosen = this.chosen.find((one) => one.id === id);
      setAttribute(chip, "aria-pressed", chosen ? "true" : "false");
      setAttribute(chip.firstChild, "class", chosen ? `plot-colour plot-colour-${chosen.colour}` : "plot-colour");
    }
  }

  makeChips(areas, offered) {
    this.chipOf = new Map(offered.map(({ id, short, name }) => [id, h("button", { type: "button", class: "chip", onclick: () => this.toggle(id), "aria-label": name, title: name }, h("i", { "aria-hidden": "true" }), short)]));
    this.chips.replaceChildren(...this.chipOf.values());
    const choice = select(this.t("area"), areas.map((area) => [area, area ? `E${area}` : this.t("master")]), (area) => {
      this.area = Number(area);
      this.draw();
    });
    choice.value = this.area;
    this.areas.replaceChildren(...(areas.length > 1 ? [choice] : []));
  }

  close() {
    this.sized.disconnect();
    this.dark.removeEventListener("change", this.recolour);
    for (const { chart } of this.charts) chart.close();
  }
}
