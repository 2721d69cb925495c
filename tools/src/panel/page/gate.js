// Where another program drives through this one: ends its connection, after a question, and lets programs in again.

import { h, setAttribute, setText } from "./dom.js";
import { t } from "./words.js";

export class Gate {
  /** `ask` sends a command. */
  constructor(button, dialog, send) {
    this.button = button;
    this.dialog = dialog;
    this.send = send;
    this.host = null;
    this.isShut = false;
    this.opened = false;
    button.addEventListener("click", () => (this.isShut ? this.change("admit") : this.question()));
    addEventListener("keydown", (event) => this.space(event, true));
    addEventListener("keyup", (event) => this.space(event, false));
  }

  hello(hosts) {
    this.host = hosts.find((host) => host.watched)?.id ?? null;
    setAttribute(this.button, "hidden", this.host === null);
    if (this.host === null) this.dialog.close();
  }

  /** The words, after another language was chosen. */
  make() {
    const cancel = h("button", { type: "button", onclick: () => this.dialog.close() }, t("cancel"));
    const go = h("button", { type: "button", class: "danger", autofocus: true, onclick: () => this.change("disconnect") }, t("disconnect"));
    this.dialog.replaceChildren(h("h2", { id: "ask-title" }, t("disconnectTitle")), h("p", {}, t("disconnectText")), h("div", { class: "row" }, go, cancel));
    this.show();
  }

  update(state) {
    if (!state.watched) return;
    this.isShut = state.watched.shut;
    this.show();
  }

  show() {
    setText(this.button, t(this.isShut ? "admit" : "disconnect"));
    setAttribute(this.button, "data-shut", this.isShut);
  }

  question() {
    if (!this.dialog.open) this.dialog.showModal();
  }

  change(command) {
    this.dialog.close();
    this.send({ do: command, host: this.host });
  }

  lost() {
    this.dialog.close();
    setAttribute(this.button, "hidden", true);
  }

  /** The space bar, which stops elsewhere, asks here. It does not answer its own question when it is let go. */
  space(event, pressed) {
    if (this.host === null || event.code !== "Space") return;
    if (pressed && this.dialog.open) return;
    if (!pressed && !this.opened) return;
    event.preventDefault();
    this.opened = pressed;
    if (pressed && !this.isShut) this.question();
  }
}
