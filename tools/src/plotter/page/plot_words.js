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
  shaded: "Shaded: no connection.",
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
  shaded: "Schattiert: keine Verbindung.",
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
