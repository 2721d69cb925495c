// The page of a lesson: its task, its machine, and the steps of the check, which are ticked while the program runs.

import { Connection, token } from "./connection.js";
import { button, h, setAttribute, setText } from "./dom.js";
import { Floor } from "./floor.js";
import { holdButtons } from "./keys.js";
import { hosts, phaseWords, pushState, setHosts } from "./state.js";
import { readColours } from "./trace.js";
import { currentLanguage, setLanguage, t } from "./words.js";
import { World } from "./world.js";

const ASK_MS = 300;
const $ = (id) => document.getElementById(id);

const WORDS = {
  en: {
    title: "Lesson", steps: "Check", ok: "right", wrong: "wrong", now: "being tried",
    idle: "Press “Check”, then start your program with the address of this machine:",
    idleAgain: "Change your program, press “Check”, and start it again:",
    waiting: "Now start your program. If it runs already, end it and start it again:",
    waitingHere: "The program is being started …",
    running: "The check presses the buttons. Let your program run.",
    solved: "Solved.", hint: "Hint: {text}", check: "Check", end: "End the check", next: "Next lesson", before: "Lesson before",
    old: "This address is not known here: the program was started anew, and has other addresses. Ask for the new one.",
    over: "The page does not reach its program: it has ended, or the network is gone. What it said last stays here.", noToken: "This address has no token. Open the address that the program prints.",
    online: "Your program is connected",
  },
  de: {
    title: "Lektion", steps: "Prüfung", ok: "richtig", wrong: "falsch", now: "wird geprüft",
    idle: "Drück auf „Prüfen“ und starte dann dein Programm mit der Adresse dieser Maschine:",
    idleAgain: "Ändere dein Programm, drück auf „Prüfen“ und starte es noch einmal:",
    waiting: "Starte jetzt dein Programm. Läuft es schon, beende es und starte es neu:",
    waitingHere: "Das Programm wird gestartet …",
    running: "Die Prüfung drückt die Taster. Lass dein Programm laufen.",
    solved: "Geschafft!", hint: "Tipp: {text}", check: "Prüfen", end: "Prüfung beenden", next: "Nächste Lektion", before: "Lektion davor",
    old: "Diese Adresse ist hier unbekannt: Das Programm wurde neu gestartet und hat andere Adressen. Frag nach der neuen.",
    over: "Die Seite erreicht ihr Programm nicht: Es ist zu Ende, oder das Netz fehlt. Was es zuletzt gesagt hat, bleibt hier stehen.", noToken: "In dieser Adresse fehlt das Token. Öffne die Adresse, die das Programm ausgibt.",
    online: "Dein Programm ist verbunden",
  },
};

/** A word in the language of the page. */
function w(key, values = {}) {
  return WORDS[currentLanguage()][key].replace(/\{(\w+)\}/g, (_, name) => values[name]);
}

/** What has both languages. */
const said = (words) => words[currentLanguage()];

/** The machine with its buttons, and below it what the controller reads and sends. */
class Machine {
  constructor(host, send) {
    const { state: now } = host;
    this.shape = Machine.shape(now);
    this.host = host;
    this.worlds = now.world?.boards[0] ? [new World(host, 0, now, send)] : [];
    this.floors = now.world?.floor ? [new Floor(host, now, send)] : [];
    this.values = new Map();
    this.list = h("ul", { class: "card values" });
    this.element = h("div", { class: "machine" }, [...this.worlds, ...this.floors].map((part) => part.element), this.list);
  }

  /** Another shape needs another view. */
  static shape(now) {
    return World.shape(now, 0) + Floor.shape(now);
  }

  update() {
    const { state: now, hands } = this.host;
    for (const part of [...this.worlds, ...this.floors]) part.update(now, hands);
    const [{ inputs, counters, motors }] = now.areas;
    inputs.forEach(({ value }, index) => this.value(`I${index + 1}`, value));
    counters.forEach(({ value }, index) => this.value(`C${index + 1}`, value));
    motors.forEach(({ outputs, duty: [first, second] }, index) => {
      this.value(`M${index + 1}`, outputs ? null : first - second);
      this.value(`O${2 * index + 1}`, outputs ? first : null);
      this.value(`O${2 * index + 2}`, outputs ? second : null);
    });
  }

  /** Shows a value by its terminal's name; `null` for one that does not exist now. */
  value(name, value) {
    if (!this.values.has(name)) {
      const shown = h("b", {});
      const item = h("li", {}, `${name} `, this.host.names[0].small(name), shown);
      this.values.set(name, { shown, item });
      this.list.append(item);
    }
    const { shown, item } = this.values.get(name);
    setAttribute(item, "hidden", value === null);
    setText(shown, String(value ?? ""));
  }

  key(input, pressed) {
    this.worlds[0]?.key(input, pressed);
  }

  close() {
    for (const part of [...this.worlds, ...this.floors]) part.close?.();
  }
}

let state = null;
let began = null;
let view = null;
let made = "";
let shownSteps = "";

const connection = new Connection({
  hello(message) {
    // After a new start the pupil, the lesson and the address may be others.
    if (began && began !== message.began) location.reload();
    ({ began } = message);
    setHosts(message);
    dropView();
  },
  state(message) {
    pushState(message);
    setLost(false);
    showMachine();
  },
  lost() {
    for (const host of hosts.values()) host.lose();
    setLost(true);
    showMachine();
  },
  failed() {},
});

