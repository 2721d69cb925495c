// What the page knows of each host: its newest state, and the last ten seconds of its inputs.

import { Names } from "./names.js";
import { History } from "./trace.js";

const AREAS = 9;
// The weight of the newest cycle in the one that is shown: single ones are in the histogram.
const SMOOTH = 0.05;

/** The time of a cycle, `null` while there are none. */
function smoothed(before, { phase, cycle_ms: now }) {
  if (phase !== "running" || !now) return null;
  return before === null ? now : before + (now - before) * SMOOTH;
}

/** Whether another controller answers than before. */
function isAnother(now, before) {
  return Boolean(now.name && before?.name) && now.name !== before.name;
}

/** Whether a state brings what a response has measured, and not once more what was known. */
function brings({ link }, before) {
  return [link, before?.link].some((one) => one?.phase !== "running") || link.cycles !== before.link.cycles;
}

class Host {
  constructor({ id, address, simulated, driven, hands, watched, names }) {
    this.id = id;
    this.address = address;
    this.simulated = simulated;
    // Whether this program drives it. Otherwise another one does.
    this.driven = driven;
    // Whether this page may press buttons of a simulated machine.
    this.hands = hands;
    // Whether another program drives it through this one, which can end that.
    this.watched = watched;
    // What people call its terminals, by area.
    this.names = Array.from({ length: AREAS }, (_, area) => new Names(names[area]));
    this.state = null;
    // What the plotter knows of it, while it is open.
    this.plotted = null;
    this.lastError = null;
    this.cycle = null;
    this.seen = new Set([0]);
    this.histories = Array.from({ length: AREAS }, () => Array.from({ length: 8 }, () => new History()));
  }

  push(state) {
    // The next program that is watched, perhaps at another controller.
    if (state.watched?.program !== this.state?.watched?.program || isAnother(state.link, this.state?.link)) this.forget();
    const isNew = brings(state, this.state);
    state.areas.forEach((area, index) => {
      if (area.alive) this.seen.add(index);
      area.inputs.forEach((input, number) => {
        const history = this.histories[index][number];
        const before = this.state?.areas[index]?.inputs[number];
        // Other units: the old values say nothing.
        if (before && (before.mode !== input.mode || before.digital !== input.digital)) history.clear();
        if (isNew) history.push(state.at, area.alive ? input.value : null);
      });
    });
    this.plotted?.push(state, isNew);
    this.cycle = smoothed(this.cycle, state.link);
    // That of a program that is watched is told until the next one is online.
    if (state.link.error || state.watched) this.lastError = state.link.error;
    this.state = state;
  }

  forget() {
    this.cycle = null;
    this.seen = new Set([0]);
    this.histories.flat().forEach((history) => history.clear());
    if (this.plotted) this.plotted.size = 0;
  }

  /** Nothing is known of it any more. Its last values stay to be read. */
  lose() {
    this.cycle = null;
    if (this.state) this.state = { ...this.state, link: { ...this.state.link, phase: "lost" } };
  }

  /** What is wrong now. What is told of a connection that need not be the program's gives way to what is told of the program. */
  get error() {
    return this.state?.link.error ?? this.state?.watched?.beside;
  }

  /** The host's name for people. */
  get title() {
    const name = this.state?.link.name;
    if (!name) return this.address;
    return this.hasNamesake ? `${name} · ${this.address}` : name;
  }

  /** A short name, which only this host has. */
  get shortTitle() {
    return this.hasNamesake ? this.address : this.title;
  }

  get hasNamesake() {
    const name = this.state?.link.name;
    return [...hosts.values()].some((other) => other !== this && other.state?.link.name === name);
  }
}

/** The hosts by id, in the order of the command line. */
export const hosts = new Map();

// When the program was started that has sent them.
let began = null;

export function setHosts(hello) {
  // After a reconnection they are most often the same ones, and their lines go on.
  const before = new Map(hello.began === began ? hosts : []);
  began = hello.began;
  hosts.clear();
  for (const info of hello.hosts) {
    const known = before.get(info.id);
    hosts.set(info.id, known && known.address === info.address ? known : new Host(info));
  }
}

export function pushState(state) {
  hosts.get(state.host)?.push(state);
}

/** The words for the phase of a controller: what a program has left on stays on when it is gone. */
export function phaseWords({ link: { phase }, areas }) {
  const isOn = areas.some(({ alive, motors }) => alive && motors.some(({ duty }) => duty.some(Boolean)));
  return phase === "idle" && isOn ? "idleOn" : phase;
}
