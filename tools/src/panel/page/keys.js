// The keys 1 to 8 hold the buttons of a simulated machine.

/** Keys are for the view that `current` returns then. */
export function holdButtons(current) {
  const hold = (event, pressed) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target.matches?.("[type=text], [type=number], select")) return;
    const digit = /^(?:Digit|Numpad)([1-8])$/.exec(event.code);
    if (digit) current()?.key?.(Number(digit[1]) - 1, pressed);
  };
  addEventListener("keydown", (event) => hold(event, true));
  addEventListener("keyup", (event) => hold(event, false));
  // A key that is let go elsewhere is not seen.
  addEventListener("blur", () => {
    for (let input = 0; input < 8; input++) current()?.key?.(input, false);
  });
}
