"use strict";
// Beside the script of charts: files go up, what is pasted fills cells, and the focus stays where it was when a part is drawn anew.
(() => {
  globalThis.sendFiles = async (files, address) => {
    const refusals = [];
    for (const file of files) {
      try {
        const answer = await fetch(`${address}?name=${encodeURIComponent(file.name)}`, { method: "PUT", body: file });
        if (!answer.ok) refusals.push(await answer.text());
      } catch {
        refusals.push(`${file.name} could not be read; of a folder choose the files in it.`);
      }
    }
    return refusals;
  };
  globalThis.copyText = async button => {
    const words = button.parentElement.querySelector("pre").textContent;
    try {
      await navigator.clipboard.writeText(words);
      button.textContent = "Copied";
    } catch {
      button.textContent = "Select it, and copy it by hand";
    }
    setTimeout(() => { button.textContent = "Copy"; }, 2000);
  };
  // A point of a chart that is clicked shows its row; both have the same key.
  document.addEventListener("pick", event => {
    const row = document.querySelector(`[data-row-key="${CSS.escape(event.detail)}"]`);
    if (!row) return;
    document.querySelectorAll("tr.picked").forEach(other => other.classList.remove("picked"));
    row.classList.add("picked");
    for (let part = row.parentElement; part; part = part.parentElement) if (part.tagName === "DETAILS") part.open = true;
    row.scrollIntoView({ block: "center" });
    row.focus({ preventScroll: true });
  });
  let last = null;
  document.addEventListener("focusin", event => { last = event.target.dataset?.key ?? null; });
  const tidy = () => {
    globalThis.drawCharts?.();
    document.querySelector("main.q-page")?.setAttribute("role", "none"); // NiceGUI's own, around ours
    if (last && document.activeElement === document.body) document.querySelector(`[data-key="${CSS.escape(last)}"]`)?.focus({ preventScroll: true });
  };
  const start = () => { new MutationObserver(tidy).observe(document.body, { childList: true, subtree: true }); tidy(); };
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start); else start();
  for (const kind of ["dragover", "dragleave", "drop"])
    document.addEventListener(kind, event => {
      const zone = event.target.closest?.(".drop");
      if (!zone) return;
      event.preventDefault();
      zone.classList.toggle("over", kind === "dragover");
    });
})();
