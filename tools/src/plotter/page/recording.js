// The page of a recording.

import { button, h } from "./dom.js";
import { Plotter } from "./plotter.js";
import { PlotWords } from "./plot_words.js";

/** A line as it is in the file: times are in ms, each as what is added to the one before. */
class Line {
  constructor({ id, name, kind, times, values }) {
    Object.assign(this, { id, short: id, name, kind, jumps: false, size: times.length });
    let sum = 0;
    this.times = Float64Array.from(times, (step) => (sum += step) / 1000);
    this.values = Float32Array.from(values, (value) => value ?? NaN);
  }

  time(index) {
    return this.times[index];
  }

  value(index) {
    return this.values[index];
  }
}

class Recording {
  constructor({ begin, end, gaps, lines }) {
    Object.assign(this, { live: false, begin, end, gaps });
    this.lines = new Map(lines.map((line) => [line.id, new Line(line)]));
    this.areaOf = new Map(lines.map(({ id, area }) => [id, area]));
  }

  areas() {
    return [...new Set(this.areaOf.values())].sort((one, other) => one - other);
  }

  terminals(area) {
    return [...this.lines.values()].filter(({ id }) => this.areaOf.get(id) === area).map(({ id, name }) => ({ id, short: id, name }));
  }

  line(id) {
    return this.lines.get(id) ?? null;
  }
}

const given = JSON.parse(document.getElementById("recording").textContent);
const recording = new Recording(given);
let { chosen } = given;
let language = navigator.language.toLowerCase().startsWith("de") ? "de" : "en";
let plotter = null;

function show() {
  plotter?.close();
  const words = new PlotWords(language);
  document.documentElement.lang = language;
  plotter = new Plotter(recording, words, { chosen, changed: (now) => (chosen = now) });
  const other = language === "de" ? "en" : "de";
  const change = button(words.t("language"), () => {
    language = other;
    show();
  }, { class: "quiet plot-language", "aria-label": words.t("languageLabel"), lang: other });
  const notes = [words.t("zoomHint"), given.gaps.length ? words.t("shaded") : "", given.step ? words.t("thinned", { width: words.number(given.step) }) : ""];
  document.body.replaceChildren(
    h("header", { class: "top" }, h("h1", { class: "brand" }, given.title), change),
    h("main", {}, h("section", { class: "card" }, plotter.element, h("p", { class: "note" }, notes.filter(Boolean).join(" ")))));
  plotter.draw();
}

show();
