// All words of the page, in both languages.

import { hosts } from "./state.js";

const ENGLISH = {
  stopHint: "Stop all motors and lamps (space bar)",
  space: "space",
  language: "Deutsch", languageLabel: "Deutsch: Seite auf Deutsch zeigen",
  hosts: "Controllers", all: "All", areas: "Master and extensions", master: "TXT", extension: "Extension",
  driving: "You drive", coming: "One moment …", looking: "Looking only", shown: "Another program drives",
  driverOther: "Page {page} drives. Here you can look.", driverNobody: "Nobody drives. The motors are off.",
  "freed-silent": "The program heard nothing from this page for a second, so the motors were stopped.",
  "freed-hang": "The program hung for a moment, so the motors were stopped.",
  "freed-stop": "Somebody else has stopped the motors.",
  takeOver: "Take over", drive: "Drive",
  "kind-panel": "panel", "kind-watch": "watch", "kind-shown": "simulation",
  disconnect: "Disconnect the program", admit: "Let programs in", cancel: "Cancel",
  disconnectTitle: "Disconnect the program?",
  disconnectText: "Its connections end, and all motors and lamps go off. Programs stay out until you let them in again.",
  shut: "The program was disconnected here. Until you let programs in, each that comes is refused.",
  lostTitle: "No connection to the program",
  lostText: "It has ended or does not answer. Its end switches all motors off; if it was killed, they may go on. This page keeps trying. If you start it again and it prints another address, open that one.",
  dismiss: "Close message",
  connecting: "Connecting", idle: "No program is connected", idleOn: "No program is connected, outputs are still on", running: "Connected", gap: "Reconnecting", lost: "No connection", ended: "Ended", unclear: "Not understood",
  simulated: "simulated", waiting: "Waiting for the first values …", waitingForProgram: "Waiting for the program …",
  noToken: "This address has no token. Open the address that the program prints.",

  inputs: "Inputs", modeOf: "Mode of {name}", lineOf: "{name}, last ten seconds",
  "resistance/1": "Button 5 kΩ", "voltage/1": "Trail 10 V", "resistance15k/1": "Button 15 kΩ", "ultrasonic/1": "Echo yes/no",
  "resistance/0": "Resistance 5 kΩ", "resistance15k/0": "Resistance 15 kΩ", "voltage/0": "Voltage 10 V", "ultrasonic/0": "Distance",
  overrun: "over range", on: "on", off: "off",
  counters: "Counters", reset: "Reset {name}", resetShort: "reset",
  normal: "normal", inverted: "inverted",
  outputs: "Outputs", asMotor: "Motor", asOutputs: "2 outputs", kindOf: "What is on {name}",
  left: "{name} backwards", right: "{name} forward", stopOf: "Stop {name}", speedOf: "Speed of {name}", dutyOf: "Value of {name}",
  distance: "Distance", pulses: "pulses", pulsesOf: "Pulses for {name}", alone: "alone", withOf: "Motor that runs together with {name}",
  go: "Go", goOf: "Go this distance with {name}", progressOf: "Distance of {name}", together: "with {name}", against: "against {name}", pulsesHint: "Two motors together: 0 means no end",
  stands: "stands", forward: "forward {duty}", backwards: "backwards {duty}",
  switchOf: "Switch {name}", absent: "{name} is not connected",

  world: "The machine", worldHint: "Hold a button with the mouse, or with the keys 1 to 8.",
  pieces: "Workpieces", floorHint: "Click a place to put a workpiece there, or to take it away.", beltOf: "Belt of {name}", drawing: "Drawing of the machine", container: "container", filled: "{piece} with {content}",
  red: "red", blue: "blue", pieceAt: "{name}: {piece}", nothingAt: "{name}: empty", carriedBy: "{by} carries: {piece}", fallen: "{count} fell.",
  press: "Press {name}", plugIn: "Plug in", plugOut: "Unplug", plug: "Plug {name} in or out",
  button: "Button", switch: "Switch", photo_transistor: "Light", ntc: "Temperature", voltage: "Voltage", ultrasonic: "Distance",
  trail: "Trail sensor", colour: "Colour sensor", resistor: "Resistor", black: "black", white: "white",
  motorOf: "Motor {name}, {speed} turns per second", slideOf: "Slide of {name}, at {place} %", lampOf: "Lamp {name}, {glow} %",
  remote: "Remote {number}", remotes: "Remotes", remoteAny: "Any remote",
  leftStick: "left joystick", rightStick: "right joystick", dip: "DIP {number}",
  onKey: "ON", offKey: "OFF",

  link: "Connection", firmware: "Firmware", address: "Address", cycle: "Cycle", cycles: "Cycles", late: "Late reactions",
  answer: "Answers of the program", answerTime: "{median} ms, longest {longest} ms", commands: "Commands",
  gaps: "Gaps", noError: "No error.", lastError: "Last error: {text}", histogram: "Time from cycle to cycle", perBin: "{ms} ms: {count} cycles",
  sound: "Sounds", play: "Play", silence: "Silence", repeat: "times", soundLabel: "Sound", repeatLabel: "How often", playing: "Sound {number} plays.", quiet: "Quiet.", microphone: "Microphone: {level}",
  camera: "Camera", cameraOn: "Start", cameraOff: "Stop", size: "Picture size", rate: "Pictures per second", frames: "{count} pictures", cameraIdle: "The camera is off.", noPicture: "No picture yet.", picture: "Picture of the camera",
  i2c: "I2C", i2cNone: "Nothing has passed yet.", i2cPassed: "{device}: wrote {written}, read {read}", noDevice: "no device answered", scan: "Scan", scanning: "Scanning …", found: "Devices: {list}", foundNone: "No device answers.",
  device: "Device", register: "Register", count: "Bytes", values: "Values", read: "Read", write: "Write", written: "Written.",
  hexHint: "0x18 or 24; values with commas", badNumber: "“{text}” is not a number from {least} to {most}.", noNumber: "Type a number from {least} to {most}.",
  plotter: "Plotter", plotHint: "Click a value to see it over time.",
  recording: "Recording", record: "Record", recordStop: "Stop recording",
  recordHint: "Into a file in the folder where txt was started, with the 60 s before the click.",
  "record-on": "Recording into {file}", "record-ending": "Ending {file}", "record-off": "Recorded: {file}", recordTime: "{time} and the {before} s before",
  overview: "All controllers", somebody: "Page {page} drives", nobody: "Nobody drives",
  inLesson: "Lesson {number}", passed: "passed: {list}", nonePassed: "none passed yet", stuck: "stuck: wrong {count} times", lastWrong: "last wrong {ago}", agoEarlier: "before the last start", agoNow: "just now", agoMinutes: "{count} min ago",
  unknownText: "This address is not known here: the program was started anew, and has other addresses. Ask for the new one, or open the one that the program prints.",
};

