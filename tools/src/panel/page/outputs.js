// M1 to M4, each as a motor or as two single outputs.

import { button, h, hold, isHeld, select, setAttribute, setStyle, setText, setValue, throttled } from "./dom.js";
import { Distance } from "./distance.js";
import { t } from "./words.js";

export const FULL = 512;

function slider(label, changed) {
  const control = h("input", { type: "range", min: 0, max: FULL, step: 1, value: FULL, "aria-label": label });
  control.addEventListener("input", () => {
    hold(control);
    changed(Number(control.value));
  });
  return control;
}

/** The fill of a slider, which browsers draw each in their own way, comes from a variable. */
function showFill(control) {
  setStyle(control, "--fill", `${(control.value / FULL) * 100}%`);
}

/** A motor: backwards, stop, forward, and a speed. The speed is kept while the motor stands. */
class MotorControl {
  constructor(index, send) {
    const name = `M${index + 1}`;
    this.direction = 0;
    const motor = throttled((duty) => send({ do: "motor", motor: index, duty }));
    const drive = (direction) => () => {
      this.direction = direction;
      hold(this.speed);
      motor(direction * Number(this.speed.value));
    };
    this.speed = slider(t("speedOf", { name }), (value) => {
      setText(this.value, value);
      showFill(this.speed);
      if (this.direction) motor(this.direction * value);
    });
    this.value = h("output", { class: "duty" });
    this.buttons = [["left", -1, "↺"], ["stopOf", 0, "■"], ["right", 1, "↻"]].map(([word, direction, sign]) =>
      button(sign, drive(direction), { "aria-label": t(word, { name }), title: t(word, { name }), "data-direction": direction }));
    this.directions = h("div", { class: "directions", role: "group", "aria-label": name }, this.buttons);
    this.distance = new Distance(index, send, () => (this.direction || 1) * Number(this.speed.value));
    this.element = h("div", { class: "motor-control" },
      h("div", { class: "slide-row" }, this.speed, this.value), this.distance.element);
  }

  update(motor) {
    const [forward, backwards] = motor.duty;
    // A motor that has gone its distance stands, whatever its duty is.
    const arrived = motor.distance > 0 && motor.ready;
    const direction = arrived ? 0 : Math.sign(forward - backwards);
    if (!isHeld(this.speed)) {
      this.direction = direction;
      if (direction) setValue(this.speed, Math.max(forward, backwards));
    }
    showFill(this.speed);
    setText(this.value, this.speed.value);
    this.buttons.forEach((one, index) => setAttribute(one, "aria-pressed", index - 1 === direction ? "true" : "false"));
    this.distance.update(motor);
    return direction;
  }
}

/** A single output: a switch and a value. */
class OutputControl {
  constructor(index, send) {
    const name = `O${index + 1}`;
    this.on = false;
    const output = throttled((duty) => send({ do: "output", output: index, duty }));
    this.value = h("output", { class: "duty" });
    this.level = slider(t("dutyOf", { name }), (value) => {
      setText(this.value, value);
      showFill(this.level);
      if (this.on) output(value);
    });
    this.switch = button("○", () => {
      this.on = !this.on;
      hold(this.level);
      output(this.on ? Number(this.level.value) : 0);
    }, { class: "toggle", "aria-label": t("switchOf", { name }) });
    this.element = h("div", { class: "output-control" }, h("span", { class: "name" }, name), this.switch,
      h("div", { class: "slide-row" }, this.level, this.value));
  }

  update(duty) {
    if (!isHeld(this.level)) {
      this.on = duty > 0;
      if (duty) setValue(this.level, duty);
    }
    showFill(this.level);
    setText(this.value, this.level.value);
    setText(this.switch, duty > 0 ? "●" : "○");
    setAttribute(this.switch, "aria-pressed", duty > 0 ? "true" : "false");
  }
}

class Terminal {
  constructor(index, send) {
    const name = `M${index + 1}`;
    this.kind = select(t("kindOf", { name }), [["motor", t("asMotor")], ["outputs", t("asOutputs")]],
      (kind) => send({ do: "motor_kind", motor: index, outputs: kind === "outputs" }));
    this.motor = new MotorControl(index, send);
    this.outputs = [0, 1].map((half) => new OutputControl(2 * index + half, send));
    this.pair = h("div", { class: "pair" }, this.outputs.map((output) => output.element));
    this.element = h("li", { class: "terminal" },
      h("i", { class: "wire", "aria-hidden": "true" }), h("span", { class: "name" }, name), this.kind, this.motor.directions,
      this.motor.element, this.pair);
  }

  update(motor) {
    setValue(this.kind, motor.outputs ? "outputs" : "motor");
    setAttribute(this.element, "data-kind", motor.outputs ? "outputs" : "motor");
    const direction = this.motor.update(motor);
    this.outputs.forEach((output, half) => output.update(motor.duty[half]));
    const on = motor.outputs ? motor.duty.some((duty) => duty > 0) : direction !== 0;
    setAttribute(this.element, "data-on", on && (direction < 0 && !motor.outputs ? "backwards" : "forward"));
  }
}

export class Outputs {
  constructor(send) {
    this.terminals = Array.from({ length: 4 }, (_, index) => new Terminal(index, send));
    this.element = h("ul", { class: "outputs", "aria-label": t("outputs") }, this.terminals.map((terminal) => terminal.element));
  }

  update(area) {
    area.motors.forEach((motor, index) => this.terminals[index].update(motor));
  }
}
