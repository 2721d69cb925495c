// The view of one host: its boards, its world and everything around them.

import { Board } from "./board.js";
import { Camera } from "./camera.js";
import { button, h, setAttribute, setText, watchSeen } from "./dom.js";
import { Floor } from "./floor.js";
import { I2c } from "./i2c.js";
import { Link } from "./link.js";
import { Plot } from "./plot.js";
import { Record } from "./record.js";
import { Remotes } from "./remotes.js";
import { Sound } from "./sound.js";
import { sentence, t } from "./words.js";
import { World } from "./world.js";

/** What is out of sight is brought up to date at each tenth state: a screen reader sees it too. */
const SELDOM = 10;

/** The areas that are shown: those that were connected, even if they are not now, and those that can be plugged in. */
function shownAreas({ state, seen }) {
  return state.areas.map((_, index) => index).filter((index) => seen.has(index) || state.world?.boards[index]);
}

export class HostView {
  /** `chosen` is the number of an area, or "all". `choose` changes it. */
  constructor(host, chosen, choose, { send, ask }) {
    const { state } = host;
    this.host = host;
    this.shape = HostView.shape(host);
    const areas = shownAreas(host);
    this.chosen = areas.includes(chosen) || chosen === "all" ? chosen : 0;
    const open = this.chosen === "all" ? areas : [this.chosen];
    this.boards = open.map((area) => new Board(host, area, send));
    this.worlds = open.filter((area) => state.world?.boards[area]).map((area) => new World(host, area, state, send));
    this.floors = state.world?.floor && open.includes(0) ? [new Floor(host, state, send)] : [];
    // Each column has its cards for good: one that grows moves no other column's.
    const columns = host.driven || state.watched ? [[new Link(host)], [new Sound(host, send), new Remotes(), new I2c(host, ask)], [new Camera(host, send)]] : [[new Remotes()]];
    this.plot = new Plot(host, open[0]);
    this.record = state.recording ? new Record(host, send) : null;
    this.parts = [...this.boards, ...this.floors, ...this.worlds, ...columns.flat(), ...(this.record ? [this.record] : []), this.plot];
    for (const part of this.parts) watchSeen(part.element);
    this.states = 0;
    this.chips = new Map();
    this.problem = h("p", { class: "problem", role: "status", hidden: true });
    const worldOf = (board) => this.worlds.find((world) => world.area === board.area)?.element;
    const tools = [this.record?.element, this.plot.element];
    // Beside the values of the first board.
    const rows = this.boards.map((board, index) => [board.element, ...(index ? [] : tools), worldOf(board)]);
    const floors = this.floors.map((floor) => floor.element);
    // Who only looks sees the machine first.
    const order = host.driven ? [...rows.flat(), ...floors] : [...this.worlds.map((world) => world.element), ...floors, ...this.boards.map((board) => board.element), ...tools];
    this.element = h("div", { class: "host", "data-many": open.length > 1 },
      areas.length > 1 ? this.chooser(areas, choose) : null, this.problem, order, h("div", { class: "cards" }, columns.map((cards) => h("div", {}, cards.map((one) => one.element)))));
    this.element.addEventListener("click", (event) => this.plot.clicked(event));
  }

  chooser(areas, choose) {
    const chip = (area, text) => {
      const one = button(text, () => choose(area), { class: "chip", "aria-pressed": area === this.chosen ? "true" : "false" });
      this.chips.set(area, one);
      return one;
    };
    return h("div", { class: "chips", role: "group", "aria-label": t("areas") },
      areas.map((area) => chip(area, area ? `E${area}` : t("master"))), chip("all", t("all")));
  }

  /** Another shape needs another view. */
  static shape(host) {
    return shownAreas(host).map((area) => `${area}:${World.shape(host.state, area)}`).join() + Floor.shape(host.state);
  }

  update(drives) {
    const { state } = this.host;
    const { phase } = state.link;
    const { error } = this.host;
    const isShut = Boolean(state.watched?.shut);
    const told = error && phase !== "running" ? sentence(error) : "";
    const may = drives && phase === "running";
    // Hands may do in the world what they like while another program drives.
    const hands = this.host.driven ? may : this.host.hands && phase !== "lost";
    // An old error stays with the connection, below.
    setAttribute(this.problem, "hidden", !told && !isShut);
    setText(this.problem, [told, isShut ? t("shut") : ""].filter(Boolean).join(" "));
    this.states += 1;
    // What can be clicked is right at once: it may come into sight at any moment.
    const changed = may !== this.may || hands !== this.hands;
    this.may = may;
    this.hands = hands;
    this.parts.forEach((part, index) => {
      const seldom = !changed && part.element.isSeen === false && (this.states + index) % SELDOM;
      if (!seldom) part.update(state, part instanceof World || part instanceof Floor ? hands : may);
    });
    for (const [area, chip] of this.chips) setAttribute(chip, "data-absent", area !== "all" && !state.areas[area].alive);
    setAttribute(this.element, "data-phase", phase);
  }

  key(input, pressed) {
    this.worlds[0]?.key(input, pressed);
  }

  close() {
    for (const part of this.parts) part.close?.();
  }
}
