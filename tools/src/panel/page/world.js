// The world of a simulated TXT: what hands do to it, and what it does.

import { button, card, h, hold, isHeld, setAttribute, setStyle, setText, setValue, throttled } from "./dom.js";
import { Joystick } from "./joystick.js";
import { LampView, MotorView } from "./machine.js";
import { number, t } from "./words.js";

/** A terminal, what is there, and what people call it. */
function label(terminal, names, kind) {
  return [h("span", { class: "label" }, terminal, h("small", {}, kind)), names.small(terminal)];
}

/** A button or a switch: pressed as long as the mouse, the Enter key or its number key is held. */
class Push {
  constructor({ input, kind }, names, send) {
    const name = `I${input + 1}`;
    this.input = input;
    this.pressed = false;
    this.send = (pressed) => send({ do: "press", input, pressed });
    this.cap = h("button", { type: "button", class: "push", "aria-label": t("press", { name: names.full(name) }), "aria-pressed": "false" }, h("i", {}));
    this.cap.addEventListener("pointerdown", (event) => {
      this.cap.setPointerCapture(event.pointerId);
      this.press(true);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) this.cap.addEventListener(end, () => this.press(false));
    this.cap.addEventListener("keydown", (event) => event.key === "Enter" && this.press(true));
    this.cap.addEventListener("keyup", (event) => event.key === "Enter" && this.press(false));
    this.cap.addEventListener("contextmenu", (event) => event.preventDefault());
    this.element = h("li", { class: "sensor-push" }, this.cap, label(name, names, t(kind)));
  }

  press(pressed) {
    if (pressed === this.pressed || (pressed && this.cap.matches(":disabled"))) return;
    this.pressed = pressed;
    hold(this.cap);
    this.show(pressed);
    this.send(pressed);
  }

  update({ value }) {
    if (!this.pressed && !isHeld(this.cap)) this.show(value !== 0);
  }

  show(pressed) {
    setAttribute(this.cap, "aria-pressed", pressed ? "true" : "false");
  }
}

/** Black or white under one half of a trail sensor. */
class Trail {
  constructor({ input }, names, send) {
    const name = `I${input + 1}`;
    this.button = button("", () => {
      hold(this.button);
      this.show(!this.white);
      send({ do: "sensor", input, value: this.white ? 1 : 0 });
    }, { class: "trail" });
    this.name = `${names.full(name)}: ${t("trail")}`;
    this.element = h("li", { class: "sensor-push" }, this.button, label(name, names, t("trail")));
  }

  update({ value }) {
    if (!isHeld(this.button)) this.show(value !== 0);
  }

  show(white) {
    this.white = white;
    const colour = t(white ? "white" : "black");
    setText(this.button, colour);
    setAttribute(this.button, "aria-label", `${colour}, ${this.name}`);
    setAttribute(this.button, "aria-pressed", white ? "true" : "false");
  }
}

class Slider {
  constructor({ input, kind, min, max, value }, names, send) {
    const name = `I${input + 1}`;
    this.min = min;
    this.max = max;
    const sensor = throttled((value) => send({ do: "sensor", input, value }));
    this.slider = h("input", { type: "range", min, max, step: max - min > 20 ? 1 : (max - min) / 100, value, "aria-label": `${names.full(name)}: ${t(kind)}` });
    this.slider.addEventListener("input", () => {
      hold(this.slider);
      sensor(Number(this.slider.value));
    });
    this.text = h("output", { class: "duty" });
    this.element = h("li", { class: "sensor-slider" }, label(name, names, t(kind)), h("div", { class: "slide-row" }, this.slider, this.text));
  }

  update({ value, unit }) {
    setValue(this.slider, value);
    const shown = Number(this.slider.value);
    setStyle(this.slider, "--fill", `${((shown - this.min) / (this.max - this.min)) * 100}%`);
    setText(this.text, `${number(shown)} ${unit ?? ""}`);
  }
}

function sensorView(sensor, names, send) {
  if (sensor.kind === "button" || sensor.kind === "switch") return new Push(sensor, names, send);
  return sensor.kind === "trail" ? new Trail(sensor, names, send) : new Slider(sensor, names, send);
}

/** A remote in the user's hand. */
class RemoteView {
  constructor(index, { dip1, dip2 }, send) {
    const change = (fields) => {
      Object.assign(this.values, fields);
      this.used = performance.now();
      move();
    };
    const move = throttled(() => send({ do: "remote", remote: index, ...this.values }));
    this.values = null;
    this.used = -Infinity;
    const name = t("remote", { number: 1 + (dip1 ? 1 : 0) + (dip2 ? 2 : 0) });
    this.left = new Joystick(`${name}, ${t("leftStick")}`, (x, y) => change({ left_x: x, left_y: y }));
    this.right = new Joystick(`${name}, ${t("rightStick")}`, (x, y) => change({ right_x: x, right_y: y }));
    const key = (word, field) => {
      const one = h("button", { type: "button", class: "key", "aria-label": `${t(word)}, ${name}` }, t(word));
      const set = (value) => this.values && Boolean(this.values[field]) !== value && change({ [field]: value });
      one.addEventListener("pointerdown", () => set(true));
      for (const end of ["pointerup", "pointercancel", "pointerleave", "blur"]) one.addEventListener(end, () => set(false));
      one.addEventListener("keydown", (event) => event.key === "Enter" && set(true));
      one.addEventListener("keyup", (event) => event.key === "Enter" && set(false));
      return one;
    };
    this.keys = { on: key("onKey", "on"), off: key("offKey", "off") };
    // The switches say which remote it is.
    const dips = [dip1, dip2].map((on, dip) => h("span", { class: "dip", "data-on": Boolean(on) }, t("dip", { number: dip + 1 })));
    this.element = h("li", { class: "remote" }, h("span", { class: "label" }, name),
      h("div", { class: "sticks" }, this.left.element, h("div", { class: "keys" }, this.keys.on, this.keys.off, dips), this.right.element));
  }

