// The plotter, below the board. Its files are loaded when it is opened first.

import { button, h, setText } from "./dom.js";
import { remember, remembered } from "./remember.js";
import { currentLanguage, t } from "./words.js";

let loading = null;

async function file(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw answer;
  return answer.text();
}

async function load() {
  const [style, script] = await Promise.all([file("/plotter.css"), file("/plotter.js")]);
  // The page's policy allows these texts.
  document.head.append(h("style", {}, style), h("script", {}, script));
  return window.txtPlotter;
}

export class Plot {
  constructor(host, area) {
    this.host = host;
    this.area = area;
    this.key = `plot ${host.address}`;
    this.element = h("section", { class: "card plot", "aria-label": t("plotter") });
    this.leave();
    // In another view or language it goes on.
    if (host.plotted) this.open();
  }

  leave() {
    this.note = h("span", { class: "note", role: "status" }, t("plotHint"));
    this.button = button(t("plotter"), () => this.open(), { "aria-expanded": "false" });
    this.element.replaceChildren(h("div", { class: "row" }, this.button, this.note));
  }

  async open() {
    try {
      const { Live, open } = await (loading ??= load());
      if (this.plotter || this.isClosed) return;
      const { host, area, key } = this;
      host.plotted ??= new Live(host.names);
      this.plotter = open(host.plotted, currentLanguage(), {
        area,
        chosen: remembered(key, []),
        changed: (chosen) => remember(key, chosen),
        close: () => {
          this.close();
          this.isClosed = this.plotter = host.plotted = null;
          this.leave();
          this.button.focus();
        },
      });
      this.element.replaceChildren(this.plotter.element);
    } catch {
      loading = null;
      setText(this.note, t("lost"));
    }
  }

  /** A click on the value of a terminal shows it, or takes it away. */
  async clicked({ target }) {
    const value = target.closest("[data-plot]");
    if (!value) return;
    const isOpen = this.plotter;
    await this.open();
    this.plotter?.clicked(Number(value.closest(".board").dataset.area), value.dataset.plot, isOpen);
  }

  update() {
    this.plotter?.update();
  }

  close() {
    this.isClosed = true;
    this.plotter?.close();
  }
}
