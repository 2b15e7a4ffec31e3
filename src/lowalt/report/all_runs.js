"use strict";
// Two runs side by side: the keys of their configurations that differ, then accuracy, processor seconds and bytes.
(() => {
  const data = JSON.parse(document.getElementById("runs-data").textContent);
  const names = Object.keys(data), selects = ["first", "second"].map((name) => document.getElementById(name));
  const titles = { configuration: "Configuration, where it differs", accuracy_percent: "Accuracy, percent", processor_s: "Processor seconds", data: "Data" };
  const cell = (value) => (value === undefined ? "-" : typeof value === "number" && !Number.isInteger(value) ? value.toFixed(2) : String(value));

  function table(part, one, other) {
    const keys = [...new Set([...Object.keys(one[part]), ...Object.keys(other[part])])];
    const shown = part === "configuration" ? keys.filter((key) => one[part][key] !== other[part][key]) : keys;
    if (!shown.length) return null;
    const found = document.createElement("table");
    found.className = "plain";
    found.createCaption().textContent = titles[part];
    const head = found.createTHead().insertRow(), body = found.createTBody();
    for (const text of ["", selects[0].value, selects[1].value, "change"]) {
      const th = document.createElement("th");
      th.scope = "col";
      th.textContent = text;
      head.append(th);
    }
    for (const key of shown) {
      const row = body.insertRow(), pair = [one[part][key], other[part][key]];
      const change = pair.every((value) => typeof value === "number") ? pair[1] - pair[0] : null;
      const words = change === null ? "" : (change > 0 ? "+" : "") + cell(change);
      for (const text of [key, cell(pair[0]), cell(pair[1]), words]) row.insertCell().textContent = text;
    }
    const box = document.createElement("div");
    box.className = "scroll";
    box.tabIndex = 0;
    box.setAttribute("role", "region");
    box.setAttribute("aria-label", titles[part]);
    box.append(found);
    return box;
  }

  function show() {
    const [one, other] = selects.map((select) => data[select.value]);
    if (!one || !other) return;
    document.getElementById("compared").replaceChildren(...Object.keys(titles).map((part) => table(part, one, other)).filter(Boolean));
  }

  selects.forEach((select, place) => {
    select.replaceChildren(...names.map((name) => new Option(name, name)));
    select.value = names[Math.min(place, names.length - 1)] || "";
    select.addEventListener("change", show);
  });
  show();
})();
