// The moving parts of a simulated machine: motors that turn, slides, lamps that glow.

import { h, setAttribute, setStyle, svg } from "./dom.js";
import { decimal, t } from "./words.js";

const TEETH = 16;
// Gears turn slower than the motors, so that the eye sees which way.
const SLOWER = 4;
const TURN_MS = 1000 * SLOWER;
const STANDS = 0.02;
const still = matchMedia("(prefers-reduced-motion: reduce)");

function gearPath() {
  const points = [];
  const at = (angle, radius) => points.push(`${(Math.cos(angle) * radius).toFixed(2)} ${(Math.sin(angle) * radius).toFixed(2)}`);
  for (let tooth = 0; tooth < TEETH; tooth++) {
    const angle = (tooth / TEETH) * 2 * Math.PI;
    const part = Math.PI / TEETH;
    at(angle - part * 0.62, 37);
    at(angle - part * 0.34, 44);
    at(angle + part * 0.34, 44);
    at(angle + part * 0.62, 37);
  }
  return `M${points.join("L")}Z`;
}

/** The outline of a gear with a radius of 44. */
export const GEAR = gearPath();

function gear() {
  const holes = Array.from({ length: 5 }, (_, index) => {
    const angle = (index / 5) * 2 * Math.PI;
    return svg("circle", { class: "hole", cx: 21 * Math.cos(angle), cy: 21 * Math.sin(angle), r: index ? 6 : 7.5, "data-first": index === 0 });
  });
  return svg("svg", { class: "gear", viewBox: "-48 -48 96 96", role: "img" }, svg("path", { class: "rim", d: GEAR }), svg("circle", { class: "disc", r: 32 }), holes,
    svg("circle", { class: "hub", r: 8 }), svg("path", { class: "axle", d: "M-3 0H3M0 -3V3" }));
}

export class MotorView {
  constructor({ motor, slide }, names, ends) {
    const terminal = `M${motor + 1}`;
    this.name = names.full(terminal);
    this.speed = null;
    this.gear = gear();
    // The browser turns it by itself; only the rate is set.
    this.turn = this.gear.animate([{ transform: "rotate(0deg)" }, { transform: "rotate(360deg)" }], { duration: TURN_MS, iterations: Infinity });
    this.turn.pause();
    // It must not run backwards over its beginning.
    this.turn.currentTime = TURN_MS * 1e6;
    this.element = h("li", { class: "moving" }, h("div", { class: "drive" }, this.gear, h("span", { class: "label" }, terminal), names.small(terminal)));
    if (slide !== null) this.element.append(this.rail(ends));
  }

  rail(ends) {
    this.carriage = svg("g", { class: "carriage" }, svg("rect", { x: -22, y: 8, width: 44, height: 26, rx: 4 }),
      svg("circle", { cx: -12, cy: 36, r: 4 }), svg("circle", { cx: 12, cy: 36, r: 4 }), svg("path", { d: "M-8 21H8M4 17L8 21L4 25M-4 17L-8 21L-4 25" }));
    this.ends = [22, 298].map((x, end) => ({ input: ends[end] ?? null, mark: svg("g", { class: "end" },
      svg("rect", { x: x - 6, y: 2, width: 12, height: 10, rx: 2 }), svg("text", { x, y: 63, "text-anchor": "middle" }, ends[end] === undefined ? "" : `I${ends[end] + 1}`)) }));
    const ticks = Array.from({ length: 21 }, (_, tick) => svg("path", { class: "tick", d: `M${40 + tick * 12} 44v${tick % 5 ? 3 : 6}` }));
    this.track = svg("svg", { class: "rail", viewBox: "0 0 320 64", role: "img" },
      svg("rect", { class: "bed", x: 10, y: 38, width: 300, height: 6, rx: 3 }), ticks, this.ends.map(({ mark }) => mark), this.carriage);
    return this.track;
  }

  /** `pressed` says whether an end switch is pressed. */
  update({ speed, slide }, pressed) {
    if (speed !== this.speed) {
      this.speed = speed;
      if (Math.abs(speed) < STANDS || still.matches) this.turn.pause();
      else {
        this.turn.updatePlaybackRate(speed);
        this.turn.play();
      }
      setAttribute(this.gear, "aria-label", t("motorOf", { name: this.name, speed: decimal(speed) }));
      setAttribute(this.element, "data-turns", Math.abs(speed) < STANDS ? false : speed > 0 ? "forward" : "backwards");
    }
    if (!this.track) return;
    setStyle(this.carriage, "transform", `translateX(${(50 + (slide ?? 0) * 220).toFixed(1)}px)`);
    setAttribute(this.track, "aria-label", t("slideOf", { name: this.name, place: Math.round((slide ?? 0) * 100) }));
    for (const { input, mark } of this.ends) setAttribute(mark, "data-on", input !== null && pressed(input));
  }

  close() {
    this.turn.cancel();
  }
}

export class LampView {
  constructor({ output, colour }, names) {
    const terminal = `O${output + 1}`;
    this.name = names.full(terminal);
    // Those of one colour share it.
    const halo = `halo-${colour ?? "bulb"}`;
    this.bulb = svg("svg", { class: "bulb", "data-colour": colour, viewBox: "-32 -32 64 64", role: "img" },
      svg("radialGradient", { id: halo }, svg("stop", { class: "halo-stop", offset: 0.4, "stop-opacity": 0.55 }), svg("stop", { class: "halo-stop", offset: 1, "stop-opacity": 0 })),
      svg("circle", { class: "halo", r: 31, fill: `url(#${halo})` }), svg("circle", { class: "glass", r: 15 }), svg("circle", { class: "light", r: 15 }),
      // The sign of a lamp in a circuit diagram. A filament looks like an M, and so like a motor.
      svg("path", { class: "wire-in", d: "M-10.6 -10.6L10.6 10.6M10.6 -10.6L-10.6 10.6" }));
    this.element = h("li", { class: "lamp" }, this.bulb, h("span", { class: "label" }, terminal), names.small(terminal));
  }

  update({ glow }) {
    setStyle(this.bulb, "--glow", glow.toFixed(2));
    setAttribute(this.bulb, "aria-label", t("lampOf", { name: this.name, glow: Math.round(glow * 100) }));
  }
}
