"use strict";
// The theme of the page, and the place in its contents.
(() => {
  function themes() {
    const button = document.getElementById("theme");
    const names = ["", "light", "dark"];
    let kept = "";
    // A browser may forbid a page on disk to keep anything.
    try { kept = localStorage.getItem("lowalt-theme") || ""; } catch { kept = ""; }
    const apply = (name) => {
      if (name) document.documentElement.dataset.theme = name;
      else delete document.documentElement.dataset.theme;
      button.textContent = `Theme: ${name || "as the system"}`;
    };
    apply(kept);
    button.hidden = false;
    button.addEventListener("click", () => {
      kept = names[(names.indexOf(kept) + 1) % names.length];
      apply(kept);
      try { localStorage.setItem("lowalt-theme", kept); } catch { return; }
    });
  }

  function places() {
    const links = new Map([...document.querySelectorAll("nav a")].map((link) => [link.getAttribute("href").slice(1), link]));
    const seen = new Set();
    const mark = (place) => {
      for (const [name, link] of links) {
        if (name === place) link.setAttribute("aria-current", "true");
        else link.removeAttribute("aria-current");
      }
    };
    const watch = new IntersectionObserver((entries) => {
      for (const entry of entries) seen[entry.isIntersecting ? "add" : "delete"](entry.target.id);
      const first = [...links.keys()].find((name) => seen.has(name));
      if (first) mark(first);
    }, { rootMargin: "-80px 0px -60% 0px" });
    for (const name of links.keys()) watch.observe(document.getElementById(name));
    // The observer reports with the first frame, which a busy machine draws late.
    mark(links.keys().next().value);
  }

  themes();
  places();
  window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((node) => { node.open = true; }));
})();
