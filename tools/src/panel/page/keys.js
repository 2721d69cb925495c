// The keys 1 to 8 hold the buttons of a simulated machine.

/** A key is for the view that `current` returns when it is pressed, until it is let go. */
export function holdButtons(current) {
  const held = new Map();
  const inputOf = ({ code }) => /^(?:Digit|Numpad)([1-8])$/.exec(code)?.[1] - 1;
  const letGo = (input) => {
    held.get(input)?.key?.(input, false);
    held.delete(input);
  };
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target.matches?.("[type=text], [type=number], select")) return;
    const input = inputOf(event);
    if (!(input >= 0)) return;
    letGo(input);
    held.set(input, current());
    held.get(input)?.key?.(input, true);
  });
  addEventListener("keyup", (event) => letGo(inputOf(event)));
  // A key that is let go elsewhere is not seen.
  addEventListener("blur", () => [...held.keys()].forEach(letGo));
}
