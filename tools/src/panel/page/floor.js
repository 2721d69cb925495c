// The workpieces of a simulated machine, in its drawing and in lists of the belts and places that are not drawn. A click
// puts a workpiece at a place, or takes it away.

import { button, card, h, setAttribute, setStyle, setText, svg } from "./dom.js";
import { Drawing } from "./drawing.js";
import { mishapSentence, placeName, t } from "./words.js";

const PIECES = ["white", "red", "blue", "container"];
/** A disc's diameter in mm. */
const DISC = 27;
/** So many pixels for each mm of a belt. */
const SCALE = 2.4;
/** The size of a place's name in pixels, however small the belt is drawn, and the free space beside it. */
const NAME = 12;
const APART = 8;
const HEIGHT = 40;

/** A belt from above, in mm. */
class Belt {
  constructor({ motor, length, places }, names) {
    this.discs = svg("g", {});
    this.length = length;
    this.names = places.map(({ name, mm }) => ({ mm, text: svg("text", {}, placeName(name)) }));
    const marks = places.map(({ mm }) => svg("rect", { class: "mark", x: mm - 1, y: -3, width: 2, height: HEIGHT + 6 }));
    this.drawing = svg("svg", { class: "belt", viewBox: this.box(0), width: SCALE * (length + 12), role: "img", "aria-label": t("beltOf", { name: names.full(motor) }) },
      svg("rect", { class: "bed", x: 0, y: 0, width: length, height: HEIGHT, rx: 8 }), marks, this.names.map(({ text }) => text), this.discs);
    this.element = h("li", {}, h("span", { class: "label", title: names.title(motor) }, motor), this.drawing);
    this.sized = new ResizeObserver(([entry]) => this.arrange(entry.contentRect.width));
    this.sized.observe(this.drawing);
  }

  /** What is drawn, with so many mm below for the names. */
  box(below) {
    return `-6 -6 ${this.length + 12} ${HEIGHT + 15 + below}`;
  }

  /** Writes the names below the belt, in as many rows as they need. */
  arrange(width) {
    if (!width) return;
    const mm = (this.length + 12) / width;
    const size = NAME * mm;
    // Where each row is free.
    const free = [];
    for (const { mm: place, text } of this.names) {
      setStyle(text, "font-size", `${size}px`);
      const wide = text.getComputedTextLength();
      const x = Math.max(0, Math.min(place - wide / 2, this.length - wide));
      const row = [...free, -Infinity].findIndex((end) => end <= x);
      free[row] = x + wide + APART * mm;
      setAttribute(text, "x", x);
      setAttribute(text, "y", HEIGHT + 6 + size * (1 + 1.2 * row));
    }
    setAttribute(this.drawing, "viewBox", this.box(size * 1.2 * free.length));
  }

  close() {
    this.sized.disconnect();
  }

  update({ pieces }) {
    while (this.discs.childElementCount > pieces.length) this.discs.lastChild.remove();
    while (this.discs.childElementCount < pieces.length) this.discs.append(svg("circle", { class: "piece", cy: 20, r: DISC / 2 }));
    pieces.forEach(({ piece, mm }, index) => {
      const disc = this.discs.children[index];
      setAttribute(disc, "data-piece", piece);
      setStyle(disc, "transform", `translateX(${mm.toFixed(1)}px)`);
    });
  }
}

class Place {
  /** Without `click` it only shows. */
  constructor({ name, at, other }, click) {
    this.name = name;
    this.disc = h("i", { class: "piece" });
    this.shown = click && !other ? button("", () => click(this), { class: "place" }) : h("span", { class: "place", role: "img" });
    if (!at) this.shown.append(this.disc, h("span", {}, placeName(name)));
    this.element = at ? this.shown : h("li", {}, this.shown);
  }

  update({ piece, content }) {
    this.piece = piece;
    setAttribute(this.disc, "data-piece", piece);
    const named = piece && (content ? t("filled", { piece: t(piece), content: t(content) }) : t(piece));
    const what = t(piece ? "pieceAt" : "nothingAt", { name: placeName(this.name), piece: named });
    setAttribute(this.shown, "aria-label", what);
    setAttribute(this.shown, "title", what);
  }
}

export class Floor {
  constructor(host, state, send) {
    const { belts, places, drawing } = state.world.floor;
    this.chosen = PIECES[0];
    this.choices = PIECES.map((piece) => {
      const one = button("", () => this.choose(piece), { class: "chip" });
      one.append(h("i", { class: "piece", "data-piece": piece }), t(piece));
      return one;
    });
    const click = ({ name, piece }) => send(piece ? { do: "take_away", host: host.id, place: name } : { do: "put", host: host.id, place: name, piece: this.chosen });
    this.belts = belts.map((belt) => (belt.line ? null : new Belt(belt, host.names[0])));
    this.places = places.map((place) => new Place(place, host.hands ? click : null));
    const [drawn, listed] = [true, false].map((is) => this.places.filter((_, index) => Boolean(places[index].at) === is).map(({ element }) => element));
    this.drawing = drawing && new Drawing(state.world.floor, drawn);
    const listedBelts = this.belts.filter(Boolean).map(({ element }) => element);
    this.carried = h("p", { class: "note" });
    this.mishap = h("p", { class: "note", role: "status" });
    this.controls = h("fieldset", { class: "floor" },
      host.hands ? h("div", { class: "chips", role: "group", "aria-label": t("pieces") }, this.choices) : null,
      this.drawing?.element,
      listedBelts.length ? h("ul", { class: "belts" }, listedBelts) : null,
      listed.length ? h("ul", { class: "places" }, listed) : null, this.carried, this.mishap);
    this.element = card("world", t("pieces"), host.hands ? h("p", { class: "hint" }, t("floorHint")) : null, this.controls);
    this.choose(this.chosen);
  }

  /** Its parts change only when another world is loaded. */
  static shape(state) {
    const floor = state.world?.floor;
    return floor ? JSON.stringify([floor.belts.map(({ motor }) => motor), floor.places.map(({ name }) => name)]) : "";
  }

  choose(piece) {
    this.chosen = piece;
    this.choices.forEach((choice, index) => setAttribute(choice, "aria-pressed", PIECES[index] === piece ? "true" : "false"));
  }

  close() {
    for (const part of [...this.belts, this.drawing]) part?.close();
  }

  update(state, may) {
    const { belts, places, carried, fallen, mishap } = state.world.floor;
    this.controls.disabled = !may;
    this.drawing?.update(state.world.floor);
    belts.forEach((belt, index) => this.belts[index]?.update(belt));
    places.forEach((place, index) => this.places[index].update(place));
    setText(this.carried, carried.map(({ piece, by }) => t("carriedBy", { piece: t(piece), by: placeName(by) })).join(", "));
    setText(this.mishap, mishap ? `${mishapSentence(mishap)} ${fallen ? t("fallen", { count: fallen }) : ""}` : "");
  }
}
