// The lines with one unit, drawn by uPlot, with their names and values above.

import { h, setText } from "./dom.js";
import { drawn } from "./line.js";

// Above a chart of 0 and 1, each line has its own lane.
const LANE = 1.5;
const LANE_HEIGHT = 30;
const HEIGHT = 190;
const TIMES = 34;
const DAY_TIMES = 16;
// Numbers of marks that are nearer than this would cover each other.
const NUMBERS = 16;
/** The room for the numbers on the left, and the one on the right, for half of the last time of day. */
export const LEFT = 56;
export const RIGHT = 32;
/** How many pixels are one step of a line. */
const STEP = 1.5;
// The smallest range that fills the height, so that noise looks like noise.
const LEAST = { mV: 200, Ω: 100, cm: 10, pulses: 10, duty: 100 };
// What goes from one value to the next at once.
const JUMPS = ["digital", "pulses", "duty"];

/** The colours of the page, which a canvas can't take from variables. */
const colours = new Map();

export function colour(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return colours.get(name);
}

export function forgetColours() {
  colours.clear();
}

/** The values with some room around them, but none below 0 without need. */
function range(low, high, least) {
  if (low === null) return [0, least];
  const missing = Math.max(0, least - (high - low)) / 2;
  const room = Math.max((high - low) * 0.06, missing);
  const floor = low >= 0 ? 0 : -Infinity;
  const bottom = Math.max(low - room, floor);
  return [bottom, Math.max(high + room, bottom + least)];
}

export class Chart {
  /**
   * `lines` are pairs of a line and the number of its colour. `on` has `cursor`, `select` and `all`; `format` writes times,
   * with a second line for times of day if there are any.
   */
  constructor(kind, lines, { isFirst, isLast, dayTimeLetters }, words, format, on) {
    this.kind = kind;
    this.isDigital = kind === "digital";
    this.steps = [];
    this.words = words;
    this.span = [0, 1];
    this.gaps = [];
    this.marks = [];
    this.isFirst = isFirst;
    // From one time to the next; a letter has about 7 px.
    this.between = 7 * dayTimeLetters + 8;
    this.times = isLast ? TIMES + (dayTimeLetters ? DAY_TIMES : 0) : 0;
    this.values = lines.map(() => h("b", {}));
    const names = lines.map(([line, number], index) => h("li", { class: "plot-line" }, h("i", { class: `plot-colour plot-colour-${number}`, "aria-hidden": "true" }), h("span", {}, line.name), this.values[index]));
    this.place = h("div", { class: "plot-place" });
    this.element = h("div", { class: "plot-chart" }, h("p", { class: "plot-unit" }, words.t(kind)), h("ul", { class: "plot-lines" }, names), this.place);
    this.height = (this.isDigital ? LANE_HEIGHT * lines.length + 14 : HEIGHT) + this.times;
    // The first is above the others.
    this.raised = lines.map((_, index) => (this.isDigital ? (lines.length - 1 - index) * LANE : 0));
    this.plot = new uPlot(this.options(lines, format, on), [[], ...lines.map(() => [])], this.place);
  }

