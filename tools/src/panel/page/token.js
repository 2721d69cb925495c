// The token of a page without motors of its own, and so without stop.js: it is taken out of the address, which others can
// see or copy. The tab keeps it for when the page is loaded again.

function takeToken() {
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
}

window.panelToken = takeToken();
