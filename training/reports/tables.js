// Tables whose columns sort by a click, numbers by their value and absent ones last, and that can be saved.

function makeSortable(table) {
  addSaving(table);
  const headings = [...table.tHead.rows[0].cells],
    body = table.tBodies[0],
    rows = [...body.rows];
  headings.forEach((heading, column) => {
    heading.addEventListener("click", () => {
      const ascending =
        heading.getAttribute("aria-sort") === "none"
          ? !hasNumbers(rows, column)
          : heading.getAttribute("aria-sort") === "descending";
      headings.forEach((other) => other.setAttribute("aria-sort", "none"));
      heading.setAttribute("aria-sort", ascending ? "ascending" : "descending");
      body.append(...[...rows].sort((a, b) => compare(keyOf(a, column), keyOf(b, column), ascending)));
    });
  });
}

function hasNumbers(rows, column) {
  return rows[0]?.cells[column].dataset.value !== undefined;
}

function keyOf(row, column) {
  const { dataset, textContent } = row.cells[column];
  if (dataset.value === undefined) return textContent;
  return dataset.value === "" ? null : Number(dataset.value);
}

function compare(a, b, ascending) {
  if (a === null || b === null) return (a === null) - (b === null);
  return (ascending ? 1 : -1) * (typeof a === "number" ? a - b : a.localeCompare(b));
}

// A button below the table that saves its rows, in the order shown and with all digits, as a CSV file.
function addSaving(table) {
  const button = Object.assign(document.createElement("button"), { type: "button", className: "save", textContent: "Save as CSV" });
  button.addEventListener("click", () => {
    const url = URL.createObjectURL(new Blob([csvOf(table)], { type: "text/csv" }));
    Object.assign(document.createElement("a"), { href: url, download: `${table.dataset.part}.csv` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  });
  table.parentElement.after(button);
}

function csvOf(table) {
  const words = (cell) => cell.dataset.value ?? cell.textContent.trim();
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  return [...table.rows].map((row) => [...row.cells].map((cell) => quoted(words(cell))).join(",")).join("\n") + "\n";
}
