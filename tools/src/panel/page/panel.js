// The page: tabs, who drives, notices, and the loop that shows the newest state.

import { whenUnknown } from "./admission.js";
import { Connection, token } from "./connection.js";
import { button, h, setAttribute, setText } from "./dom.js";
import { Gate } from "./gate.js";
import { HostView } from "./host.js";
import { holdButtons } from "./keys.js";
import { Overview } from "./overview.js";
import { hosts, phaseWords, pushState, setHosts } from "./state.js";
import { readColours } from "./trace.js";
import { ControlLock } from "./control_lock.js";
import { Tabs } from "./tabs.js";
import { currentLanguage, sentence, setLanguage, t } from "./words.js";

const TOAST_MS = 8000;
const GLANCE_MS = 100;
const $ = (id) => document.getElementById(id);

/** What is shown: a host's id or "all", and of each host the number of an area or "all". */
const shown = { host: null, areas: new Map() };
let view = null;
let due = false;
let isLost = false;
let drove = false;
let focused = null;

const connection = new Connection({
  hello(message) {
    setHosts(message);
    // Who only looks at several ones begins with all.
    const onlyLooks = message.hosts.length > 1 && message.hosts.every((host) => !host.driven && !host.hands);
    if (shown.host === null || (shown.host !== "all" && !hosts.has(shown.host))) shown.host = onlyLooks ? "all" : message.hosts[0]?.id ?? "all";
    setLost(false);
    // Nothing is to be stopped from here if other programs drive.
    const drives = message.hosts.some((host) => host.driven);
    setAttribute($("stop"), "hidden", !drives);
    control.hello(drives);
    gate.hello(message.hosts);
    look();
    rebuild();
  },
  state(message) {
    pushState(message);
    control.state(message);
    gate.update(message);
    schedule();
  },
  lost() {
    control.lost();
    gate.lost();
    for (const host of hosts.values()) host.lose();
    // What was seen last stays, in grey. Nothing of it can be used, and nothing moves that nobody sees.
    drove = false;
    view?.update(false);
    tabs.update(shown.host);
    view?.close();
    view = null;
    setLost(true);
    setText($("role"), t("lost"));
    setAttribute($("role"), "data-drives", false);
    setTitle();
    whenUnknown(() => setText($("lost-text"), t("unknownText")));
  },
  failed: toast,
});
const control = new ControlLock(connection, {
  freed: (why) => toast({ code: "", text: t(`freed-${why}`) }),
  // Nothing can be clicked any more when the stop returns.
  stopped: show,
});
const tabs = new Tabs($("tabs"), choose);
const take = button("", () => control.take(), { id: "take", class: "primary" });
const gate = new Gate($("disconnect"), $("ask"), (command) => connection.send(command));
const commands = { send: (command) => connection.send(command), ask: (command) => connection.ask(command) };

function schedule() {
  if (due) return;
  due = true;
  const draw = () =>
    requestAnimationFrame(() => {
      due = false;
      show();
    });
  // What many do at a glance need not be drawn at each state of one of them.
  if (view && shown.host === "all") setTimeout(draw, GLANCE_MS);
  else draw();
}

/** Tells the program what is shown: it sends more of one controller than of many. */
function look() {
  if (hosts.size > 1) connection.post({ do: "look", only: shown.host === "all" ? null : shown.host });
}

/** Makes everything anew: another language, another host, other extensions. */
function rebuild() {
  view?.close();
  view = null;
  document.documentElement.lang = currentLanguage();
  setText($("language"), t("language"));
  setAttribute($("language"), "aria-label", t("languageLabel"));
  setAttribute($("language"), "lang", currentLanguage() === "de" ? "en" : "de");
  setAttribute($("stop"), "title", t("stopHint"));
  setText($("stop-hint"), t("space"));
  setText($("lost-title"), t("lostTitle"));
  setText($("lost-text"), t("lostText"));
  setText($("kind"), t(`kind-${kind()}`));
  gate.make();
  tabs.make();
  const waits = token ? t(hosts.size ? "waiting" : "waitingForProgram") : t("noToken");
  $("main").replaceChildren(h("p", { class: "waiting" }, waits));
  schedule();
}

