// The connection to the controller: what it is, how fast it answers, and what went wrong.

import { card, h, setAttribute, setStyle, setText, svg } from "./dom.js";
import { decimal, milliseconds, number, sentence, t } from "./words.js";

const BINS = 31;
const HEIGHT = 72;
const STEP = 10;

/** Bars on a logarithmic scale: one late cycle among a million is to be seen. */
class Histogram {
  constructor() {
    this.titles = Array.from({ length: BINS }, () => svg("title"));
    this.bars = this.titles.map((title, bin) =>
      svg("g", {}, title, svg("rect", { class: "space", x: bin * STEP, y: 0, width: STEP, height: HEIGHT }),
        svg("rect", { class: "bar", x: bin * STEP + 1, y: 0, width: STEP - 2, height: HEIGHT })));
    const marks = [0, 10, 20, 30].map((ms) =>
      svg("text", { x: ms * STEP + STEP / 2, y: HEIGHT + 14, "text-anchor": "middle" }, ms === 30 ? "30+" : ms));
    this.element = svg("svg", { class: "histogram", viewBox: `-4 0 ${BINS * STEP + 8} ${HEIGHT + 18}`, role: "img", "aria-label": t("histogram") },
      svg("line", { x1: 0, x2: BINS * STEP, y1: HEIGHT + 0.5, y2: HEIGHT + 0.5 }), this.bars, marks);
  }

  update(counts) {
    const highest = Math.log1p(Math.max(1, ...counts));
    this.bars.forEach((bar, index) => {
      const count = counts[index] ?? 0;
      setStyle(bar.lastChild, "transform", `scaleY(${Math.log1p(count) / highest})`);
      setText(this.titles[index], t("perBin", { ms: index === BINS - 1 ? "30+" : index, count: number(count) }));
    });
  }
}

export class Link {
  constructor(host) {
    this.host = host;
    this.facts = {};
    const fact = (name) => h("div", {}, h("dt", {}, t(name)), (this.facts[name] = h("dd", {})));
    this.histogram = new Histogram();
    this.error = h("p", { class: "note", role: "status" });
    this.element = card("link", t("link"),
      h("dl", {}, ["address", "firmware", "cycle", "cycles", ...(host.state.watched ? ["answer", "commands"] : []), "late", "gaps"].map(fact)),
      h("figure", {}, this.histogram.element, h("figcaption", {}, t("histogram"))), this.error);
  }

  update({ link, watched }) {
    setText(this.facts.address, this.host.address);
    setText(this.facts.firmware, link.firmware || "–");
    setText(this.facts.cycle, `${milliseconds(this.host.cycle)} ms`);
    // Before the first cycle there is nothing to count.
    for (const name of ["cycles", "late", "gaps"]) setText(this.facts[name], link.cycles ? number(link[name]) : "–");
    if (watched) {
      const { answer, commands } = watched;
      setText(this.facts.answer, answer ? t("answerTime", { median: decimal(answer.median), longest: decimal(answer.longest) }) : "–");
      setText(this.facts.commands, number(commands));
    }
    setAttribute(this.facts.late, "data-some", link.late > 0);
    setAttribute(this.facts.gaps, "data-some", link.gaps > 0);
    this.histogram.update(link.histogram);
    // The last error stays: when there were gaps, it says why.
    const last = this.host.lastError ? t("lastError", { text: sentence(this.host.lastError) }) : t("noError");
    const error = this.host.error;
    setText(this.error, error ? sentence(error) : last);
    setAttribute(this.error, "data-error", Boolean(error));
  }
}