const GERMAN = {
  stopHint: "Alle Motoren und Lampen aus (Leertaste)",
  space: "Leertaste",
  language: "English", languageLabel: "English: show the page in English",
  hosts: "Controller", all: "Alle", areas: "Master und Erweiterungen", master: "TXT", extension: "Erweiterung",
  driving: "Du steuerst", coming: "Einen Moment …", looking: "Nur ansehen", shown: "Ein anderes Programm steuert",
  driverOther: "Seite {page} steuert. Hier kannst du zusehen.", driverNobody: "Niemand steuert. Die Motoren sind aus.",
  "freed-silent": "Das Programm hat eine Sekunde lang nichts von dieser Seite gehört, deshalb sind die Motoren aus.",
  "freed-hang": "Das Programm hing einen Moment lang, deshalb sind die Motoren aus.",
  "freed-stop": "Jemand anders hat die Motoren angehalten.",
  takeOver: "Übernehmen", drive: "Steuern",
  "kind-panel": "panel", "kind-watch": "watch", "kind-shown": "Simulation",
  disconnect: "Programm trennen", admit: "Programme einlassen", cancel: "Abbrechen",
  disconnectTitle: "Das Programm trennen?",
  disconnectText: "Seine Verbindungen enden, und alle Motoren und Lampen gehen aus. Programme bleiben draußen, bis du sie wieder einlässt.",
  shut: "Das Programm wurde hier getrennt. Bis du Programme einlässt, wird jedes abgewiesen, das kommt.",
  lostTitle: "Keine Verbindung zum Programm",
  lostText: "Es wurde beendet oder antwortet nicht. Sein Ende schaltet alle Motoren aus; wurde es gewaltsam beendet, können sie weiterlaufen. Diese Seite versucht es weiter. Wenn du es neu startest und es eine andere Adresse ausgibt, öffne diese.",
  dismiss: "Meldung schließen",
  connecting: "Verbindet", idle: "Kein Programm ist verbunden", idleOn: "Kein Programm ist verbunden, Ausgänge sind noch an", running: "Verbunden", gap: "Verbindet neu", lost: "Keine Verbindung", ended: "Beendet", unclear: "Nicht verstanden",
  simulated: "simuliert", waiting: "Wartet auf die ersten Werte …", waitingForProgram: "Wartet auf das Programm …",
  noToken: "In dieser Adresse fehlt das Token. Öffne die Adresse, die das Programm ausgibt.",

  inputs: "Eingänge", modeOf: "Betriebsart von {name}", lineOf: "{name}, die letzten zehn Sekunden",
  "resistance/1": "Taster 5 kΩ", "voltage/1": "Spur 10 V", "resistance15k/1": "Taster 15 kΩ", "ultrasonic/1": "Echo ja/nein",
  "resistance/0": "Widerstand 5 kΩ", "resistance15k/0": "Widerstand 15 kΩ", "voltage/0": "Spannung 10 V", "ultrasonic/0": "Abstand",
  overrun: "zu groß", on: "an", off: "aus",
  counters: "Zähler", reset: "auf 0: {name}", resetShort: "auf 0",
  normal: "normal", inverted: "umgekehrt",
  outputs: "Ausgänge", asMotor: "Motor", asOutputs: "2 Ausgänge", kindOf: "Was an {name} hängt",
  left: "{name} rückwärts", right: "{name} vorwärts", stopOf: "{name} anhalten", speedOf: "Geschwindigkeit von {name}", dutyOf: "Wert von {name}",
  distance: "Strecke", pulses: "Impulse", pulsesOf: "Impulse für {name}", alone: "allein", withOf: "Motor, der mit {name} zusammen läuft",
  go: "Los", goOf: "Los: Strecke von {name}", progressOf: "Strecke von {name}", together: "mit {name}", against: "gegen {name}", pulsesHint: "Zwei Motoren zusammen: 0 ist ohne Ende",
  stands: "steht", forward: "vorwärts {duty}", backwards: "rückwärts {duty}",
  switchOf: "{name} schalten", absent: "{name} ist nicht angeschlossen",

  world: "Die Maschine", worldHint: "Taster mit der Maus halten, oder mit den Tasten 1 bis 8.",
  pieces: "Werkstücke", floorHint: "Auf einen Platz klicken, um ein Werkstück hinzulegen oder wegzunehmen.", beltOf: "Band von {name}", drawing: "Zeichnung der Maschine", container: "Behälter", filled: "{piece} mit {content}",
  red: "rot", blue: "blau", pieceAt: "{name}: {piece}", nothingAt: "{name}: leer", carriedBy: "{by} trägt: {piece}", fallen: "{count} heruntergefallen.",
  press: "{name} drücken", plugIn: "Anstecken", plugOut: "Abziehen", plug: "{name} anstecken oder abziehen",
  button: "Taster", switch: "Schalter", photo_transistor: "Licht", ntc: "Wärme", voltage: "Spannung", ultrasonic: "Abstand",
  trail: "Spursensor", colour: "Farbsensor", resistor: "Widerstand", black: "schwarz", white: "weiß",
  motorOf: "Motor {name}, {speed} Umdrehungen je Sekunde", slideOf: "Schlitten von {name}, bei {place} %", lampOf: "Lampe {name}, {glow} %",
  remote: "Fernbedienung {number}", remotes: "Fernbedienungen", remoteAny: "Irgendeine",
  leftStick: "linker Hebel", rightStick: "rechter Hebel", dip: "DIP {number}",
  onKey: "ON", offKey: "OFF",

  link: "Verbindung", firmware: "Firmware", address: "Adresse", cycle: "Zyklus", cycles: "Zyklen", late: "Späte Reaktionen",
  answer: "Antworten des Programms", answerTime: "{median} ms, längste {longest} ms", commands: "Befehle",
  gaps: "Lücken", noError: "Kein Fehler.", lastError: "Letzter Fehler: {text}", histogram: "Zeit von Zyklus zu Zyklus", perBin: "{ms} ms: {count} Zyklen",
  sound: "Klänge", play: "Spielen", silence: "Ruhe", repeat: "mal", soundLabel: "Klang", repeatLabel: "Wie oft", playing: "Klang {number} spielt.", quiet: "Still.", microphone: "Mikrofon: {level}",
  camera: "Kamera", cameraOn: "Starten", cameraOff: "Anhalten", size: "Bildgröße", rate: "Bilder je Sekunde", frames: "{count} Bilder", cameraIdle: "Die Kamera ist aus.", noPicture: "Noch kein Bild.", picture: "Bild der Kamera",
  i2c: "I2C", i2cNone: "Bisher war nichts.", i2cPassed: "{device}: geschrieben {written}, gelesen {read}", noDevice: "kein Gerät hat geantwortet", scan: "Suchen", scanning: "Sucht …", found: "Geräte: {list}", foundNone: "Kein Gerät antwortet.",
  device: "Gerät", register: "Register", count: "Bytes", values: "Werte", read: "Lesen", write: "Schreiben", written: "Geschrieben.",
  hexHint: "0x18 oder 24; Werte mit Komma", badNumber: "„{text}“ ist keine Zahl von {least} bis {most}.", noNumber: "Gib eine Zahl von {least} bis {most} ein.",
  plotter: "Plotter", plotHint: "Klicke auf einen Wert, um seinen Verlauf zu sehen.",
  recording: "Aufnahme", record: "Aufnehmen", recordStop: "Aufnahme beenden",
  recordHint: "In eine Datei in dem Ordner, in dem txt gestartet wurde, mit den 60 s vor dem Klick.",
  "record-on": "Nimmt auf in {file}", "record-ending": "Beendet {file}", "record-off": "Aufgenommen: {file}", recordTime: "{time} und die {before} s davor",
  overview: "Alle Controller", somebody: "Seite {page} steuert", nobody: "Niemand steuert",
  inLesson: "Lektion {number}", passed: "bestanden: {list}", nonePassed: "noch keine bestanden", stuck: "kommt nicht weiter: {count}-mal falsch", lastWrong: "zuletzt falsch {ago}", agoEarlier: "vor dem letzten Start", agoNow: "gerade eben", agoMinutes: "vor {count} min",
  unknownText: "Diese Adresse ist hier unbekannt: Das Programm wurde neu gestartet und hat andere Adressen. Frag nach der neuen, oder öffne die, die das Programm ausgibt.",
};

