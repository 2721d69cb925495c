// The task and the button of the check, before the rest of the page is there, which takes longer on a slow network.
(function () {
  const text = document.getElementById("state");
  if (!text || !window.panelToken) return;
  const state = JSON.parse(text.textContent);
  let remembered = null;
  try {
    remembered = localStorage.getItem("txt-panel-language");
  } catch {
    // The browser allows no storage.
  }
  const language = remembered || (navigator.language.toLowerCase().startsWith("de") ? "de" : "en");
  // It comes from the documents of this program.
  document.getElementById("task").innerHTML = state.task[language];
  if (!state.may_check || state.checking) return;
  const button = document.createElement("button");
  button.type = "button";
  button.className = "primary";
  button.textContent = language === "de" ? "Prüfen" : "Check";
  button.addEventListener("click", function () {
    button.disabled = true;
    fetch(`/lesson/check?token=${encodeURIComponent(window.panelToken)}`, { method: "POST" }).catch(function () {
      button.disabled = false;
    });
  });
  document.getElementById("check").append(button);
})();
