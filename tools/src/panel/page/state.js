// What the page knows of each host: its newest state, and the last ten seconds of its inputs.

import { History } from "./trace.js";

const AREAS = 9;

class Host {
  constructor({ id, address, simulated }) {
    this.id = id;
    this.address = address;
    this.simulated = simulated;
    this.state = null;
    this.histories = Array.from({ length: AREAS }, () => Array.from({ length: 8 }, () => new History()));
  }

  push(state) {
    state.areas.forEach((area, index) => {
      area.inputs.forEach((input, number) => {
        const history = this.histories[index][number];
        const before = this.state?.areas[index]?.inputs[number];
        // Other units: the old values say nothing.
        if (before && (before.mode !== input.mode || before.digital !== input.digital)) history.clear();
        history.push(state.at, input.value);
      });
    });
    this.state = state;
  }

  /** The host's name for people. */
  get title() {
    return this.state?.link.name || this.address;
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
