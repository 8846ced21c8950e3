// Shows the assets of one state, and those in which a text is found.
"use strict";

const rows = [...document.querySelectorAll("#assets tbody tr")].map((row) => ({
  row,
  state: row.dataset.state,
  words: `${row.textContent} ${row.dataset.words}`.toLowerCase(),
}));
const search = document.forms.filter.elements.text;
const buttons = [...document.querySelectorAll(".counts button")];
let state = "";

function filter() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const entry of rows) {
    const fits = (!state || entry.state === state) && words.every((word) => entry.words.includes(word));
    if (entry.row.hidden === fits) entry.row.hidden = !fits;
    if (fits) shown += 1;
  }
  document.getElementById("shown").textContent = `${shown} of ${rows.length} shown`;
}

for (const button of buttons) {
  button.addEventListener("click", () => {
    state = button.dataset.state;
    for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
    filter();
    document.getElementById("all").scrollIntoView();
  });
}
search.addEventListener("input", filter);
document.forms.filter.addEventListener("submit", (event) => event.preventDefault());
filter();
