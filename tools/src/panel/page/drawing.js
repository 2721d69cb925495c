// A simulated machine as its world's file places it, in mm: belts, slides, turntables, grippers, ejectors. While it moves
// only transforms and attributes change, so the browser arranges nothing anew.

import { h, setAttribute, setStyle, svg } from "./dom.js";
import { GEAR } from "./machine.js";
import { placeName, t } from "./words.js";

/** A disc's diameter, and how wide belts are, in mm. */
const DISC = 27;
const BELT = 36;
/** The most pixels for each mm, and for all of it from top to bottom. */
const SCALE = 2.4;
const TALL = 460;
/** The size of a name in pixels, however small the drawing is. */
const NAME = 12;
/** A name that is further away from its place, in mm, is joined to it. */
const NEAR = 26;
/** A height is drawn so long, in mm. */
const HEIGHT = 60;

const move = ([x, y]) => `translate(${x}px, ${y}px)`;
const distance = ([x1, y1], [x2, y2]) => Math.hypot(x2 - x1, y2 - y1);
const direction = ([x1, y1], [x2, y2]) => (Math.atan2(y2 - y1, x2 - x1) * 180) / Math.PI;
const between = ([x1, y1], [x2, y2], part) => [x1 + part * (x2 - x1), y1 + part * (y2 - y1)];
const above = (from, to) => [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2 - 12];
const around = ([x, y], r) => [x - r, y - r, x + r, y + r];
const union = (a, b) => [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[2], b[2]), Math.max(a[3], b[3])];
const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

/** The middle of the widest gap between these numbers. */
function widestGap(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  const gaps = sorted.slice(1).map((end, index) => [end - sorted[index], (end + sorted[index]) / 2]);
  return gaps.reduce((widest, gap) => (gap[0] > widest[0] ? gap : widest))[1];
}

/** A group whose x axis goes from one point to another. */
function along(from, to, ...children) {
  return svg("g", { transform: `translate(${from}) rotate(${direction(from, to)})` }, children);
}

/** A disc, or a container with what is in it. */
class Thing {
  constructor() {
    this.box = svg("rect", { class: "piece", x: -DISC / 2, y: -DISC / 2, width: DISC, height: DISC, rx: 4 });
    this.disc = svg("circle", { class: "piece", r: DISC / 2 });
    this.element = svg("g", { class: "thing" }, this.box, this.disc);
  }

  update({ piece, content }) {
    const isBox = piece === "container";
    setAttribute(this.box, "data-piece", isBox && piece);
    setAttribute(this.disc, "data-piece", (isBox ? content : piece) ?? false);
    setStyle(this.disc, "transform", isBox ? "scale(0.72)" : "none");
  }
}

// Each part has its base, what moves on it, the rectangles that nothing else may cover, and names with their middle.

class BeltPart {
  constructor({ motor, length, places, line: { from, to } }) {
    this.scale = distance(from, to) / length;
    this.base = along(from, to, svg("rect", { class: "bed", x: -BELT / 2, y: -BELT / 2, width: distance(from, to) + BELT, height: BELT, rx: 10 }));
    this.moving = along(from, to);
    this.things = [];
    this.covered = [union(around(from, BELT / 2), around(to, BELT / 2))];
    this.names = [[motor, between(from, to, widestGap([0, length, ...places.map(({ mm }) => mm)]) / length)]];
  }

  update({ pieces }) {
    while (this.things.length > pieces.length) this.things.pop().element.remove();
    while (this.things.length < pieces.length) {
      this.things.push(new Thing());
      this.moving.append(this.things.at(-1).element);
    }
    pieces.forEach((piece, index) => {
      this.things[index].update(piece);
      setStyle(this.things[index].element, "transform", `translateX(${(piece.mm * this.scale).toFixed(1)}px)`);
    });
  }
}