function dropView() {
  view?.close();
  view = null;
}

/** What was seen last stays, in grey. Nothing of it can be used. */
function setLost(lost) {
  for (const part of ["machine", "check"]) $(part).inert = lost;
}

function showMachine() {
  const [host] = hosts.values();
  if (!host?.state) return;
  if (view?.shape !== Machine.shape(host.state)) {
    dropView();
    view = new Machine(host, (command) => connection.send(command));
    $("machine").replaceChildren(view.element);
  }
  view.update();
  const { phase } = host.state.link;
  setText($("role"), phase === "running" ? w("online") : t(phase === "lost" ? "lost" : phaseWords(host.state)));
}

/** A sentence in which code stands between backticks. */
function withCode(text) {
  return text.split("`").map((part, index) => index % 2 ? h("code", {}, part) : part);
}

/** Asks for the state of the lesson, again and again. */
async function ask() {
  try {
    const answer = await fetch(`/lesson/state?token=${encodeURIComponent(token)}`, { signal: AbortSignal.timeout(5000) });
    if (answer.ok) {
      state = await answer.json();
      notice("");
    } else if (answer.status === 403) notice("old");
    // The pupil has no lesson any more.
    else if (answer.status === 404) location.replace(`/?token=${encodeURIComponent(token)}`);
  } catch {
    notice("over");
  }
  show();
  setTimeout(ask, ASK_MS);
}

function post(what) {
  fetch(`/lesson/${what}?token=${encodeURIComponent(token)}`, { method: "POST" }).catch(() => notice("over"));
}

function notice(key) {
  setText($("notice"), key && w(key));
  setAttribute($("notice"), "hidden", !key);
}

function show() {
  if (!state) return;
  const key = JSON.stringify([currentLanguage(), state.number, state.whose]);
  if (key !== made) {
    made = key;
    document.documentElement.lang = currentLanguage();
    // In a class it is a pupil's.
    const whose = state.whose ? [state.whose] : [];
    document.title = [...whose, `${w("title")} ${state.number}: ${said(state.title)}`].join(" – ");
    setText($("title"), `${w("title")} ${state.number}`);
    setText($("whose"), state.whose ?? "");
    setAttribute($("whose"), "title", state.whose || null);
    setText($("language"), t("language"));
    setAttribute($("language"), "lang", currentLanguage() === "de" ? "en" : "de");
    // It comes from the documents of this program.
    $("task").innerHTML = said(state.task);
    shownSteps = "";
  }
  const steps = JSON.stringify([state.check, state.checking, state.may_check, state.address]);
  if (steps === shownSteps) return;
  shownSteps = steps;
  showSteps(state);
}

function showSteps({ number, count, check, checking, may_check: mayCheck, address, program }) {
  const focused = document.activeElement?.dataset?.what;
  const { phase, steps, note, wrong } = check;
  const text = phase === "idle" ? "idle" : phase === "waiting" ? (mayCheck ? "waiting" : "waitingHere") : phase === "running" ? "running" : phase === "wrong" && mayCheck ? "idleAgain" : "";
  const line = ({ words, sign }) => h("li", { "data-sign": sign }, h("span", {}, said(words), h("span", { class: "sr" }, ` (${w(sign)})`)));
  const one = (what, clicked, properties = {}) => button(w(what), clicked, { "data-what": what, ...properties });
  const isSolved = phase === "solved";
  const buttons = !mayCheck ? [] : [
    checking ? one("end", () => post("end")) : one("check", () => post("check"), { class: isSolved ? "" : "primary" }),
    number > 1 ? one("before", () => post(`go/${number - 1}`)) : null,
    number < count ? one("next", () => post(`go/${number + 1}`), { class: isSolved ? "primary" : "" }) : null,
  ];
  $("check").replaceChildren(...[
    h("h2", {}, w("steps")),
    note ? h("p", { class: "hint" }, said(note)) : null,
    steps.length ? h("ol", {}, steps.map(line)) : null,
    isSolved ? h("p", { class: "verdict" }, w("solved")) : null,
    wrong ? h("p", { class: "verdict" }, said(wrong.what)) : null,
    wrong?.hint ? h("p", { class: "hint" }, withCode(w("hint", { text: said(wrong.hint) }))) : null,
    wrong?.note ? h("p", { class: "hint" }, said(wrong.note)) : null,
    text ? h("p", { class: "note" }, w(text)) : null,
    // A program that is started here needs nobody to start it.
    mayCheck && text && text !== "running" ? h("p", { class: "command" }, h("code", {}, `cargo run --bin ${said(program)} -- ${address}`)) : null,
    h("div", { class: "buttons" }, buttons),
  ].filter(Boolean));
  if (focused) $("check").querySelector(`[data-what="${focused}"]`)?.focus({ preventScroll: true });
}

$("language").addEventListener("click", () => {
  setLanguage(currentLanguage() === "de" ? "en" : "de");
  dropView();
  show();
  showMachine();
});

holdButtons(() => view);
readColours();
setText($("language"), t("language"));
// What it would ask for first may have come with it.
const early = $("state");
if (token && early) {
  state = JSON.parse(early.textContent);
  show();
}
if (token) {
  connection.open();
  ask();
} else notice("noToken");
