// Tables that are sorted by their heads, and texts that are copied.

export function makeSortable(table) {
  const heads = [...table.tHead.rows[0].cells], body = table.tBodies[0], given = [...body.rows];
  if (given.length < 2) return;
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const order = { none: "ascending", ascending: "descending", descending: "none" }[head.ariaSort || "none"];
      heads.forEach((one) => one.removeAttribute("aria-sort"));
      if (order !== "none") head.setAttribute("aria-sort", order);
      body.append(...(order === "none" ? given : [...given].sort(byColumn(column, order === "ascending" ? 1 : -1))));
    });
  });
}

// What has no value is last, either way.
function byColumn(column, sign) {
  const value = (row) => row.cells[column].dataset.value;
  const text = (row) => row.cells[column].textContent;
  return (one, other) => {
    const [first, second] = [value(one), value(other)];
    if (first !== undefined && second !== undefined) return sign * (Number(first) - Number(second));
    if (first !== undefined || second !== undefined) return first !== undefined ? -1 : 1;
    return sign * text(one).localeCompare(text(other), "en", { numeric: true });
  };
}

export function makeCopier(button) {
  const block = button.parentElement.querySelector("pre");
  button.hidden = false;
  button.setAttribute("aria-label", `Copy ${button.parentElement.querySelector("h2").textContent}`);
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(block.textContent);
    } catch {
      // Without leave to use the clipboard, an older way.
      getSelection().selectAllChildren(block);
      document.execCommand("copy");
    }
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = "Copy"), 1500);
  });
}