/** A seat that moves along a line, or around a point. */
class SlidePart {
  constructor({ motor, line: { from, to, turn } }) {
    const radius = distance(from, to);
    this.way = (part) => (turn ? `rotate(${(part * turn).toFixed(1)}deg)` : `translateX(${(part * radius).toFixed(1)}px)`);
    this.thing = new Thing();
    const seat = svg("g", turn ? { transform: `translate(${radius})` } : {}, svg("circle", { class: "seat", r: DISC / 2 + 3 }), this.thing.element);
    this.carriage = svg("g", {}, turn ? svg("rect", { class: "rail-bed", y: -3, width: radius, height: 6 }) : null, seat);
    this.base = turn ? svg("circle", { class: "bed", cx: from[0], cy: from[1], r: radius + DISC / 2 + 5 }) : along(from, to, svg("rect", { class: "rail-bed", y: -3, width: radius, height: 6, rx: 3 }));
    this.moving = along(from, to, this.carriage);
    this.covered = turn ? [] : [union(around(from, 4), around(to, 4))];
    this.reach = turn ? around(from, radius + DISC / 2 + 6) : null;
    // Beside its middle, where the arm does not come.
    const free = ((direction(from, to) + turn / 2 + 180) * Math.PI) / 180;
    this.names = turn ? [[motor, [from[0] + 22 * Math.cos(free), from[1] + 22 * Math.sin(free)]]] : [[motor, above(from, to)]];
  }

  update(slide) {
    this.thing.update(slide);
    setStyle(this.carriage, "transform", this.way(slide.part));
  }
}

class EjectorPart {
  constructor({ valve, from, to }) {
    const back = between(from, to, -34 / distance(from, to));
    this.rod = svg("path", { class: "rod", d: "M-42 -2H-24V-9H-19V9H-24V2H-42Z" });
    this.base = svg("g", {});
    this.moving = along(from, to, this.rod, svg("rect", { class: "cylinder", x: -44, y: -7, width: 20, height: 14, rx: 3 }));
    this.covered = [around(back, 12)];
    this.names = [[valve, between(from, to, -52 / distance(from, to))]];
  }

  update({ on }) {
    setAttribute(this.moving, "data-on", on);
  }
}

/** A motor that moves nothing, such as a saw. */
class WheelPart {
  constructor({ motor, at }) {
    this.wheel = svg("path", { class: "wheel", d: GEAR });
    this.base = svg("g", { transform: `translate(${at}) scale(0.34)` }, this.wheel);
    this.moving = svg("g", {});
    this.covered = [around(at, 16)];
    this.names = [[motor, [at[0], at[1] + 24]]];
  }

  update({ speed }) {
    setAttribute(this.wheel, "data-turns", Math.abs(speed) < 0.02 ? false : speed > 0 ? "forward" : "backwards");
  }
}

class GripperPart {
  constructor({ motors, rail, arm, heights }, bars) {
    this.thing = new Thing();
    this.arm = svg("rect", { class: "arm", y: -3, width: 1, height: 6 });
    this.head = svg("g", { class: "head" }, this.thing.element, svg("circle", { class: "grip", r: DISC / 2 + 3 }));
    this.marks = heights.map(() => svg("rect", { class: "mark", x: -8, y: -3, width: 16, height: 6, rx: 2 }));
    const foot = rail ? along(...rail, svg("rect", { class: "rail-bed", y: -3, width: distance(...rail), height: 6, rx: 3 })) : svg("circle", { class: "bed", cx: arm[0][0], cy: arm[0][1], r: 20 });
    this.base = svg("g", {}, foot, this.marks.map((mark, index) => svg("g", { transform: `translate(${bars[index]})` }, svg("rect", { class: "rail-bed", x: -3, width: 6, height: HEIGHT, rx: 3 }), mark)));
    this.moving = svg("g", { class: "gripper" }, this.arm, this.head);
    this.covered = rail ? [union(around(rail[0], 3), around(rail[1], 3))] : [around(arm[0], 20)];
    this.names = [[motors.join(" "), rail ? above(...rail) : [arm[0][0], arm[0][1] + 28]], ...heights.map(({ motor }, index) => [motor, [bars[index][0], bars[index][1] + HEIGHT + 12]])];
  }

