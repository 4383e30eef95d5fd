// Tables with heads are sorted by them, by numbers where there are any.

import { makeSortable } from "./tables.js";

const number = (text) => Number(text.replace(/^x |,| %$/g, "") || NaN);

for (const table of document.querySelectorAll("article table")) {
  if (!table.tHead) continue;
  for (const cell of table.tBodies[0].querySelectorAll("td")) {
    const value = number(cell.textContent.trim());
    if (Number.isFinite(value)) cell.dataset.value = value;
  }
  makeSortable(table);
}
