// M1 to M4, each as a motor or as two single outputs.

import { button, h, hold, isHeld, select, setAttribute, setStyle, setText, setValue, throttled } from "./dom.js";
import { Distance } from "./distance.js";
import { remember, remembered } from "./remember.js";
import { t } from "./words.js";

const FULL = 512;
// A first click moves a machine slowly.
const FIRST = 160;

/** A slider for a duty, with its number. It shows what the user has set last, or what the terminal has while it is on. */
class Duty {
  /** `name` is the terminal's, with its controller. `changed` gets what the user sets. */
  constructor(name, label, changed) {
    this.name = name;
    this.slider = h("input", { type: "range", min: 0, max: FULL, step: 1, value: remembered(name, FIRST), "aria-label": label });
    this.slider.addEventListener("input", () => {
      hold(this.slider);
      remember(name, this.set);
      this.show();
      changed(this.set);
    });
    this.text = h("output", { class: "duty" });
    this.element = h("div", { class: "slide-row" }, this.slider, this.text);
  }

  /** What is set. */
  get set() {
    return Number(this.slider.value);
  }

  get isHeld() {
    return isHeld(this.slider);
  }

  hold() {
    hold(this.slider);
  }

  /** 0 is off. */
  update(duty) {
    setValue(this.slider, duty || remembered(this.name, FIRST));
    this.show();
  }

  show() {
    // Browsers draw sliders each in their own way; the fill comes from a variable.
    setStyle(this.slider, "--fill", `${(this.set / FULL) * 100}%`);
    setText(this.text, this.set);
  }
}

/** A motor: backwards, stop, forward, and a speed. The speed is kept while the motor stands. */
class MotorControl {
  constructor(index, place, names, send) {
    const terminal = `M${index + 1}`;
    const name = names.full(terminal);
    this.direction = 0;
    const motor = throttled((duty) => send({ do: "motor", motor: index, duty }));
    const drive = (direction) => () => {
      this.direction = direction;
      this.speed.hold();
      motor(direction * this.speed.set);
    };
    this.speed = new Duty(`${place} ${terminal}`, t("speedOf", { name }), (speed) => {
      if (this.direction) motor(this.direction * speed);
    });
    this.buttons = [["left", -1, "↺"], ["stopOf", 0, "■"], ["right", 1, "↻"]].map(([word, direction, sign]) =>
      button(sign, drive(direction), { "aria-label": t(word, { name }), title: t(word, { name }), "data-direction": direction }));
    this.directions = h("div", { class: "directions", role: "group", "aria-label": name }, this.buttons);
    this.distance = new Distance(index, name, send, () => (this.direction || 1) * this.speed.set);
    this.element = h("div", { class: "motor-control" }, this.speed.element, this.distance.element);
  }

  update(motor, alive) {
    const [forward, backwards] = motor.duty;
    // A motor that has gone its distance stands, whatever its duty is.
    const arrived = motor.distance > 0 && motor.ready;
    const direction = arrived ? 0 : Math.sign(forward - backwards);
    if (!this.speed.isHeld) {
      this.direction = direction;
      this.speed.update(direction ? Math.max(forward, backwards) : 0);
    }
    this.buttons.forEach((one, index) => setAttribute(one, "aria-pressed", alive && index - 1 === direction ? "true" : "false"));
    this.distance.update(motor);
    return direction;
  }
}

/** A single output: a switch and a value. */
class OutputControl {
  constructor(index, place, names, send) {
    const terminal = `O${index + 1}`;
    const name = names.full(terminal);
    const called = names.small(terminal);
    this.on = false;
    const output = throttled((duty) => send({ do: "output", output: index, duty }));
    this.level = new Duty(`${place} ${terminal}`, t("dutyOf", { name }), (level) => {
      if (this.on) output(level);
    });
    this.switch = button("○", () => {
      this.on = !this.on;
      this.level.hold();
      output(this.on ? this.level.set : 0);
    }, { class: "toggle", "aria-label": t("switchOf", { name }) });
    this.element = h("div", { class: "output-control", "data-named": Boolean(called), "data-on": false }, h("span", { class: "name", "data-plot": terminal }, terminal), called, this.switch, this.level.element);
  }

  update(duty) {
    if (!this.level.isHeld) {
      this.on = duty > 0;
      this.level.update(duty);
    }
    setText(this.switch, duty > 0 ? "●" : "○");
    setAttribute(this.switch, "aria-pressed", duty > 0 ? "true" : "false");
    setAttribute(this.element, "data-on", duty > 0);
  }
}

/** What is known of a motor whose controller is not there. */
const NOTHING = { duty: [0, 0], distance: 0, done: 0, ready: false, with: null };

class Terminal {
  constructor(index, place, names, send) {
    const name = `M${index + 1}`;
    const called = names.small(name);
    this.kind = select(t("kindOf", { name: names.full(name) }), [["motor", t("asMotor")], ["outputs", t("asOutputs")]],
      (kind) => send({ do: "motor_kind", motor: index, outputs: kind === "outputs" }));
    this.motor = new MotorControl(index, place, names, send);
    this.outputs = [0, 1].map((half) => new OutputControl(2 * index + half, place, names, send));
    this.pair = h("div", { class: "pair" }, this.outputs.map((output) => output.element));
    this.element = h("li", { class: "terminal", "data-named": Boolean(called) },
      h("i", { class: "wire", "aria-hidden": "true" }), h("span", { class: "name", "data-plot": name }, name), called, this.kind, this.motor.directions,
      this.motor.element, this.pair);
  }

  update(state, alive) {
    const motor = alive ? state : { ...state, ...NOTHING };
    setValue(this.kind, motor.outputs ? "outputs" : "motor");
    setAttribute(this.element, "data-kind", motor.outputs ? "outputs" : "motor");
    const direction = this.motor.update(motor, alive);
    this.outputs.forEach((output, half) => output.update(motor.duty[half]));
    const on = motor.outputs ? motor.duty.some((duty) => duty > 0) : direction !== 0;
    setAttribute(this.element, "data-on", on && (direction < 0 && !motor.outputs ? "backwards" : "forward"));
  }
}

export class Outputs {
  /** `place` names the area and its controller. */
  constructor(place, names, send) {
    this.terminals = Array.from({ length: 4 }, (_, index) => new Terminal(index, place, names, send));
    this.element = h("ul", { class: "outputs", "aria-label": t("outputs") }, this.terminals.map((terminal) => terminal.element));
  }

  update(area) {
    area.motors.forEach((motor, index) => this.terminals[index].update(motor, area.alive));
  }
}