  update(gripper) {
    const { arm: [from, to], heights, on, low } = gripper;
    setStyle(this.arm, "transform", `${move(from)} rotate(${direction(from, to).toFixed(2)}deg) scaleX(${distance(from, to).toFixed(1)})`);
    setStyle(this.head, "transform", move(to));
    setAttribute(this.moving, "data-on", on);
    setAttribute(this.moving, "data-low", low);
    this.thing.update(gripper);
    heights.forEach(({ part }, index) => setStyle(this.marks[index], "transform", `translateY(${(part * HEIGHT).toFixed(1)}px)`));
  }
}

/** Where a place is: its mark, what lies there, and the control or text above it, which may be smaller beside others. */
class Spot {
  constructor(place, shown, all) {
    this.at = place.at;
    this.shown = shown;
    this.mark = svg("circle", { class: "spot", cx: place.at[0], cy: place.at[1], r: DISC / 2 - 1 });
    this.thing = place.moves ? null : new Thing();
    this.moving = this.thing && svg("g", { transform: `translate(${place.at})` }, this.thing.element);
    this.name = svg("text", { class: "place-name" }, placeName(place.name.split(".").pop()));
    this.leader = svg("path", { class: "leader" });
    this.size = [DISC, DISC];
    for (const { at, other } of all) {
      const apart = [0, 1].map((axis) => Math.abs(at[axis] - place.at[axis]));
      const axis = apart[0] >= apart[1] ? 0 : 1;
      if (apart[axis] && apart[axis] < this.size[axis] && !other) this.size[axis] = apart[axis];
    }
  }
}

/** The first place for a name of this size that covers nothing: below, above or beside, and so on, further and further. */
function freePlace([x, y], wide, size, [left, , right], taken) {
  const rows = Array.from({ length: 9 }, (_, row) => DISC / 2 + 2 + row * size * 0.6);
  const candidates = rows.flatMap((away, row) => [
    ...[[x - wide / 2, y + away], [x - wide / 2, y - away - size]],
    ...(row < 3 ? [1, -1].flatMap((side) => [[x + DISC / 2 + 3, y - size * (0.5 + 0.4 * side * row)], [x - DISC / 2 - 3 - wide, y - size * (0.5 + 0.4 * side * row)]]) : []),
    ...[[x - 0.2 * wide, y + away], [x - 0.8 * wide, y + away], [x - 0.2 * wide, y - away - size], [x - 0.8 * wide, y - away - size]],
  ]);
  const places = candidates.map(([from, top]) => {
    const start = Math.max(left, Math.min(from, right - wide));
    return [start, top, start + wide, top + size];
  });
  return places.find((place) => !taken.some((other) => overlap(place, other))) ?? places[0];
}