function choose(id) {
  shown.host = id;
  look();
  rebuild();
}

function chooseArea(area) {
  shown.areas.set(shown.host, area);
  rebuild();
}

/** What the page is for. */
function kind() {
  const all = [...hosts.values()];
  return !all.length || all.some((host) => host.driven) ? "panel" : all.some((host) => host.watched) ? "watch" : "shown";
}

/** What is shown comes first: tabs of browsers are short. */
function setTitle() {
  const what = isLost ? t("lost") : shown.host === "all" ? t("overview") : hosts.get(shown.host)?.title;
  const title = [what, `txt ${t(`kind-${kind()}`)}`].filter(Boolean).join(" – ");
  if (document.title !== title) document.title = title;
}

/** The view that fits to what is chosen and to what is there. */
function currentView() {
  if (shown.host === "all") return view ?? new Overview([...hosts.values()], choose);
  const host = hosts.get(shown.host);
  if (!host?.state) return null;
  if (view?.shape === HostView.shape(host)) return view;
  return new HostView(host, shown.areas.get(shown.host) ?? 0, chooseArea, commands);
}

function show() {
  if (isLost) return;
  const next = currentView();
  if (next && next !== view) {
    view?.close();
    view = next;
    $("main").replaceChildren(view.element);
  }
  showControls();
  tabs.update(shown.host);
  showRole();
  setTitle();
}

/** The view, whose controls are disabled while this page does not drive. */
function showControls() {
  const drives = control.mine;
  const changed = drives !== drove;
  drove = drives;
  if (changed && !drives) focused = document.activeElement;
  view?.update(drives);
  // What is disabled loses the keyboard's focus.
  if (changed && drives && document.activeElement === document.body) focused?.focus({ preventScroll: true });
}

function showRole() {
  const known = [...hosts.values()].some((host) => host.state);
  const isShown = ![...hosts.values()].some((host) => host.driven);
  const role = isShown ? shownRole() : control.mine ? "driving" : control.comes ? "coming" : "looking";
  setText($("role"), known ? t(role) : "");
  setAttribute($("role"), "data-drives", control.mine);
  setAttribute($("banner"), "hidden", !known || role !== "looking");
  const other = control.driver !== null;
  setText($("driver"), other ? t("driverOther", { page: control.driver }) : t("driverNobody"));
  // It stays the same button, so that a click is not lost while its text changes.
  setText(take, t(other ? "takeOver" : "drive"));
}

/** What drives where no page does: of all controllers, or of the one that is looked at. */
function shownRole() {
  const chosen = shown.host === "all" ? [...hosts.values()] : [hosts.get(shown.host)];
  const states = chosen.map((host) => host?.state).filter(Boolean);
  if (!states.length || states.some(({ link }) => link.phase !== "idle")) return "shown";
  return states.map(phaseWords).includes("idleOn") ? "idleOn" : "idle";
}

function setLost(lost) {
  isLost = lost;
  $("lost").hidden = !lost;
  $("main").inert = lost;
  $("banner").inert = lost;
}

/** Shows an error for some seconds. The same one twice is shown once. */
function toast(error) {
  // The user has pressed the stop, and knows.
  if (error.code === "stopped") return;
  const text = sentence(error);
  for (const old of $("toasts").children) if (old.firstChild.textContent === text) old.remove();
  const one = h("div", { class: "toast" }, h("span", {}, text), button("×", () => one.remove(), { class: "quiet", "aria-label": t("dismiss") }));
  $("toasts").append(one);
  setTimeout(() => one.remove(), TOAST_MS);
}

$("language").addEventListener("click", () => {
  setLanguage(currentLanguage() === "de" ? "en" : "de");
  rebuild();
});

holdButtons(() => view);
readColours();
$("banner").append(take);
rebuild();
// Without the token there is nothing to wait for.
if (token) connection.open();
