// What the page knows of each host: its newest state, and the last ten seconds of its inputs.

import { History } from "./trace.js";

const AREAS = 9;
// The weight of the newest cycle in the one that is shown: single ones are in the histogram.
const SMOOTH = 0.05;

class Host {
  constructor({ id, address, simulated, driven, hands }) {
    this.id = id;
    this.address = address;
    this.simulated = simulated;
    // Whether this program drives it. Otherwise another one does.
    this.driven = driven;
    // Whether this page may press buttons of a simulated machine.
    this.hands = hands;
    this.state = null;
    this.lastError = null;
    this.cycle = null;
    this.seen = new Set([0]);
    this.histories = Array.from({ length: AREAS }, () => Array.from({ length: 8 }, () => new History()));
  }

  push(state) {
    state.areas.forEach((area, index) => {
      if (area.alive) this.seen.add(index);
      area.inputs.forEach((input, number) => {
        const history = this.histories[index][number];
        const before = this.state?.areas[index]?.inputs[number];
        // Other units: the old values say nothing.
        if (before && (before.mode !== input.mode || before.digital !== input.digital)) history.clear();
        history.push(state.at, input.value);
      });
    });
    this.cycle = this.cycle === null ? state.link.cycle_ms : this.cycle + (state.link.cycle_ms - this.cycle) * SMOOTH;
    this.lastError = state.link.error ?? this.lastError;
    this.state = state;
  }

  /** The time of a cycle in ms, as a text. */
  get pace() {
    return (this.cycle ?? 0).toFixed(1);
  }

  /** The host's name for people. */
  get title() {
    const name = this.state?.link.name;
    if (!name) return this.address;
    const namesakes = [...hosts.values()].some((other) => other !== this && other.state?.link.name === name);
    return namesakes ? `${name} · ${this.address}` : name;
  }
}

/** The hosts by id, in the order of the command line. */
export const hosts = new Map();

export function setHosts(list) {
  // After a reconnection they are most often the same ones, and their lines go on.
  const before = new Map(hosts);
  hosts.clear();
  for (const info of list) {
    const known = before.get(info.id);
    hosts.set(info.id, known && known.address === info.address ? known : new Host(info));
  }
}

export function pushState(state) {
  hosts.get(state.host)?.push(state);
}
