// The values of a controller that the panel shows, of the last ten minutes.

import { Plotter } from "./plotter.js";
import { PlotWords } from "./plot_words.js";

const SPAN = 600;
// States come 20 times a second; some more come in quick succession.
const POINTS = 12288;
// When none came for this long, nobody knows what was between.
const GAP = 1.5;
const JUST_AFTER = 0.001;

const numbered = (letter, count, read) => Array.from({ length: count }, (_, index) => ({ terminal: `${letter}${index + 1}`, read: (area) => read(area, index) }));
const duty = ({ motors }, output) => motors[output >> 1].duty[output % 2];
const TERMINALS = [
  ...numbered("I", 8, ({ inputs }, index) => inputs[index].value),
  ...numbered("C", 4, ({ counters }, index) => counters[index].value),
  ...numbered("M", 4, (area, index) => duty(area, 2 * index) - duty(area, 2 * index + 1)),
  ...numbered("O", 8, duty),
];

/** What the values of a terminal are at present. */
function kindOf(terminal, area) {
  const letter = terminal[0];
  if (letter !== "I") return letter === "C" ? "pulses" : "duty";
  const input = area.inputs[Number(terminal[1]) - 1];
  return input.digital || !input.unit ? "digital" : input.unit;
}

const shortOf = (area, terminal) => (area ? `E${area}.${terminal}` : terminal);

/** The times of all states, and the values of each terminal then. It takes 1.2 MB for each area, and no more. */
class Live {
  /** `names` are what people call the terminals, by area. */
  constructor(names) {
    this.live = true;
    this.names = names;
    this.times = new Float64Array(POINTS);
    this.size = 0;
    this.next = 0;
    this.gaps = [];
    // By the number of an area.
    this.columns = new Map();
    this.state = null;
  }

  /** `isNew`: it brings what a response has measured. */
  push(state, isNew = true) {
    const time = state.at / 1000;
    if (time < this.end) this.size = 0;
    this.state = state;
    if (!isNew && this.size) return;
    state.areas.forEach((area, number) => this.meet(number, area));
    if (this.size && time - this.end > GAP) this.add(this.end + JUST_AFTER, null);
    this.add(time, state.areas);
  }

  /** An area has columns from when it is there first. */
  meet(number, area) {
    if (!this.columns.has(number)) {
      if (!area.alive) return;
      const all = TERMINALS.map((one) => [one.terminal, { ...one, kind: "", values: new Float32Array(POINTS).fill(NaN) }]);
      this.columns.set(number, new Map(all));
    }
    for (const column of this.columns.get(number).values()) {
      const kind = kindOf(column.terminal, area);
      // Other units: the old values say nothing.
      if (column.kind && kind !== column.kind) column.values.fill(NaN);
      column.kind = kind;
    }
  }

  add(time, areas) {
    this.times[this.next] = time;
    for (const [number, columns] of this.columns) {
      const area = areas?.[number];
      for (const column of columns.values()) column.values[this.next] = area?.alive ? column.read(area) : NaN;
    }
    this.next = (this.next + 1) % POINTS;
    this.size = Math.min(this.size + 1, POINTS);
  }

  place(index) {
    return (this.next - this.size + index + POINTS) % POINTS;
  }

  get end() {
    return this.size ? this.times[this.place(this.size - 1)] : 0;
  }

  get begin() {
    return this.size ? Math.max(this.times[this.place(0)], this.end - SPAN) : 0;
  }

  areas() {
    return [...this.columns.keys()].sort((one, other) => one - other);
  }

  /** Those that can be chosen: a motor or its two outputs, and what is chosen already. */
  terminals(area, chosen) {
    const motors = this.state?.areas[area]?.motors ?? [];
    const isThere = (terminal) => {
      const number = Number(terminal[1]) - 1;
      if (terminal[0] === "M") return !motors[number]?.outputs;
      return terminal[0] !== "O" || motors[number >> 1]?.outputs;
    };
    return [...(this.columns.get(area)?.keys() ?? [])]
      .map((terminal) => ({ terminal, id: shortOf(area, terminal) }))
      .filter(({ terminal, id }) => isThere(terminal) || chosen.includes(id))
      .map(({ terminal, id }) => ({ id, short: terminal, name: this.nameOf(area, terminal) }));
  }

  nameOf(area, terminal) {
    const prefix = area ? `E${area}.` : "";
    return prefix + this.names[area].full(terminal);
  }

  line(id) {
    const [, area = 0, terminal] = /^(?:E(\d)\.)?(\w+)$/.exec(id) ?? [];
    const column = this.columns.get(Number(area))?.get(terminal);
    if (!column) return null;
    return {
      id, short: id, name: this.nameOf(Number(area), terminal), kind: column.kind, jumps: true, size: this.size,
      time: (index) => this.times[this.place(index)], value: (index) => column.values[this.place(index)],
    };
  }

  /** All that is known now, for good. */
  frozen() {
    const copy = new Live(this.names);
    const columns = (of) => new Map([...of].map(([terminal, column]) => [terminal, { ...column, values: column.values.slice() }]));
    return Object.assign(copy, {
      times: this.times.slice(), size: this.size, next: this.next, state: this.state,
      columns: new Map([...this.columns].map(([area, of]) => [area, columns(of)])),
    });
  }
}

class PlotterOfValues extends Plotter {
  /** A click on the value of a terminal. A plotter that was just opened shows it; one that was open takes away what it shows. */
  clicked(area, terminal, wasOpen) {
    const id = shortOf(area, terminal);
    const isShown = this.chosen.some((one) => one.id === id);
    if (wasOpen || !isShown) this.toggle(id);
    if (!wasOpen) this.element.scrollIntoView({ block: "nearest" });
  }
}

// The page that loads this has its own modules.
window.txtPlotter = { Live, open: (live, language, options) => new PlotterOfValues(live, new PlotWords(language), options) };
