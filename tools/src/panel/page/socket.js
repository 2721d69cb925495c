// The page's WebSocket, opened while the rest of the page is still on its way: on a slow network its handshakes take as
// long as that. What comes meanwhile waits for connection.js, which takes over. Plain, after token.js.
(function () {
  if (!window.panelToken) return;
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const address = `${scheme}://${location.host}/ws?token=${encodeURIComponent(window.panelToken)}`;
  // For connection.js, when this one is lost.
  window.panelConnect = () => new WebSocket(address);
  const socket = new WebSocket(`${address}&early=true`);
  const early = { socket, begun: performance.now(), said: [] };
  // No more than a few messages: the program waits for a first one of this page.
  const keep = (event) => early.said.push(event.data);
  early.release = () => socket.removeEventListener("message", keep);
  socket.addEventListener("message", keep);
  window.panelEarly = early;
  window.panelSocket = socket;
})();
