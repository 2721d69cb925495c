// Records a controller into a file on the computer of the program, with what came before the click.

import { button, h, setAttribute, setText } from "./dom.js";
import { decimal, sentence, t } from "./words.js";

/** As 1:05, or 1:02:05 from an hour on. */
function duration(seconds) {
  const two = (value) => String(value).padStart(2, "0");
  const [hours, minutes] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60];
  return hours ? `${hours}:${two(minutes)}:${two(seconds % 60)}` : `${minutes}:${two(seconds % 60)}`;
}

export class Record {
  constructor(host, send) {
    this.button = button("", () => send({ do: "record", on: !this.isOn, host: host.id }), { class: "record" });
    // A screen reader says what has changed, not each new size.
    this.said = h("span", { role: "status" });
    this.size = h("span", { class: "size" });
    this.element = h("section", { class: "card recording", "aria-label": t("recording") },
      h("div", { class: "row" }, this.button, h("p", { class: "note" }, this.said, this.size)));
  }

  update({ recording }) {
    const { phase, by_page: byPage, file, bytes, seconds, before, error } = recording;
    this.isOn = phase === "on";
    setAttribute(this.button, "hidden", !byPage);
    setAttribute(this.button, "data-on", this.isOn);
    setText(this.button, t(this.isOn ? "recordStop" : "record"));
    // It keeps the keyboard's focus.
    setAttribute(this.button, "aria-disabled", phase === "ending" ? "true" : false);
    const words = error ? sentence(error) : file ? t(`record-${phase}`, { file }) : t(byPage ? "recordHint" : "record-on", { file: "" });
    setText(this.said, words);
    setAttribute(this.said, "data-error", Boolean(error));
    const time = before ? t("recordTime", { time: duration(seconds), before }) : duration(seconds);
    setText(this.size, file ? `${time} · ${decimal(bytes / 1e6)} MB` : "");
  }
}
