"use strict";
// Sorts the rows of a table by the column whose head is chosen; once more, the other way round.
(function () {
  for (const table of document.querySelectorAll("table.sortable")) {
    const body = table.tBodies[0];
    const head = body.rows[0];
    Array.from(head.cells).forEach(function (cell, column) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = cell.textContent;
      cell.replaceChildren(button);
      button.addEventListener("click", function () {
        const rises = cell.getAttribute("aria-sort") !== "ascending";
        for (const other of head.cells) other.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", rises ? "ascending" : "descending");
        const rows = Array.from(body.rows).slice(1);
        const keys = new Map(rows.map(function (row) { return [row, key(row.cells[column].textContent)]; }));
        rows.sort(function (a, b) { return compare(keys.get(a), keys.get(b), rises); });
        body.append(...rows);
      });
    });
  }

  function key(text) {
    const number = text.trim() === "" ? NaN : Number(text);
    return Number.isNaN(number) ? text : number;
  }

  // Numbers before texts, and what is missing last, whichever way.
  function compare(a, b, rises) {
    const missing = [a, b].map(function (k) { return k === "" || k === "-"; });
    if (missing[0] || missing[1]) return missing[0] - missing[1];
    const order = typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? -1 : 1;
    return rises ? order : -order;
  }
})();