/** The modes of an input, in the order of a menu: what it measures, and 1 if it reports 0 or 1. */
export const INPUT_MODES = Object.keys(ENGLISH).filter((key) => /\/[01]$/.test(key));

/** The sounds 1 to 29, as delivered with the controller. */
const SOUNDS = {
  en: ["Airplane", "Alarm", "Bell", "Braking", "Car horn, long", "Car horn, short", "Crackling wood", "Excavator", "Fantasy 1", "Fantasy 2",
    "Fantasy 3", "Fantasy 4", "Farm", "Fire department", "Fire", "Formula 1", "Helicopter", "Hydraulics", "Motor", "Motor starting",
    "Propeller airplane", "Roller coaster", "Ship's horn", "Tractor", "Truck", "Wink", "Driving", "Head up", "Head tilts"],
  de: ["Flugzeug", "Alarm", "Glocke", "Bremsen", "Hupe, lang", "Hupe, kurz", "Knisterndes Holz", "Bagger", "Fantasie 1", "Fantasie 2",
    "Fantasie 3", "Fantasie 4", "Bauernhof", "Feuerwehr", "Feuer", "Formel 1", "Hubschrauber", "Hydraulik", "Motor", "Motor startet",
    "Propellerflugzeug", "Achterbahn", "Schiffshupe", "Traktor", "Lastwagen", "Augenzwinkern", "Fahrgeräusch", "Kopf heben", "Kopf neigen"],
};

