// Tables that are sorted by a click on a column's head.
"use strict";

const collator = new Intl.Collator();

for (const table of document.querySelectorAll("table[data-sortable]")) {
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const key = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
      const rows = [...body.rows].map((row) => {
        const text = key(row);
        const number = text === "" ? NaN : Number(text);
        return { row, text, number };
      });
      // Numbers before words, what is not known at the end.
      const compare = (a, b) => {
        if (a.text === "" || b.text === "") return (a.text === "") - (b.text === "");
        const known = Number.isNaN(a.number) - Number.isNaN(b.number);
        const order = known || (Number.isNaN(a.number) ? collator.compare(a.text, b.text) : a.number - b.number);
        return down ? -order : order;
      };
      rows.sort(compare);
      body.append(...rows.map((entry) => entry.row));
    });
  });
}
