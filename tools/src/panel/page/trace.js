// The moving line of the last ten seconds.

import { h, watchSeen } from "./dom.js";

const SPAN_MS = 10000;
// 20 a second for ten seconds, and some more for states that come in quick succession.
const POINTS = 256;
// States come 20 times a second. When none came for this long, nobody knows what was between.
const GAP_MS = 1500;

/** The last values of one input, with their times. */
export class History {
  constructor() {
    this.times = new Float64Array(POINTS);
    this.values = new Float32Array(POINTS);
    this.length = 0;
    this.next = 0;
  }

  /** `null` is a time of which nothing is known. */
  push(at, value) {
    if (this.length && at - this.end > GAP_MS) this.add(this.end, NaN);
    this.add(at, value ?? NaN);
  }

  add(at, value) {
    this.times[this.next] = at;
    this.values[this.next] = value;
    this.next = (this.next + 1) % POINTS;
    this.length = Math.min(this.length + 1, POINTS);
  }

  clear() {
    this.length = 0;
  }

  /** The newest time. */
  get end() {
    return this.times[(this.next + POINTS - 1) % POINTS];
  }

  /** Calls `visit` with each time and value of the last ten seconds, oldest first. In a gap the value is NaN. */
  each(visit) {
    if (!this.length) return;
    const { end } = this;
    for (let back = this.length; back > 0; back--) {
      const index = (this.next + POINTS - back) % POINTS;
      if (end - this.times[index] <= SPAN_MS) visit(this.times[index] - end, this.values[index]);
    }
  }
}

/** The colours of the page for canvases, which can't use variables. Read again when the theme changes. */
const colours = {};

export function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["signal", "signal-soft", "grid"]) colours[name] = style.getPropertyValue(`--${name}`).trim();
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColours);

/** The line: a canvas that draws a history, scaled to what is in it. */
export class Trace {
  constructor(label) {
    this.element = watchSeen(h("canvas", { class: "trace", role: "img", "aria-label": label }));
    this.context = this.element.getContext("2d");
    this.width = 0;
    this.height = 0;
    this.sized = new ResizeObserver(([entry]) => this.resize(entry.contentRect));
    this.sized.observe(this.element);
  }

  resize({ width, height }) {
    const scale = Math.min(devicePixelRatio, 2);
    this.width = width;
    this.height = height;
    this.element.width = Math.round(width * scale);
    this.element.height = Math.round(height * scale);
    this.context.setTransform(scale, 0, 0, scale, 0, 0);
  }

  /** `least` is the smallest range that fills the height, so that noise looks like noise. */
  draw(history, { steps, least }) {
    const { context, width, height } = this;
    if (!this.element.isSeen || !width) return;
    context.clearRect(0, 0, width, height);
    let low = Infinity;
    let high = -Infinity;
    history.each((_, value) => {
      if (Number.isNaN(value)) return;
      low = Math.min(low, value);
      high = Math.max(high, value);
    });
    if (low > high) return;
    if (steps) [low, high] = [0, 1];
    const missing = Math.max(0, least - (high - low));
    // A quiet line lies in the middle, but 0 stays the floor.
    low = Math.max(Math.min(low, 0), low - missing / 2);
    high = Math.max(high, low + least);

    const x = (time) => width + (time / SPAN_MS) * width;
    const y = (value) => height - 3 - ((value - low) / (high - low)) * (height - 6);
    context.strokeStyle = colours.grid;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(0, height - 2.5);
    context.lineTo(width, height - 2.5);
    context.stroke();

    context.strokeStyle = colours.signal;
    context.fillStyle = colours["signal-soft"];
    context.lineWidth = 1.5;
    context.lineJoin = "round";
    // From one gap to the next.
    let first = null;
    let last = null;
    const finish = () => {
      if (first === null) return;
      context.stroke();
      context.lineTo(last.x, height - 2);
      context.lineTo(first, height - 2);
      context.fill();
      first = null;
    };
    history.each((time, value) => {
      if (Number.isNaN(value)) return finish();
      const point = { x: x(time), y: y(value) };
      if (first === null) {
        first = point.x;
        context.beginPath();
        context.moveTo(point.x, point.y);
      } else {
        if (steps) context.lineTo(point.x, last.y);
        context.lineTo(point.x, point.y);
      }
      last = point;
    });
    finish();
  }

  close() {
    this.sized.disconnect();
  }
}
