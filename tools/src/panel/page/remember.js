// What the user has set. It lives as long as the tab, even if the page is loaded again.

const KEY = "txt-panel-set";

function stored() {
  try {
    return new Map(JSON.parse(sessionStorage.getItem(KEY)));
  } catch {
    return new Map(); // The browser allows no storage, or something else has written there.
  }
}

const set = stored();

export function remembered(name, otherwise) {
  return set.get(name) ?? otherwise;
}

export function remember(name, value) {
  set.set(name, value);
  try {
    sessionStorage.setItem(KEY, JSON.stringify([...set]));
  } catch {
    // Then it is for this time only.
  }
}
