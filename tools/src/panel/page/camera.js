// The camera's picture.

import { token } from "./connection.js";
import { button, card, h, select, setAttribute, setText } from "./dom.js";
import { number, sentence, t } from "./words.js";

const SIZES = ["320x240", "640x480"];
const RATES = [5, 10, 15, 30];

export class Camera {
  constructor(host, send) {
    this.address = `/camera/${encodeURIComponent(host.id)}?token=${encodeURIComponent(token)}`;
    this.size = select(t("size"), SIZES.map((size) => [size, size.replace("x", " × ")]), () => {});
    this.rate = select(t("rate"), RATES.map((rate) => [rate, `${rate}/s`]), () => {});
    this.rate.value = "15";
    this.on = button(t("cameraOn"), () => {
      if (this.running) return send({ do: "camera", host: host.id, on: false });
      const [width, height] = this.size.value.split("x").map(Number);
      send({ do: "camera", host: host.id, on: true, width, height, fps: Number(this.rate.value) });
    }, { class: "primary" });
    this.picture = h("img", { alt: t("picture"), hidden: true });
    this.idle = h("p", { class: "idle" });
    this.text = h("p", { class: "note", role: "status" });
    this.controls = h("fieldset", { class: "row" }, this.size, this.rate, this.on);
    this.element = card("camera", t("camera"), h("div", { class: "picture" }, this.picture, this.idle), host.driven ? this.controls : null, this.text);
  }

  update(state, may) {
    const { running, frames, error } = state.camera;
    this.controls.disabled = !may;
    // After a gap it may be another controller's: until then nothing is shown.
    const shows = running && frames > 0;
    if (shows !== this.shows) {
      this.shows = shows;
      // The stream is a connection of its own; an empty picture ends it.
      if (shows) this.picture.src = this.address;
      else this.picture.removeAttribute("src");
      setAttribute(this.picture, "hidden", !shows);
      setAttribute(this.idle, "hidden", shows);
    }
    if (running !== this.running) {
      this.running = running;
      setText(this.idle, t(running ? "noPicture" : "cameraIdle"));
      setText(this.on, t(running ? "cameraOff" : "cameraOn"));
      this.size.disabled = this.rate.disabled = running;
    }
    setText(this.text, error ? sentence(error) : running ? t("frames", { count: number(frames) }) : "");
    setAttribute(this.text, "data-error", Boolean(error));
  }

  close() {
    this.picture.removeAttribute("src");
  }
}