/** Places of the worlds that the program brings. */
const GERMAN_PLACES = {
  before_ejectors: "vor den Auswerfern", before_valve: "vor dem Ventil", belt: "Band", belt_end: "Bandende", belt_inside: "Band innen", belt_outside: "Band außen",
  blue_ejector: "Auswerfer blau", blue_storage: "Lager blau", cantilever: "Ausleger", colour_sensor: "Farbsensor", delivery: "Anlieferung",
  entry: "Anfang", exit: "Ende", gripper: "Greifer", oven: "Ofen", pickup: "Abholung", red_ejector: "Auswerfer rot", red_storage: "Lager rot",
  rejected: "Ausschuss", rest: "die anderen", saw: "Säge", seat: "Sitz", storage: "Lager", table: "Drehtisch", table_at_belt: "Drehtisch am Band",
  vacuum_gripper: "Sauggreifer", valve: "Ventil", white_ejector: "Auswerfer weiß", white_storage: "Lager weiß",
};

/** German sentences for what goes wrong with workpieces, by their code. English ones come from the program. */
const GERMAN_MISHAPS = {
  falls_at: "{piece} fällt herunter: {place} kann nichts aufnehmen",
  falls_besides: "{piece} fällt herunter: {by} lässt los, wo kein Platz ist",
  jams_at_ejector: "{piece} klemmt bei {by}: {place} kann nichts aufnehmen",
  jams_on_belt: "{piece} staut sich auf dem Band von {by}: {place} kann nichts aufnehmen",
  not_gripped: "{by} greift nicht: {piece} ist noch bei {holder}",
  not_put_down: "{by} setzt nicht ab: {place} kann nichts aufnehmen",
  not_put_in: "{piece} wird nicht eingelegt: {place} kann nichts aufnehmen",
};

