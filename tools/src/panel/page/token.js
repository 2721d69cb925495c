// The token of a page. It is taken out of the address, which others can see or copy; the tab keeps it for when the page is
// loaded again. Plain, and before everything else: stop.js needs it, too.
window.panelToken = (function () {
  const key = "txt-panel-token";
  const given = new URLSearchParams(location.search).get("token");
  try {
    if (!given) return sessionStorage.getItem(key) || "";
    sessionStorage.setItem(key, given);
  } catch {
    return given || ""; // The browser allows no storage, so it stays in the address.
  }
  history.replaceState(null, "", location.pathname);
  return given;
})();
