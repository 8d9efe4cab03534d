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
  // A part that is drawn anew keeps the focus, and what is being typed into it, which is told when it is left.
  let last = null, typed = null;
  document.addEventListener("focusin", event => {
    if (event.target.dataset?.key !== last) typed = null;
    last = event.target.dataset?.key ?? null;
  });
  document.addEventListener("input", event => { if (event.target.matches("input[type=text]")) typed = event.target.value; });
  document.addEventListener("change", event => {
    const box = event.target; // which a browser tells of a box that is taken away too, where nobody listens any more
    queueMicrotask(() => { if (box.isConnected) typed = null; }); // before anything can be drawn again
  }, true);
  const restore = control => {
    control.focus({ preventScroll: true });
    if (typed === null || !control.matches("input[type=text]")) return;
    control.value = typed;
    control.addEventListener("blur", () => { if (typed !== null) control.dispatchEvent(new Event("change", { bubbles: true })); }, { once: true });
  };
  const tidy = () => {
    globalThis.drawCharts?.();
    document.querySelector("main.q-page")?.setAttribute("role", "none"); // NiceGUI's own, around ours
    const control = last && document.activeElement === document.body && document.querySelector(`[data-key="${CSS.escape(last)}"]`);
    if (control) restore(control);
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
