// What the controller receives from infrared remotes.

import { card, h, setAttribute } from "./dom.js";
import { Joystick } from "./joystick.js";
import { t } from "./words.js";

class Remote {
  constructor(index) {
    this.left = new Joystick(t("leftStick"));
    this.right = new Joystick(t("rightStick"));
    this.on = h("span", { class: "key" }, t("onKey"));
    this.off = h("span", { class: "key" }, t("offKey"));
    this.name = index ? t("remote", { number: index }) : t("remoteAny");
    this.element = h("li", { class: "remote" }, h("span", { class: "label" }, this.name),
      h("div", { class: "sticks" }, this.left.element, h("div", { class: "keys" }, this.on, this.off), this.right.element));
  }

  update(remote) {
    this.left.update(remote.left_x, remote.left_y);
    this.right.update(remote.right_x, remote.right_y);
    setAttribute(this.on, "data-on", Boolean(remote.on));
    setAttribute(this.off, "data-on", Boolean(remote.off));
  }
}

const AXES = ["left_x", "left_y", "right_x", "right_y", "on", "off"];

/** The values of all remotes together, and those of each remote once it was used. */
export class Remotes {
  constructor() {
    this.remotes = Array.from({ length: 5 }, (_, index) => new Remote(index));
    this.used = [true, false, false, false, false];
    this.list = h("ul", {}, this.remotes.map((remote) => remote.element));
    this.nothing = h("p", { class: "note", hidden: true }, "–");
    this.element = card("remotes", t("remotes"), this.list, this.nothing);
  }

  update(state) {
    const { alive, remotes } = state.areas[0];
    setAttribute(this.list, "hidden", !alive);
    setAttribute(this.nothing, "hidden", alive);
    if (!alive) return;
    remotes.forEach((remote, index) => {
      this.used[index] ||= AXES.some((axis) => Boolean(remote[axis]));
      setAttribute(this.remotes[index].element, "hidden", !this.used[index]);
      this.remotes[index].update(remote);
    });
  }
}