  update(remote) {
    // What was just sent is newer than what comes in.
    if (performance.now() - this.used < 500) return this.show(this.values);
    // Its switches can't be set.
    const { dip1: _dip1, dip2: _dip2, ...values } = remote;
    this.values = values;
    this.show(remote);
  }

  show(remote) {
    this.left.update(remote.left_x, remote.left_y);
    this.right.update(remote.right_x, remote.right_y);
    setAttribute(this.keys.on, "data-on", Boolean(remote.on));
    setAttribute(this.keys.off, "data-on", Boolean(remote.off));
  }
}

/** A list of parts, if there are any. */
function list(name, parts) {
  return parts.length ? h("ul", { class: name }, parts.map((part) => part.element)) : null;
}

/** The world on one controller, and at the master the remotes. */
export class World {
  constructor(host, area, state, send) {
    this.area = area;
    const names = host.names[area];
    const commands = (command) => send({ ...command, host: host.id, area });
    const board = state.world.boards[area];
    // What slides move and places see is not for hands, and some pages have none.
    const hands = board.inputs.filter((sensor) => host.hands && sensor.moved_by === null && sensor.place === null);
    const ends = (motor) => board.inputs.filter((sensor) => sensor.moved_by === motor && sensor.kind === "switch").map((sensor) => sensor.input);
    this.sensors = hands.map((sensor) => sensorView(sensor, names, commands));
    this.inputs = hands.map((sensor) => sensor.input);
    this.motors = board.motors.map((motor) => new MotorView(motor, names, ends(motor.motor)));
    this.lamps = board.lamps.map((lamp) => new LampView(lamp, names));
    this.remotes = area || !host.hands ? [] : state.world.remotes.map((remote, index) => new RemoteView(index, remote, commands));
    this.controls = h("fieldset", { class: "scene" },
      list("hands", this.sensors),
      h("div", { class: "moves" }, list("motors", this.motors), list("lamps", this.lamps)),
      list("held", this.remotes));
    const name = state.areas[area].name;
    this.plug = area && host.hands ? button("", () => commands({ do: "plug", alive: !this.alive }), { class: "small", title: t("plug", { name }) }) : null;
    this.title = area ? `${t("world")} · ${name}` : t("world");
    this.element = card("world", this.title, this.plug ?? (this.sensors.some((sensor) => sensor instanceof Push) ? h("p", { class: "hint" }, t("worldHint")) : null), this.controls);
  }

  /** The world changes its parts only when another one is loaded. */
  static shape(state, area) {
    const board = state.world?.boards[area];
    if (!board) return "";
    return JSON.stringify([board.inputs.map(({ input, kind, min, max, moved_by, place }) => [input, kind, min, max, moved_by, place]),
      board.motors.map(({ motor, slide }) => [motor, slide === null]), board.lamps.map(({ output, colour }) => [output, colour]), state.world.remotes.map(({ dip1, dip2 }) => [dip1, dip2])]);
  }

  update(state, may) {
    const board = state.world.boards[this.area];
    this.alive = board.alive;
    this.controls.disabled = !may || !board.alive;
    if (this.plug) {
      this.plug.disabled = !may;
      setText(this.plug, t(board.alive ? "plugOut" : "plugIn"));
    }
    const byInput = new Map(board.inputs.map((sensor) => [sensor.input, sensor]));
    this.sensors.forEach((sensor, index) => sensor.update(byInput.get(this.inputs[index])));
    board.motors.forEach((motor, index) => this.motors[index].update(motor, (input) => byInput.get(input).value !== 0));
    board.lamps.forEach((lamp, index) => this.lamps[index].update(lamp));
    this.remotes.forEach((remote, index) => remote.update(state.world.remotes[index]));
  }

  /** A number key, 1 to 8, holds the button of that input. */
  key(input, pressed) {
    const sensor = this.sensors[this.inputs.indexOf(input)];
    if (sensor instanceof Push) sensor.press(pressed);
  }

  close() {
    for (const motor of this.motors) motor.close();
  }
}
