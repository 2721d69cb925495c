// The page of a recording.

import { button, h, setAttribute } from "./dom.js";
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
  constructor({ begin, end, started, zone, twice, gaps, lines }) {
    Object.assign(this, { live: false, begin, end, started, zone, twice, gaps, moments: [] });
    this.lines = new Map(lines.map((line) => [line.id, new Line(line)]));
    this.areaOf = new Map(lines.map(({ id, area }) => [id, area]));
  }

  areas() {
    return [...new Set(this.areaOf.values())].sort((one, other) => one - other);
  }

  terminals(area) {
    return [...this.lines.values()].filter(({ id }) => this.areaOf.get(id) === area).map(({ id, name }) => ({ id, short: id, name }));
  }

  /** The time of day of the machine, with the date if there are several days, and with the offset of one of two that are the same. */
  dayTime(time, { language }) {
    const day = this.end - this.begin < 86400 ? {} : { month: "2-digit", day: "2-digit" };
    const options = { ...day, hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23", timeZone: this.zone ?? undefined };
    const key = `${language} ${Object.keys(day)}`;
    if (this.formatKey !== key) this.formatter = new Intl.DateTimeFormat(language === "de" ? "de" : "en-GB", options);
    this.formatKey = key;
    const twice = this.twice.find(({ from, to }) => from <= time && time < to);
    return this.formatter.format(this.started + time * 1000) + (twice ? ` ${twice.offsets[time < twice.at ? 0 : 1]}` : "");
  }

  /** How many letters a time of day has at most. */
  dayTimeLetters(words) {
    const twice = this.twice.flatMap(({ from, at }) => [from, at]).filter((time) => this.begin <= time && time <= this.end);
    const times = [this.begin, this.end, ...twice];
    return Math.max(...times.map((time) => this.dayTime(time, words).length));
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

/** The list of unusual moments. */
function moments(words) {
  const rows = recording.moments.map(({ number, at, kind, what }) => {
    const clicked = () => {
      for (const other of rows) setAttribute(other, "aria-current", other === row ? "true" : null);
      plotter.show(at);
      plotter.element.scrollIntoView({ block: "nearest" });
    };
    const cells = [number ?? "–", `${plotter.format(at)} · ${recording.dayTime(at, words)}`, words.t(kind)].map((text) => h("span", {}, text));
    const row = h("button", { type: "button", class: "plot-moment", onclick: clicked }, cells, h("span", {}, what));
    return row;
  });
  const note = [words.t("momentsHint"), given.more_unusual ? words.t("moreMoments") : ""].filter(Boolean).join(" ");
  return h("section", { class: "card plot-unusual" }, h("h2", {}, words.t("unusual")), h("ol", { class: "plot-moments" }, rows.map((row) => h("li", {}, row))), h("p", { class: "note" }, note));
}

function show() {
  plotter?.close();
  const words = new PlotWords(language);
  document.documentElement.lang = language;
  recording.moments = given.unusual.map((moment) => ({ ...moment, what: moment.what[language] }));
  plotter = new Plotter(recording, words, { chosen, changed: (now) => (chosen = now) });
  const other = language === "de" ? "en" : "de";
  const change = button(words.t("language"), () => {
    language = other;
    show();
  }, { class: "quiet plot-language", "aria-label": words.t("languageLabel"), lang: other });
  const notes = [words.t("zoomHint"), given.gaps.length ? words.t("shaded") : "", given.unusual.length ? words.t("marked") : "", given.step ? words.t("thinned", { width: words.number(given.step) }) : ""];
  document.body.replaceChildren(
    h("header", { class: "top" }, h("h1", { class: "brand" }, given.title), change),
    h("main", {}, h("section", { class: "card" }, plotter.element, h("p", { class: "note" }, notes.filter(Boolean).join(" "))), given.unusual.length ? moments(words) : null));
  plotter.draw();
}

show();
