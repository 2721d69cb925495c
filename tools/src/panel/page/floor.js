// The workpieces of a simulated machine: belts, places, and what is there. A click puts a workpiece at a place, or takes
// it away.

import { button, card, h, setAttribute, setStyle, setText, svg } from "./dom.js";
import { t } from "./words.js";

const PIECES = ["white", "red", "blue", "container"];
/** A disc's diameter in mm. */
const DISC = 27;
/** So many pixels for each mm of a belt. */
const SCALE = 2.4;
/** A name of a place that is nearer to an end of its belt than so many mm does not go beyond it. */
const NEAR_END = 25;

/** A belt from above, in mm. */
class Belt {
  constructor({ motor, length, places }) {
    this.discs = svg("g", {});
    // Names in two rows, because places may be near each other.
    const anchor = (mm) => (mm < NEAR_END ? "start" : mm > length - NEAR_END ? "end" : "middle");
    const marks = places.map(({ name, mm }, index) => svg("g", {}, svg("rect", { class: "mark", x: mm - 1, y: -3, width: 2, height: 46 }),
      svg("text", { x: mm, y: index % 2 ? 62 : 52, "text-anchor": anchor(mm) }, name)));
    this.drawing = svg("svg", { class: "belt", viewBox: `-6 -6 ${length + 12} 72`, width: SCALE * (length + 12), role: "img", "aria-label": t("beltOf", { name: motor }) },
      svg("rect", { class: "bed", x: 0, y: 0, width: length, height: 40, rx: 8 }), marks, this.discs);
    this.element = h("li", {}, h("span", { class: "label" }, motor), this.drawing);
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
  constructor({ name }, click) {
    this.name = name;
    this.disc = h("i", { class: "piece" });
    this.element = h("li", {}, button("", () => click(this), { class: "place" }));
    this.element.firstChild.append(this.disc, h("span", {}, name));
  }

  update({ piece }) {
    this.piece = piece;
    setAttribute(this.disc, "data-piece", piece);
    const what = t(piece ? "pieceAt" : "nothingAt", { name: this.name, piece: piece ? t(piece) : "" });
    setAttribute(this.element.firstChild, "aria-label", what);
    setAttribute(this.element.firstChild, "title", what);
  }
}

export class Floor {
  constructor(host, state, send) {
    const { belts, places } = state.world.floor;
    this.chosen = PIECES[0];
    this.choices = PIECES.map((piece) => {
      const one = button("", () => this.choose(piece), { class: "chip" });
      one.append(h("i", { class: "piece", "data-piece": piece }), t(piece));
      return one;
    });
    const click = ({ name, piece }) => send(piece ? { do: "take_away", host: host.id, place: name } : { do: "put", host: host.id, place: name, piece: this.chosen });
    this.belts = belts.map((belt) => new Belt(belt));
    this.places = places.map((place) => new Place(place, click));
    this.carried = h("p", { class: "note" });
    this.mishap = h("p", { class: "note", role: "status" });
    this.controls = h("fieldset", { class: "floor" },
      h("div", { class: "chips", role: "group", "aria-label": t("pieces") }, this.choices),
      this.belts.length ? h("ul", { class: "belts" }, this.belts.map((belt) => belt.element)) : null,
      h("ul", { class: "places" }, this.places.map((place) => place.element)), this.carried, this.mishap);
    this.element = card("world", t("pieces"), h("p", { class: "hint" }, t("floorHint")), this.controls);
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

  update(state, may) {
    const { belts, places, carried, fallen, mishap } = state.world.floor;
    this.controls.disabled = !may;
    belts.forEach((belt, index) => this.belts[index].update(belt));
    places.forEach((place, index) => this.places[index].update(place));
    setText(this.carried, carried.map(({ piece, by }) => t("carriedBy", { piece: t(piece), by })).join(", "));
    setText(this.mishap, mishap ? `${mishap} ${fallen ? t("fallen", { count: fallen }) : ""}` : "");
  }
}
