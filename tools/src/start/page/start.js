// The start page: what was found, and what can be started. What was started is a page of its own.

import { button, h, setAttribute, setText } from "./dom.js";

const ASK_MS = 1000;
const token = window.panelToken;
const $ = (id) => document.getElementById(id);

const WORDS = {
  en: {
    language: "Deutsch", quit: "End txt", quitHint: "Ends all that was started here; the motors stop",
    running: "Started here", end: "End", endOf: "End: {name}", programs: "for programs: {address}",
    controllers: "Controllers", searching: "Searching …", none: "None has answered. Is it switched on, and connected by USB, Wi-Fi or Bluetooth?",
    inUse: "perhaps in use by another program", panel: "Panel", panelOf: "Panel: {name}", again: "Search again", other: "Other address",
    simulated: "Without a controller", simulatedNote: "A simulated TXT with a machine: drive it here, or start it for your program.",
    world: "Machine", drive: "Drive", program: "For my program", lessons: "Lessons",
    "this machine": "this computer", network: "network",
    starting: "Starting …", over: "txt has ended. You can close this page.", noToken: "This address has no token. Open the address that txt prints.",
    "of-panel": "Panel: {name}", "of-world": "Panel: simulated, {name}", "of-simulate": "Simulated: {name}", "of-lesson": "Lessons, from {name} on",
  },
  de: {
    language: "English", quit: "txt beenden", quitHint: "Beendet alles, was hier gestartet wurde; die Motoren halten an",
    running: "Hier gestartet", end: "Beenden", endOf: "Beenden: {name}", programs: "für Programme: {address}",
    controllers: "Controller", searching: "Sucht …", none: "Keiner hat geantwortet. Ist er eingeschaltet und mit USB, WLAN oder Bluetooth verbunden?",
    inUse: "vielleicht von einem anderen Programm benutzt", panel: "Panel", panelOf: "Panel: {name}", again: "Noch einmal suchen", other: "Andere Adresse",
    simulated: "Ohne Controller", simulatedNote: "Ein simulierter TXT mit einer Maschine: hier steuern, oder für dein Programm starten.",
    world: "Maschine", drive: "Steuern", program: "Für mein Programm", lessons: "Lektionen",
    "this machine": "dieser Computer", network: "Netz", "Wi-Fi": "WLAN",
    starting: "Startet …", over: "txt ist beendet. Du kannst diese Seite schließen.", noToken: "In dieser Adresse fehlt das Token. Öffne die Adresse, die txt ausgibt.",
    "of-panel": "Panel: {name}", "of-world": "Panel: simuliert, {name}", "of-simulate": "Simuliert: {name}", "of-lesson": "Lektionen, ab {name}",
  },
};

let language = navigator.language.toLowerCase().startsWith("de") ? "de" : "en";
let state = null;
let found = null;
let shown = "";
/** What the notice says: the key of a word, or a sentence of the program. */
let said = "";

const w = (key, values = {}) => WORDS[language][key].replace(/\{(\w+)\}/g, (_, name) => values[name]);

/** How a controller is reached, in the words of `txt find`. */
const wayWord = (way) => WORDS[language][way] ?? way;

function say(text) {
  said = text;
  setText($("notice"), WORDS[language][said] ?? said);
  setAttribute($("notice"), "hidden", !said);
}

/** Asks the program; an error is a sentence, or that it has ended. */
async function ask(path, method = "POST") {
  const address = `${path}${path.includes("?") ? "&" : "?"}token=${encodeURIComponent(token)}`;
  const response = await fetch(address, { method }).catch(() => null);
  if (!response) throw new Error("over");
  if (!response.ok) throw new Error((await response.text()).trim());
  return response.status === 204 ? null : response.json();
}

async function open(kind, name) {
  say("starting");
  try {
    const { url } = await ask(`/open?kind=${kind}&name=${encodeURIComponent(name)}`);
    say("");
    location.assign(url);
  } catch (error) {
    say(error.message);
  }
}

async function search() {
  found = null;
  show();
  try {
    found = await ask("/find");
  } catch (error) {
    found = { controllers: [], others: [] };
    say(error.message);
  }
  show();
}

async function poll() {
  try {
    state = await ask("/state", "GET");
    if (said === "over") say("");
    show();
  } catch (error) {
    say(error.message);
  }
  $("start").inert = said === "over";
  setTimeout(poll, ASK_MS);
}

/** Shows all anew when something is different. */
function show() {
  const key = JSON.stringify([language, state, found]);
  if (!state || key === shown) return;
  shown = key;
  document.documentElement.lang = language;
  for (const element of document.querySelectorAll("[data-word]")) setText(element, w(element.dataset.word));
  setAttribute($("quit"), "title", w("quitHint"));
  setText($("language"), w("language"));
  setAttribute($("language"), "lang", language === "de" ? "en" : "de");
  say(said);
  showRunning();
  showFound();
  if (!$("world").options.length) $("world").append(...state.worlds.map((name) => h("option", { value: name }, name.replaceAll("_", " "))));
  $("lessons").replaceChildren(...state.lessons.map(({ number, title }) =>
    h("li", {}, button(`${number}. ${title[language]}`, () => open("lesson", number)))));
}

function showRunning() {
  $("running-card").hidden = state.running.length === 0;
  $("running").replaceChildren(...state.running.map(({ id, kind, name, url, address }) => {
    const title = w(`of-${kind}`, { name });
    const end = () => ask(`/end?id=${id}`).catch((error) => say(error.message));
    return h("li", {}, h("span", {}, h("a", { href: url }, title), address ? h("small", {}, ` ${w("programs", { address })}`) : null),
      button(w("end"), end, { class: "small", "aria-label": w("endOf", { name: title }) }));
  }));
}

function showFound() {
  const { controllers, others } = found ?? { controllers: [], others: [] };
  const inUse = others.filter((other) => other.perhaps_in_use);
  const row = (address, text) => h("li", {}, h("span", {}, address, h("small", {}, ` ${text}`)),
    button(w("panel"), () => open("panel", address), { class: "primary", "aria-label": w("panelOf", { name: address }) }));
  $("found").replaceChildren(
    ...controllers.map(({ address, name, way, firmware }) => row(address, `${name}, ${wayWord(way)}, ${firmware}`)),
    ...inUse.map(({ address, way }) => row(address, `${wayWord(way)}, ${w("inUse")}`)));
  setText($("searched"), found ? (controllers.length + inUse.length ? "" : w("none")) : w("searching"));
  $("again").disabled = !found;
}

$("language").addEventListener("click", () => {
  language = language === "de" ? "en" : "de";
  show();
});
$("quit").addEventListener("click", () => ask("/quit").catch(() => {}));
$("again").addEventListener("click", search);
$("drive").addEventListener("click", () => open("world", $("world").value));
$("program").addEventListener("click", () => open("simulate", $("world").value));
$("other").addEventListener("submit", (event) => {
  event.preventDefault();
  if ($("address").value.trim()) open("panel", $("address").value.trim());
});

if (token) {
  poll();
  search();
} else say("noToken");