  options(lines, format, on) {
    const grid = { stroke: () => colour("grid"), width: 1 };
    const font = "12px system-ui, sans-serif";
    const axis = { stroke: () => colour("muted"), grid, ticks: { ...grid, size: 4 }, font };
    const [least, top] = [LEAST[this.kind] ?? 1, LANE * lines.length];
    const lanes = { splits: () => this.raised.map((raised) => raised + 0.5), values: () => lines.map(([line]) => line.short), ticks: { show: false }, grid: { show: false } };
    const numbers = { values: (_, splits) => splits.map((value) => this.words.number(value)) };
    const times = this.times ? { size: this.times, space: Math.max(64, this.between), values: (_, splits) => splits.map(format) } : { size: 0, space: Math.max(56, this.between), values: (_, splits) => splits.map(() => "") };
    const paths = JUMPS.includes(this.kind) && lines[0][0].jumps ? uPlot.paths.stepped({ align: 1 }) : uPlot.paths.linear();
    return {
      width: 300,
      height: this.height,
      padding: [this.isFirst ? 14 : 8, RIGHT, this.times ? 0 : 6, 0],
      legend: { show: false },
      // Those of the other charts are set by `point`.
      cursor: { y: false, points: { show: false }, drag: { x: true, y: false, setScale: false, dist: 5 }, bind: { dblclick: () => () => on.all() } },
      scales: {
        x: { time: false, range: () => this.span },
        y: { range: (_, low, high) => (this.isDigital ? [-0.25, top - LANE + 1.25] : range(low, high, least)) },
      },
      axes: [{ ...axis, ...times }, { ...axis, size: LEFT, ...(this.isDigital ? lanes : numbers) }],
      series: [{}, ...lines.map(([, number]) => ({ stroke: () => colour(`plot-${number}`), width: 2, points: { show: false }, paths }))],
      hooks: {
        drawClear: [() => this.shade()],
        draw: [() => this.mark()],
        setCursor: [({ cursor }) => on.cursor(cursor.left < 0 ? null : this.plot.posToVal(cursor.left, "x"))],
        setSelect: [({ select }) => {
          if (!select.width) return;
          const ends = [select.left, select.left + select.width].map((left) => this.plot.posToVal(left, "x"));
          this.plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          on.select(...ends);
        }],
      },
    };
  }

  /** Where there was no connection. */
  shade() {
    const { ctx, bbox } = this.plot;
    ctx.save();
    ctx.fillStyle = colour("plot-gap");
    for (const ends of this.gaps) {
      const [left, right] = ends.map((x) => Math.min(Math.max(this.plot.valToPos(x, "x", true), bbox.left), bbox.left + bbox.width));
      if (right > left) ctx.fillRect(left, bbox.top, right - left, bbox.height);
    }
    ctx.restore();
  }

  /** What was unusual, with numbers above the first chart. */
  mark() {
    const { ctx, bbox } = this.plot;
    const ratio = bbox.width / this.plot.over.clientWidth;
    ctx.save();
    ctx.fillStyle = colour("plot-mark");
    ctx.font = `${11 * ratio}px system-ui, sans-serif`;
    ctx.textAlign = "center";
    let numbered = -Infinity;
    for (const { x, number } of this.marks) {
      const left = this.plot.valToPos(x, "x", true);
      if (left < bbox.left || left > bbox.left + bbox.width) continue;
      // On whole pixels, or it is wide and pale.
      ctx.fillRect(Math.round(left - ratio / 2), bbox.top, Math.max(1, Math.round(ratio)), bbox.height);
      if (!this.isFirst || number === null || left - numbered < NUMBERS * ratio) continue;
      ctx.fillText(number, left, bbox.top - 3 * ratio);
      numbered = left;
    }
    ctx.restore();
  }

  resize(width) {
    if (width !== this.width) this.plot.setSize({ width, height: this.height });
    this.width = width;
  }

  /** Draws the lines from one time to another, as seconds since `zero`. */
  draw(lines, gaps, marks, [from, to], zero) {
    const step = ((to - from) / Math.max(100, this.width - LEFT - RIGHT)) * STEP;
    const tables = lines.map((line, index) => {
      const [times, values] = drawn(line, from, to, step);
      const raised = this.raised[index];
      return [times.map((time) => time - zero), values.map((value) => (value === null ? null : value + raised))];
    });
    this.span = [from - zero, to - zero];
    this.gaps = gaps;
    this.marks = marks;
    this.plot.setData(uPlot.join(tables));
  }

  /** Shows the values of all lines, and where the cursor is. */
  point(values, x) {
    values.forEach((value, index) => setText(this.values[index], value));
    const left = x === null ? -10 : this.plot.valToPos(x, "x");
    if (Math.abs(left - this.plot.cursor.left) > 0.5) this.plot.setCursor({ left, top: 1 }, false);
  }

  close() {
    this.plot.destroy();
  }
}
