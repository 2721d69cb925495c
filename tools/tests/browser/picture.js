// Moves the machine for ten seconds, as a hand would, so that each line has something to show.
const done = arguments[arguments.length - 1];
const find = (label) => document.querySelector(`[aria-label="${label}"]`);

function set(label, value, event = "input") {
  const control = find(label);
  control.value = value;
  control.dispatchEvent(new Event(event, { bubbles: true }));
}

function hold(label, ms) {
  find(label).dispatchEvent(new KeyboardEvent("keydown", { key: "Enter" }));
  setTimeout(() => find(label).dispatchEvent(new KeyboardEvent("keyup", { key: "Enter" })), ms);
}

set("Mode of I2", "ultrasonic/0", "change");
set("What is on M4", "outputs", "change");
set("Speed of M1", 400);
set("Speed of M2", 256);
set("Speed of M3", 200);
set("Value of O7", 512);
set("Value of O8", 120);
find("M1 forward").click();
find("Switch O7").click();
setTimeout(() => find("Switch O8").click(), 300);

// A distance, on its way when the picture is taken.
set("Pulses for M2", 600);
setTimeout(() => find("Go this distance with M2").click(), 7000);

const begin = performance.now();
let steps = 0;
const timer = setInterval(() => {
  const seconds = (performance.now() - begin) / 1000;
  set("I2: Distance", Math.round(90 + 60 * Math.sin(seconds * 1.4) + 20 * Math.sin(seconds * 3.3)));
  steps += 1;
  if (steps % 14 === 0) hold("Press I1", 700);
  if (steps % 33 === 20) hold("Press I3", 1200);
  // The slide goes forth and back.
  if (steps % 36 === 1) find(steps % 72 === 1 ? "M3 forward" : "M3 backwards").click();
  if (seconds < 10.5) return;
  clearInterval(timer);
  done();
}, 100);
