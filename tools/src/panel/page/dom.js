// Makes and changes elements. Texts and attributes are written only when they differ: writing costs layout.

const SVG = "http://www.w3.org/2000/svg";

/** An element with properties (`on…` are listeners, `class`, `aria-…` and `data-…` attributes) and children. */
export function h(tag, properties = {}, ...children) {
  return fill(document.createElement(tag), properties, children);
}

/** The same for SVG, where all properties are attributes. */
export function svg(tag, properties = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), properties, children);
}

function fill(element, properties, children) {
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

export function setText(element, text) {
  const string = String(text);
  if (element.lastText === string) return;
  element.lastText = string;
  element.textContent = string;
}

/** Sets an attribute; `null` and `false` remove it. */
export function setAttribute(element, name, value) {
  const known = (element.lastAttributes ??= {});
  if (known[name] === value) return;
  known[name] = value;
  if (value === null || value === false) element.removeAttribute(name);
  else element.setAttribute(name, value === true ? "" : value);
}

export function setStyle(element, name, value) {
  const known = (element.lastStyles ??= {});
  if (known[name] === value) return;
  known[name] = value;
  element.style.setProperty(name, value);
}

/** Disables a group, but not its text fields: they move nothing, and whoever writes in one goes on to do so after a stop. */
export function setDisabled(group, disabled) {
  if (group.isDisabled === disabled) return;
  group.isDisabled = disabled;
  for (const control of group.querySelectorAll("button, select, input:not([type=text], [type=number])")) control.disabled = disabled;
  group.setAttribute("aria-disabled", disabled);
}

/** Sets a select, slider or number that the user does not have in hand. */
export function setValue(control, value) {
  const string = String(value);
  if (control.value === string || isHeld(control)) return;
  control.value = string;
}

const HOLD_MS = 500;
let drops = 0;

/** Marks a control as just used: what the controller reports is behind it for a moment. */
export function hold(control) {
  control.heldUntil = performance.now() + HOLD_MS;
  control.heldAfter = drops;
}

export function isHeld(control) {
  return control.heldAfter === drops && control.heldUntil > performance.now();
}

/** Drops what waits to be sent, and lets go of what was just used: what was set counts no more. */
export function dropWaiting() {
  drops += 1;
}

/** A select from pairs of value and text. `changed` gets the value. */
export function select(label, options, changed, properties = {}) {
  const control = h("select", { "aria-label": label, ...properties }, options.map(([value, text]) => h("option", { value }, text)));
  control.addEventListener("change", () => {
    hold(control);
    changed(control.value);
  });
  return control;
}

export function button(text, clicked, properties = {}) {
  return h("button", { type: "button", onclick: clicked, ...properties }, text);
}

/** A card with a heading. */
export function card(name, title, ...children) {
  return h("section", { class: `card ${name}`, "aria-label": title }, h("h2", {}, title), children);
}

/** Calls `send` with the newest value, at most once in `ms`: sliders give more than a connection needs. */
export function throttled(send, ms = 50) {
  let timer = 0;
  let newest = null;
  return (value) => {
    newest = { value, after: drops };
    if (timer) return;
    const next = () => {
      timer = 0;
      if (newest?.after !== drops) return;
      const { value } = newest;
      newest = null;
      timer = setTimeout(next, ms);
      send(value);
    };
    next();
  };
}

/** Whether an element is to be seen now. What is not is not drawn. */
const seen = new IntersectionObserver((entries) => {
  for (const entry of entries) entry.target.isSeen = entry.isIntersecting;
}, { rootMargin: "100px" });

export function watchSeen(element) {
  seen.observe(element);
  return element;
}
