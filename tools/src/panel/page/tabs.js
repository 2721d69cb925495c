// The tabs: all controllers, and each of them. Many take more than one line; what does not fit is hinted at.

import { h, setAttribute, setText } from "./dom.js";
import { hosts } from "./state.js";
import { t } from "./words.js";

/** More than these are below the rest of the top, where they have more room. */
const FEW = 4;
const ALL = "all";

export class Tabs {
  constructor(element, choose) {
    this.element = element;
    this.choose = choose;
    this.tabs = new Map();
    element.addEventListener("keydown", (event) => this.key(event));
    element.addEventListener("scroll", () => this.hint(), { passive: true });
    new ResizeObserver(() => this.hint()).observe(element);
  }

  /** Makes them anew. */
  make() {
    const ids = hosts.size > 1 ? [ALL, ...hosts.keys()] : [];
    this.tabs = new Map(ids.map((id) => [id, this.tab(id)]));
    this.element.setAttribute("aria-label", t("hosts"));
    this.element.replaceChildren(...this.tabs.values());
    setAttribute(this.element, "hidden", !ids.length);
    for (const element of [this.element, this.element.parentElement]) setAttribute(element, "data-many", hosts.size > FEW);
  }

  tab(id) {
    return h("button", { type: "button", role: "tab", "aria-controls": "main", onclick: () => this.take(id) },
      id === ALL ? null : h("i", { class: "dot" }), h("span", {}, id === ALL ? t("all") : hosts.get(id).address));
  }

  take(id) {
    this.choose(id);
    this.tabs.get(id)?.focus();
  }

  key(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    const ids = [...this.tabs.keys()];
    this.take(ids[(ids.indexOf(this.chosen) + step + ids.length) % ids.length]);
  }

  update(chosen) {
    this.chosen = chosen;
    for (const [id, tab] of this.tabs) {
      setAttribute(tab, "aria-selected", id === chosen ? "true" : "false");
      setAttribute(tab, "tabindex", id === chosen ? "0" : "-1");
      const host = hosts.get(id);
      if (!host) continue;
      setAttribute(tab.firstChild, "data-phase", host.state?.link.phase ?? "connecting");
      setText(tab.lastChild, host.shortTitle);
      setAttribute(tab, "title", host.title);
    }
  }

  /** Says on which side there are more than can be seen. */
  hint() {
    const { scrollLeft, scrollWidth, clientWidth } = this.element;
    setAttribute(this.element, "data-before", scrollLeft > 1);
    setAttribute(this.element, "data-after", scrollLeft + clientWidth < scrollWidth - 1);
  }
}
