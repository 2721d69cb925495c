// Who drives. One page does; it takes control by itself when nobody has it, until another page takes it away.

import { dropWaiting } from "./dom.js";

// After a reload the page before may still be there for a moment.
const GIVE_UP_MS = 1500;

export class ControlLock {
  /**
   * `freed` is called when the program has taken control away: "silent", "hang" or, by another page, "stop".
   * `stopped` is called at once when this page has sent a stop.
   */
  constructor(connection, { freed, stopped }) {
    this.connection = connection;
    this.freed = freed;
    this.wanted = true;
    this.mine = false;
    this.driver = null;
    this.greeted = 0;
    // How many stops and questions of this page are not answered yet.
    this.stops = 0;
    this.asks = 0;
    // What to ask when all stops have arrived.
    this.next = null;
    addEventListener("panelstop", () => {
      this.stop();
      stopped();
    });
    addEventListener("panelstopped", () => this.stopArrived());
  }

  /** Whether this page is about to take control by itself. */
  get comes() {
    return this.wanted && !this.mine && this.driver === null;
  }

  /** `drives`: whether there is anything to drive. */
  hello(drives) {
    this.wanted &&= drives;
    this.greeted = performance.now();
    if (this.wanted) this.ask("drive");
  }

  lost() {
    this.lose(null);
    this.next = null;
  }

  state({ driver, freed, you_drive }) {
    // It may be older than what this page has sent.
    if (this.stops > 0 || this.asks > 0) return;
    const [had, before] = [this.mine, this.driver];
    if (had && !you_drive) this.lose(driver);
    this.driver = driver;
    this.mine = you_drive;
    if (had && driver === null && freed !== "left") this.freed(freed);
    if (you_drive) this.wanted = true;
    else if (driver !== null) this.wanted &&= !had && performance.now() - this.greeted < GIVE_UP_MS;
    // A stop while another page drives is no reason to drive: that page is still there.
    else if (!had && before !== null && freed === "stop") this.wanted = false;
    else if (this.wanted && !document.hidden) this.ask("drive");
  }

  /** The user wants it: from another page too. */
  take() {
    this.wanted = true;
    this.greeted = performance.now();
    this.ask("take");
  }

  /** This page's stop is on its way. It would end the next drive, so control is asked for when it has arrived. */
  stop() {
    this.stops += 1;
    if (this.mine) this.lose(null);
    if (this.comes) this.ask("drive");
  }

  stopArrived() {
    this.stops -= 1;
    if (this.stops > 0 || !this.next) return;
    this.ask(this.next);
    this.next = null;
  }

  /** What was clicked before moves nothing later. */
  lose(driver) {
    this.mine = false;
    this.driver = driver;
    dropWaiting();
  }

  ask(how) {
    if (this.stops > 0) {
      this.next = how;
      return;
    }
    this.asks += 1;
    // What came of it is in the next state.
    this.connection.ask({ do: how }).catch(() => {}).finally(() => (this.asks -= 1));
  }
}
