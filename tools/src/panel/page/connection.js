// The connection to the program: commands with their answers, a sign of life each 250 ms, and trying again.

const ALIVE_MS = 250;
const RETRY_MS = 700;
// States come 20 times a second. A program that sends nothing for so many signs of life, 1.5 s, hangs or can't be
// reached, whatever its socket says. They are counted, not timed: a page that stood still itself has missed nothing.
const SILENT = 6;
// A slow network needs some time for a connection.
const CONNECT_MS = 10000;

// From token.js.
export const token = window.panelToken;

export class Connection {
  /** `on` has `hello`, `state`, `lost` and `failed` (an error that no one waits for). */
  constructor(on) {
    this.on = on;
    this.socket = null;
    this.sequence = 0;
    this.waiting = new Map();
    // How many signs of life were sent since the program has said something.
    this.silent = 0;
    this.begun = 0;
    setInterval(() => this.tick(), ALIVE_MS);
    // The motors stop at once instead of after a second.
    addEventListener("pagehide", () => this.post({ do: "release" }));
  }

  open() {
    // The first one is of socket.js.
    const early = window.panelEarly;
    window.panelEarly = null;
    const socket = early?.socket ?? window.panelConnect();
    this.socket = socket;
    this.silent = 0;
    this.begun = early?.begun ?? performance.now();
    // For stop.js.
    window.panelSocket = socket;
    socket.addEventListener("message", (event) => {
      if (this.socket !== socket) return;
      this.silent = 0;
      this.take(JSON.parse(event.data));
    });
    socket.addEventListener("close", () => this.lose(socket));
    if (!early) return;
    early.release();
    for (const data of early.said) this.take(JSON.parse(data));
    // It was closed before anybody listened.
    if (socket.readyState > WebSocket.OPEN) this.lose(socket);
  }

  /** This connection counts no more. The browser's `close` may come a minute later. */
  lose(socket) {
    if (this.socket !== socket) return;
    this.socket = null;
    socket.close();
    for (const { reject } of this.waiting.values()) reject(null);
    this.waiting.clear();
    this.on.lost();
    setTimeout(() => this.open(), RETRY_MS);
  }

  take(message) {
    if (message.type === "hello") this.on.hello(message);
    else if (message.type === "state") this.on.state(message);
    else if (message.type === "answer") this.answer(message);
  }

  answer({ seq, ok, value, error }) {
    const waiting = this.waiting.get(seq);
    this.waiting.delete(seq);
    if (ok) waiting?.resolve(value);
    else if (waiting) waiting.reject(error);
  }

  tick() {
    const { socket } = this;
    if (!socket) return;
    const isOpen = this.post({ do: "alive" });
    if (isOpen) this.silent += 1;
    const isOver = isOpen ? this.silent > SILENT : performance.now() - this.begun > CONNECT_MS;
    if (isOver) this.lose(socket);
  }

  post(message) {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Sends a command. The promise fails with `{code, text}`, or with `null` when the connection is lost. */
  ask(command) {
    const seq = ++this.sequence;
    return new Promise((resolve, reject) => {
      this.waiting.set(seq, { resolve, reject });
      if (this.post({ ...command, seq })) return;
      this.waiting.delete(seq);
      reject(null);
    });
  }

  /** Sends a command whose error is shown to the user, and whose value nobody needs. */
  send(command) {
    this.ask(command).catch((error) => {
      if (error) this.on.failed(error);
    });
  }
}