const GERMAN_PIECES = { white: "das weiße Werkstück", red: "das rote Werkstück", blue: "das blaue Werkstück", container: "der Behälter" };

/** German sentences for errors, by their code. English ones come from the program. */
const GERMAN_ERRORS = {
  absent: "Diese Erweiterung ist gerade nicht angeschlossen",
  bad_address: "Das ist keine Adresse",
  bad_answer: "Der Controller hat Unverständliches geantwortet; ist es wirklich ein TXT?",
  bad_message: "Das Programm hat die Nachricht der Seite nicht verstanden; lade die Seite neu",
  bad_picture: "Das Bild der Kamera ist beschädigt",
  busy: "Zu viele Befehle auf einmal; der letzte wurde nicht ausgeführt",
  camera_on: "Die Kamera läuft schon",
  camera_refused: "Der Controller nimmt keine Verbindung für die Kamera an; alles andere geht weiter",
  connect_failed: "Die Verbindung zum Controller kam nicht zustande",
  connection_broke: "Die Verbindung ist abgerissen; ist der Controller noch an und in Reichweite?",
  connect_timed_out: "Der Controller antwortet nicht; ist er eingeschaltet, und stimmt die Adresse?",
  connection_closed: "Der Controller hat die Verbindung beendet; ist er noch an, und benutzt ihn ein anderes Programm?",
  connection_lost: "Die Verbindung ist abgebrochen und wird wieder aufgebaut; Motoren laufen vielleicht bis dahin weiter, danach sind sie aus",
  connection_refused: "Dort ist kein Controller bereit; ist ein anderes Programm mit ihm verbunden?",
  firmware_too_old: "Die Firmware des Controllers ist zu alt",
  forgotten: "Mehr als 64 Befehle hatten gleichzeitig keine Antwort; ein Teil davon wird hier nicht gezeigt",
  disconnected: "Das Programm wurde von der Seite getrennt, und alle Ausgänge wurden ausgeschaltet",
  halted: "Der Controller hat keine Abmeldung des Programms bestätigt; alle Ausgänge wurden danach ausgeschaltet",
  replaced: "Hier antwortet ein anderer Controller als zuvor; die Motoren des vorigen laufen vielleicht weiter",
  halt_failed: "Der Controller hat keine Abmeldung des Programms bestätigt und war danach nicht zu erreichen; Motoren laufen vielleicht weiter",
  host_not_found: "Diesen Namen gibt es im Netz nicht",
  ignored: "Das Programm hat eine andere Konfiguration mit derselben Nummer gesendet; der Controller beachtet sie nicht",
  i2c_refused: "Der Controller nimmt keine Verbindung für I2C an; alles andere geht weiter",
  i2c_no_device: "Unter dieser Adresse antwortet kein I2C-Gerät; prüfe Kabel, Strom und ob es die 7-Bit-Adresse ist",
  motor_twice: "Ein Motor kann nicht mit sich selbst zusammen laufen",
  no_host: "Diesen Controller hat das Programm nicht; lade die Seite neu",
  no_answer: "Der Controller antwortet nicht; prüfe die Verbindung zu ihm",
  no_controller: "Es wurde kein Controller gefunden",
  not_a_motor: "Hier sind zwei Ausgänge eingestellt; stelle auf Motor um",
  checked: "Eine Prüfung läuft und drückt die Taster selbst; beende sie zuerst",
  only_looks: "Diese Seite sieht nur zu",
  not_understood: "Ein Teil der Bytes ist nicht zu verstehen und wird hier nicht gezeigt; weitergegeben wird alles",
  unanswered: "Der Controller hat die letzten Befehle nicht beantwortet; die Ausgänge sind die zuletzt gesendeten",
  unknown: "Das Programm oder der Controller sagt etwas, das hier nicht bekannt ist; weitergegeben wird alles",
  missed: "Der Rechner ist überlastet und liest nicht mehr alles mit; weitergegeben wird trotzdem alles",
  not_an_output: "Hier ist ein Motor eingestellt; stelle auf 2 Ausgänge um",
  not_connected: "Der Controller ist gerade nicht verbunden",
  not_driving: "Diese Seite sieht nur zu; sie muss zuerst übernehmen",
  out_of_range: "Diese Zahl ist zu groß oder zu klein",
  stop_online_unanswered: "Der Controller hat die Abmeldung des Programms nicht bestätigt; Motoren laufen vielleicht weiter",
  not_recorded: "Diese Seite startet und beendet keine Aufnahme",
  record_denied: "In dem Ordner, in dem txt gestartet wurde, kann nichts geschrieben werden; gesteuert wird weiter",
  record_failed: "Die Aufnahme kann nicht geschrieben werden; gesteuert wird weiter",
  record_gone: "Die Datei der Aufnahme ist nicht mehr da; gesteuert wird weiter",
  record_full: "Auf dem Datenträger ist kein Platz mehr; was vorher aufgenommen wurde, ist lesbar",
  record_name: "Die Aufnahme hat ihren Namen nicht bekommen; sie geht unter einem anderen weiter",
  record_stuck: "Der Datenträger nimmt von der vorigen Aufnahme noch nichts an",
  several_controllers: "Es wurden mehrere Controller gefunden; nenne die Adresse",
  taken: "Eine andere Seite steuert",
  watchdog: "Das Programm hat zu lange geschwiegen, die Motoren sind aus",
  zero_pulses: "Eine Strecke hat 1 bis 65535 Impulse",
};

