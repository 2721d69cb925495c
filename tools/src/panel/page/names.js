// What people call the terminals of a controller: a name stands beside I1, never instead of it.

import { h } from "./dom.js";

export class Names {
  /** `names` are those of one area, by terminal. */
  constructor(names = {}) {
    this.names = names;
  }

  /** The terminal with its name, in a sentence. */
  full(terminal) {
    const name = this.names[terminal];
    return name ? `${terminal} (${name})` : terminal;
  }

  /** The name as small text, if there is one. What is cut of it is in its title. */
  small(terminal) {
    const name = this.names[terminal];
    return name ? h("small", { class: "called", title: name }, name) : null;
  }

  /** Which of these have a name, for a title; `null` if none has. */
  title(...terminals) {
    const named = terminals.filter((terminal) => this.names[terminal]);
    return named.map((terminal) => this.full(terminal)).join(", ") || null;
  }
}
