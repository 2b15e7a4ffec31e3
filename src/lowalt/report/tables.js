"use strict";
// Tables of the report, and of the site's pages where they ask for it: sort by a column; of LONG rows or more, show rows that hold some words and download them as CSV.
(() => {
  const LONG = 10;
  const words = (node) => node.textContent.replace(/\s+/g, " ").trim();
  const make = (name, attributes, text) => {
    const node = Object.assign(document.createElement(name), attributes);
    if (text) node.textContent = text;
    return node;
  };
  const number = (text) => {
    const found = text.match(/^[+±]?(-?[0-9.]+(e[-+]?[0-9]+)?)/i);
    return found ? parseFloat(found[1]) : NaN;
  };
  // Numbers by value, all else by the alphabet; empty cells last in both directions.
  const compare = (one, other, turn) => {
    if (!one || !other) return (one ? 0 : 1) - (other ? 0 : 1);
    const [x, y] = [number(one), number(other)];
    if (!isNaN(x) && !isNaN(y) && x !== y) return turn * (x - y);
    return turn * one.localeCompare(other, "en", { numeric: true });
  };
  const csv = (rows) => rows.map((row) => row.map((text) => (/[",]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text)).join(",") + "\n").join("");
  const save = (name, text) => {
    const address = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    make("a", { href: address, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  };

  function sortable(table, head) {
    [...head.cells].forEach((cell, column) => {
      const button = make("button", { type: "button" });
      button.append(...cell.childNodes);
      cell.append(button);
      button.addEventListener("click", () => {
        const turn = cell.getAttribute("aria-sort") === "ascending" ? -1 : 1;
        for (const other of head.cells) other.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", turn === 1 ? "ascending" : "descending");
        const body = table.tBodies[0];
        const keyed = [...body.rows].map((row) => [words(row.cells[column]), row]);
        keyed.sort((one, other) => compare(one[0], other[0], turn));
        body.append(...keyed.map((pair) => pair[1]));
      });
    });
  }

  function equip(table) {
    const head = table.tHead && table.tHead.rows[0];
    if (!head || !table.tBodies.length) return;
    const title = table.caption ? words(table.caption) : "table";
    const columns = [...head.cells].map(words);
    const tools = make("div", { className: "tools" });
    const field = make("input", { type: "search", placeholder: "filter rows" });
    field.setAttribute("aria-label", `Filter the rows of: ${title}`);
    const count = make("output", {});
    const show = () => {
      const wanted = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      for (const row of table.tBodies[0].rows) {
        const text = words(row).toLowerCase();
        row.hidden = !wanted.every((word) => text.includes(word));
        shown += row.hidden ? 0 : 1;
      }
      count.textContent = `${shown} of ${table.tBodies[0].rows.length} rows`;
    };
    field.addEventListener("input", show);
    const button = make("button", { type: "button" }, "Download CSV");
    button.setAttribute("aria-label", `Download as CSV: ${title}`);
    button.addEventListener("click", () => {
      const rows = [...table.tBodies[0].rows].filter((row) => !row.hidden).map((row) => [...row.cells].map(words));
      save(title.toLowerCase().replace(/[^a-z0-9]+/g, "-") + ".csv", csv([columns, ...rows]));
    });
    tools.append(field, count, button);
    const box = make("div", { className: "scroll", tabIndex: 0 });
    box.setAttribute("role", "region");
    box.setAttribute("aria-label", title);
    table.before(box);
    if (table.tBodies[0].rows.length >= LONG) box.before(tools);
    box.append(table);
    sortable(table, head);
    show();
  }

  document.querySelectorAll("#content table:not(.plain), .sortable table").forEach(equip);
})();