const KEY = "txt-panel-language";

function remembered() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null; // The browser allows no storage.
  }
}

let language = remembered() ?? (navigator.language.toLowerCase().startsWith("de") ? "de" : "en");

export function currentLanguage() {
  return language;
}

export function setLanguage(next) {
  language = next;
  try {
    localStorage.setItem(KEY, next);
  } catch {
    // Then it is for this time only.
  }
}

/** A text, with values in place of its `{names}`. */
export function t(key, values = {}) {
  return filled((language === "de" ? GERMAN : ENGLISH)[key] ?? key, values);
}

function filled(text, values) {
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? "");
}

/** The name of a place, for people. */
export function placeName(name) {
  const parts = name.split(".");
  const own = parts.pop();
  const controller = parts.join(", ");
  const german = language === "de" ? GERMAN_PLACES[own] : undefined;
  return (german ?? own.replaceAll("_", " ")) + (controller ? ` (${controller})` : "");
}

export function sounds() {
  return SOUNDS[language];
}

/** An error of the program as a sentence. An address stays as the user has typed it. */
export function sentence({ code, text, cause }) {
  const german = language === "de" ? GERMAN_ERRORS : {};
  const said = [german[code] ?? text, german[code] && german[cause]].filter(Boolean).join(": ");
  const typed = [...hosts.values()].some(({ address }) => said.startsWith(address));
  return (typed ? said : capital(said)) + (/[.!?]$/.test(said) ? "" : ".");
}

/** What went wrong with a workpiece, as a sentence. */
export function mishapSentence({ code, text, piece, ...names }) {
  const german = language === "de" ? GERMAN_MISHAPS[code] : undefined;
  if (!german) return `${capital(text)}.`;
  const places = Object.entries(names).map(([key, name]) => [key, name && placeName(name)]);
  return `${capital(filled(german, { piece: GERMAN_PIECES[piece], ...Object.fromEntries(places) }))}.`;
}

function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** A number with the separators of the language. */
export function number(value) {
  return value.toLocaleString(language);
}

/** The same with one decimal. */
export function decimal(value) {
  return value.toLocaleString(language, { minimumFractionDigits: 1, maximumFractionDigits: 1 });
}

/** A time in ms, without its unit. There is none before the first cycle, and while the connection is lost. */
export function milliseconds(value) {
  return value === null ? "–" : decimal(value);
}
