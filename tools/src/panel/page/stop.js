// The stop. It is a plain script, loaded before all others, and uses none of them but token.js, which is put before it:
// whatever breaks or hangs elsewhere, the button and the space bar send it. It goes two ways at once, by a request of its
// own and by the page's WebSocket, which connection.js leaves in `window.panelSocket`. The others learn by two events that
// a stop is on its way, "panelstop", and that its request is answered or has failed, "panelstopped".
(function () {
  "use strict";

  let reset = 0;

  function show(result) {
    const button = document.getElementById("stop");
    if (!button) return;
    button.dataset.result = result;
    clearTimeout(reset);
    reset = setTimeout(function () { delete button.dataset.result; }, 1500);
  }

  function stop() {
    const socket = window.panelSocket;
    try {
      if (socket && socket.readyState === WebSocket.OPEN) socket.send('{"do":"stop"}');
    } finally {
      // It is sent even if the page is being closed.
      const options = { method: "POST", keepalive: true, signal: AbortSignal.timeout(2000) };
      fetch("/stop?token=" + encodeURIComponent(window.panelToken), options).then(
        function (answer) { return answer.ok ? "done" : "failed"; },
        function () { return "failed"; }).then(
        function (result) {
          window.dispatchEvent(new Event("panelstopped"));
          show(result);
        });
      window.dispatchEvent(new Event("panelstop"));
    }
    show("sent");
  }

  // The page hides the button where another program drives, which this one can't stop: there the bar is a usual key.
  function isBar(event) {
    const button = document.getElementById("stop");
    return (event.code === "Space" || event.key === " ") && !(button && button.hidden);
  }

  // In the capture phase, so that it comes before every other listener.
  window.addEventListener("keydown", function (event) {
    if (!isBar(event)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat) stop();
  }, true);
  // A focused button would be clicked when the bar is let go.
  window.addEventListener("keyup", function (event) {
    if (!isBar(event)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }, true);
  // Pointer down is earlier than click, and comes even if the finger slides off. A click without it is the keyboard's
  // or an assistive program's.
  let pointer = false;
  document.addEventListener("pointerdown", function (event) {
    if (!event.target.closest || !event.target.closest("#stop")) return;
    pointer = true;
    stop();
  }, true);
  document.addEventListener("click", function (event) {
    if (!event.target.closest || !event.target.closest("#stop")) return;
    if (!pointer) stop();
    pointer = false;
  }, true);
})();
