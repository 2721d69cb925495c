// Who drives. One page does; it takes the wheel by itself when nobody has it, until another page takes it away.

const ASK_AGAIN_MS = 500;
// After a reload the page before may still be there for a moment.
const GIVE_UP_MS = 1500;
// So long after this page's stop, which stop.js leaves in `window.panelStopped`, the stop is its own.
const OWN_STOP_MS = 3000;

export class Wheel {
  /** `freed` is called when the program has taken the wheel away: "silent", "hang" or, by another page, "stop". */
  constructor(connection, freed) {
    this.connection = connection;
    this.freed = freed;
    this.wanted = true;
    this.mine = false;
    this.driver = null;
    this.asked = -Infinity;
    this.greeted = 0;
  }

  hello() {
    this.greeted = performance.now();
    this.mine = false;
    if (this.wanted) this.ask("drive");
  }

  lost() {
    this.mine = false;
  }

  state({ driver, freed, you_drive }) {
    const had = this.mine;
    this.driver = driver;
    this.mine = you_drive;
    const now = performance.now();
    const byItself = freed === "left" || (freed === "stop" && now - (window.panelStopped ?? -Infinity) < OWN_STOP_MS);
    if (had && driver === null && !byItself) this.freed(freed);
    if (you_drive) this.wanted = true;
    else if (driver !== null) this.wanted &&= !had && now - this.greeted < GIVE_UP_MS;
    else if (this.wanted && !document.hidden && now - this.asked > ASK_AGAIN_MS) this.ask("drive");
  }

  /** The user wants it: from another page too. */
  take() {
    this.wanted = true;
    this.greeted = performance.now();
    this.ask("take");
  }

  ask(how) {
    this.asked = performance.now();
    // What came of it is in the next state.
    this.connection.ask({ do: how }).catch(() => {});
  }
}
