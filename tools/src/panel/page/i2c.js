// I2C: find devices, read and write their registers.

import { button, card, h, setDisabled, setText } from "./dom.js";
import { sentence, t } from "./words.js";

const hex = (value) => `0x${value.toString(16).toUpperCase().padStart(2, "0")}`;

/** A number as people write it, decimal or 0x…, or an error with a sentence. */
function parse(text, least, most) {
  const trimmed = text.trim();
  const value = /^(0x[0-9a-f]+|\d+)$/i.test(trimmed) ? Number(trimmed) : NaN;
  if (!(value >= least && value <= most)) throw { code: "", text: t(trimmed ? "badNumber" : "noNumber", { text, least, most }) };
  return value;
}

export class I2c {
  constructor(host, ask) {
    this.ask = (command) => ask({ ...command, host: host.id });
    const field = (label, value, size) => h("input", { type: "text", value, size, "aria-label": label, autocomplete: "off", spellcheck: "false" });
    const labelled = (label, input, name) => h("label", { class: name }, h("span", {}, label), input);
    this.address = field(t("device"), "0x18", 5);
    this.register = field(t("register"), "0x00", 5);
    this.count = field(t("count"), "1", 3);
    this.values = field(t("values"), "", 12);
    this.result = h("p", { class: "note result", role: "status" }, t("hexHint"));
    this.controls = h("fieldset", {},
      h("div", { class: "row" }, labelled(t("device"), this.address), labelled(t("register"), this.register), button(t("scan"), () => this.run(() => this.scan()), { class: "primary" })),
      h("div", { class: "row" }, labelled(t("count"), this.count), button(t("read"), () => this.run(() => this.read())),
        labelled(t("values"), this.values, "wide"), button(t("write"), () => this.run(() => this.write()))));
    // What another program asks for is only shown.
    this.element = card("i2c", t("i2c"), host.driven ? this.controls : null, this.result);
  }

  update(state, may) {
    if (state.watched) this.passed(state.watched.i2c);
    else this.forget(state.i2c ? state.link.gaps : null);
    setDisabled(this.controls, !may || !state.i2c);
  }

  /** A result is of one connection: the next one may be to another controller. */
  forget(connection) {
    if (connection !== this.connection) this.show(t("hexHint"));
    this.connection = connection;
  }

  /** The last request of another program, and its answer. */
  passed(last) {
    if (!last) return this.show(t("i2cNone"));
    const list = (bytes) => bytes.map(hex).join(" ") || "–";
    const read = last.read ? list(last.read) : t("noDevice");
    this.show(t("i2cPassed", { device: hex(last.device), written: list(last.written), read }));
  }

  async run(action) {
    const { connection } = this;
    const isOld = () => connection !== this.connection;
    try {
      const result = await action();
      if (!isOld()) this.show(result);
    } catch (error) {
      // Null is a lost connection, which the whole page shows.
      if (error && !isOld()) this.show(sentence(error), true);
    }
  }

  show(text, failed = false) {
    setText(this.result, text);
    this.result.toggleAttribute("data-error", failed);
  }

  place() {
    return { address: parse(this.address.value, 0, 0x7f), register: parse(this.register.value, 0, 0xff) };
  }

  async scan() {
    this.show(t("scanning"));
    const addresses = await this.ask({ do: "i2c_scan" });
    if (!addresses.length) return t("foundNone");
    this.address.value = hex(addresses[0]);
    return t("found", { list: addresses.map(hex).join(", ") });
  }

  async read() {
    const place = this.place();
    const bytes = await this.ask({ do: "i2c_read", ...place, count: parse(this.count.value, 1, 256) });
    return `${hex(place.register)}: ${bytes.map(hex).join(" ")} = ${bytes.join(", ")}`;
  }

  async write() {
    const values = this.values.value.split(",").map((text) => parse(text, 0, 255));
    await this.ask({ do: "i2c_write", ...this.place(), values });
    return t("written");
  }
}