export class Drawing {
  /** `shown` has the elements of the places that are drawn, in their order. */
  constructor({ belts, places, drawing: { slides, grippers, ejectors, wheels } }, shown) {
    const drawn = places.filter((place) => place.at);
    this.spots = drawn.map((place, index) => new Spot(place, shown[index], drawn));
    this.belts = belts.map((belt) => belt.line && new BeltPart(belt));
    this.parts = { slides: slides.map((one) => new SlidePart(one)), wheels: wheels.map((one) => new WheelPart(one)), ejectors: ejectors.map((one) => new EjectorPart(one)) };
    const parts = [...this.belts.filter(Boolean), ...Object.values(this.parts).flat()];
    const reach = [...parts.flatMap(({ covered, reach: own }) => (own ? [...covered, own] : covered)), ...this.spots.map(({ at }) => around(at, DISC / 2)),
      ...grippers.flatMap(({ rail, arm }) => (rail ? rail.map((end) => around(end, 6)) : [around(arm[0], 20)]))];
    this.box = reach.reduce(union);
    // Heights are to the right of all else.
    const bar = () => [(this.box[2] += 26) - 10, this.box[1] + 20];
    this.parts.grippers = grippers.map((one) => new GripperPart(one, one.heights.map(bar)));
    parts.push(...this.parts.grippers);
    this.taken = [...parts.flatMap(({ covered }) => covered), ...this.spots.map(({ at }) => around(at, DISC / 2))];
    this.names = parts.flatMap(({ names }) => names).map(([text, at]) => ({ at, text: svg("text", { class: "terminal-name", x: at[0], y: at[1] }, text) }));
    this.svg = svg("svg", { role: "img", "aria-label": t("drawing") }, parts.map(({ base }) => base), this.spots.map(({ mark }) => mark),
      this.names.map(({ text }) => text), this.spots.flatMap(({ leader, name }) => [leader, name]),
      this.spots.map(({ moving }) => moving), parts.map(({ moving }) => moving));
    this.frame = h("div", { class: "drawing" }, this.svg, shown);
    this.element = h("div", {}, this.frame);
    this.sized = new ResizeObserver(([entry]) => this.arrange(entry.contentRect.width));
    this.sized.observe(this.element);
    this.fit(this.box);
  }

  /** Writes the names where there is room for them, in so many pixels from left to right. */
  arrange(all) {
    const width = this.frame.clientWidth;
    if (!width || all === this.all) return;
    this.all = all;
    const size = (NAME * (this.box[2] - this.box[0])) / width;
    setStyle(this.svg, "font-size", `${size}px`);
    const taken = [...this.taken];
    // Beside the drawing there may be room, too.
    const beside = (Math.max(0, all - width) / 2) * (size / NAME);
    const room = [this.box[0] - beside, 0, this.box[2] + beside, 0];
    let box = this.box;
    for (const { at, text } of this.names) {
      const half = text.getComputedTextLength() / 2;
      taken.push([at[0] - half, at[1] - size / 2, at[0] + half, at[1] + size / 2]);
      box = union(box, taken.at(-1));
    }
    for (const { at, name, leader } of this.spots) {
      const place = freePlace(at, name.getComputedTextLength(), size, room, taken);
      taken.push([place[0] - size / 2, place[1], place[2] + size / 2, place[3]]);
      box = union(box, place);
      const [x1, y1, x2, y2] = place;
      setAttribute(name, "x", x1);
      setAttribute(name, "y", y1 + 0.8 * size);
      const end = [Math.max(x1, Math.min(at[0], x2)), y1 > at[1] ? y1 : y2];
      setAttribute(leader, "d", distance(at, end) > NEAR && `M${at}L${end}`);
    }
    this.fit([this.box[0], box[1], this.box[2], box[3] + 3]);
  }

  /** Shows this rectangle, and lays the places' elements over it. */
  fit([left, top, right, bottom]) {
    const [wide, high] = [right - left, bottom - top];
    setAttribute(this.svg, "viewBox", `${left} ${top} ${wide} ${high}`);
    setStyle(this.frame, "max-width", `${wide * Math.min(SCALE, TALL / (this.box[3] - this.box[1]))}px`);
    for (const { at, size, shown } of this.spots) {
      setStyle(shown, "left", `${(100 * (at[0] - left)) / wide}%`);
      setStyle(shown, "top", `${(100 * (at[1] - top)) / high}%`);
      setStyle(shown, "width", `${(100 * size[0]) / wide}%`);
      setStyle(shown, "height", `${(100 * size[1]) / high}%`);
    }
  }

  update({ belts, places, drawing }) {
    belts.forEach((belt, index) => this.belts[index]?.update(belt));
    for (const [name, parts] of Object.entries(this.parts)) drawing[name].forEach((one, index) => parts[index].update(one));
    places.filter((place) => place.at).forEach((place, index) => this.spots[index].thing?.update(place));
  }

  close() {
    this.sized.disconnect();
  }
}
