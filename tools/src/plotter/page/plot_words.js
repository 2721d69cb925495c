// The words of the plotter, in both languages.

const ENGLISH = {
  plotter: "Plotter", close: "Close the plotter", window: "How long", pause: "Pause", goOn: "Go on", back: "Earlier", on: "Later", shorter: "Zoom in", longer: "Zoom out", all: "All",
  terminals: "Terminals", area: "Which controller", master: "TXT", nothing: "Choose terminals.", nothingLive: "Choose terminals here, or click their values.",
  cursor: "Cursor", ofCursor: "{time}: {values}", lines: "Lines", newest: "now",
  digital: "0 or 1", mV: "voltage in mV", Ω: "resistance in Ω", cm: "distance in cm", pulses: "pulses", duty: "duty, 512 is full",
  seconds: "{count} s", minutes: "{count} min",
  language: "Deutsch", languageLabel: "Deutsch: Seite auf Deutsch zeigen",
  zoomHint: "Drag the mouse over a stretch to see it larger; a double click shows all.",
  thinned: "Of each {width} s the first, lowest, highest and last value are kept. A shorter part, by --from and --to, has more of them.",
  shaded: "Shaded: no connection.", marked: "Yellow: an unusual moment, with its number in the list.",
  unusual: "Unusual moments", momentsHint: "A click shows the 10 s before and after.", moreMoments: "The first 10 of each kind are listed.",
  gap: "gap", error: "error", watchdog: "watchdog", blocked_motor: "blocked motor", over_range: "over range", counter_jump: "jump of a counter", long_cycle: "long cycle", late_reaction: "late reaction", not_recorded: "not recorded",
};

const GERMAN = {
  plotter: "Plotter", close: "Plotter schließen", window: "Wie lange", pause: "Pause", goOn: "Weiter", back: "Früher", on: "Später", shorter: "Vergrößern", longer: "Verkleinern", all: "Alles",
  terminals: "Anschlüsse", area: "Welcher Controller", master: "TXT", nothing: "Wähle Anschlüsse.", nothingLive: "Wähle Anschlüsse hier, oder klicke auf ihre Werte.",
  cursor: "Zeiger", ofCursor: "{time}: {values}", lines: "Linien", newest: "jetzt",
  digital: "0 oder 1", mV: "Spannung in mV", Ω: "Widerstand in Ω", cm: "Abstand in cm", pulses: "Impulse", duty: "Stärke, 512 ist voll",
  seconds: "{count} s", minutes: "{count} min",
  language: "English", languageLabel: "English: show the page in English",
  zoomHint: "Ziehe mit der Maus über ein Stück, um es größer zu sehen; ein Doppelklick zeigt alles.",
  thinned: "Von je {width} s sind der erste, kleinste, größte und letzte Wert erhalten. Ein kürzeres Stück, mit --from und --to, hat mehr davon.",
  shaded: "Schattiert: keine Verbindung.", marked: "Gelb: ein auffälliger Moment, mit seiner Nummer in der Liste.",
  unusual: "Auffällige Momente", momentsHint: "Ein Klick zeigt die 10 s davor und danach.", moreMoments: "Die ersten 10 jeder Art stehen in der Liste.",
  gap: "Lücke", error: "Fehler", watchdog: "Watchdog", blocked_motor: "Motor blockiert", over_range: "außerhalb des Bereichs", counter_jump: "Sprung eines Zählers", long_cycle: "langer Zyklus", late_reaction: "späte Reaktion", not_recorded: "nicht aufgezeichnet",
};

export class PlotWords {
  constructor(language) {
    this.language = language;
    this.words = language === "de" ? GERMAN : ENGLISH;
  }

  /** A text, with values in place of its `{names}`. */
  t(key, values = {}) {
    return (this.words[key] ?? key).replace(/\{(\w+)\}/g, (_, name) => values[name] ?? "");
  }

  /** A number with the separators of the language. */
  number(value, digits = 3) {
    return value.toLocaleString(this.language, { maximumFractionDigits: digits }).replace("-", "−");
  }

  /** A length of time. */
  span(seconds) {
    return seconds < 60 ? this.t("seconds", { count: seconds }) : this.t("minutes", { count: seconds / 60 });
  }
}
