// Tables whose columns sort by a click: numbers by their value, absent ones last.

function makeSortable(table) {
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
