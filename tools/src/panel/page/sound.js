// The loudspeaker and the microphone.

import { button, card, h, select, setDisabled, setText } from "./dom.js";
import { number, sounds, t } from "./words.js";

export class Sound {
  constructor(host, send) {
    const play = (index, repeat) => send({ do: "sound", host: host.id, area: 0, index, repeat });
    const names = sounds().map((name, index) => [index + 1, `${index + 1} · ${name}`]);
    const sound = select(t("soundLabel"), names, () => {});
    const repeat = h("input", { type: "number", min: 1, max: 65535, value: 1, "aria-label": t("repeatLabel"), title: t("repeatLabel") });
    this.text = h("p", { class: "note", role: "status" });
    this.microphone = h("p", { class: "note microphone" });
    this.controls = h("fieldset", { class: "row" }, sound, repeat, h("span", { class: "unit" }, t("repeat")),
      button(t("play"), () => repeat.reportValidity() && play(Number(sound.value), Number(repeat.value)), { class: "primary" }),
      button(t("silence"), () => play(0, 1)));
    this.element = card("sound", t("sound"), host.driven ? this.controls : null, this.text, this.microphone);
  }

  update(state, may) {
    setDisabled(this.controls, !may);
    const { alive, sound: { playing, index }, microphone: [level] } = state.areas[0];
    setText(this.text, !alive ? "–" : playing ? t("playing", { number: index }) : t("quiet"));
    setText(this.microphone, t("microphone", { level: alive ? number(level) : "–" }));
  }
}
