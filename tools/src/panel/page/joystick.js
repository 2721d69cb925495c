// A joystick: shows two axes, −15 to 15, and can be dragged or moved by the arrow keys.

import { h, setAttribute, setStyle } from "./dom.js";

const AXIS = 15;

export class Joystick {
  /** Without `moved` it only shows. */
  constructor(label, moved) {
    this.moved = moved;
    this.x = 0;
    this.y = 0;
    this.knob = h("i", {});
    this.element = h("div", { class: "joystick", role: "img", "aria-label": label, "data-label": label }, this.knob);
    if (moved) this.listen();
  }

  listen() {
    const { element } = this;
    element.tabIndex = 0;
    element.setAttribute("role", "application");
    element.classList.add("movable");
    const at = (event) => {
      const place = element.getBoundingClientRect();
      const radius = place.width / 2 - 14;
      const axis = (distance) => Math.max(-AXIS, Math.min(AXIS, Math.round((distance / radius) * AXIS)));
      this.move(axis(event.clientX - place.left - place.width / 2), -axis(event.clientY - place.top - place.height / 2));
    };
    const disabled = () => element.closest("fieldset:disabled") !== null;
    element.addEventListener("pointerdown", (event) => {
      if (disabled()) return;
      element.setPointerCapture(event.pointerId);
      this.dragged = true;
      at(event);
    });
    element.addEventListener("pointermove", (event) => this.dragged && at(event));
    // A joystick springs back.
    const release = () => {
      if (!this.dragged) return;
      this.dragged = false;
      this.move(0, 0);
    };
    for (const name of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) element.addEventListener(name, release);
    const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    element.addEventListener("keydown", (event) => {
      const step = keys[event.key];
      if (!step || disabled()) return;
      event.preventDefault();
      this.dragged = true;
      this.move(step[0] ? step[0] * AXIS : this.x, step[1] ? step[1] * AXIS : this.y);
    });
    element.addEventListener("keyup", (event) => {
      const step = keys[event.key];
      if (!step) return;
      this.move(step[0] ? 0 : this.x, step[1] ? 0 : this.y);
      this.dragged = this.x !== 0 || this.y !== 0;
    });
  }

  move(x, y) {
    if (x === this.x && y === this.y) return;
    this.show(x, y);
    this.moved(x, y);
  }

  update(x, y) {
    if (!this.dragged) this.show(x, y);
  }

  show(x, y) {
    this.x = x;
    this.y = y;
    setStyle(this.knob, "transform", `translate(${(x / AXIS) * 100}%, ${(-y / AXIS) * 100}%)`);
    setAttribute(this.element, "aria-label", `${this.element.dataset.label}: ${x}, ${y}`);
  }
}
