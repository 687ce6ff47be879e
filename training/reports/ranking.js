// A ranking: for every scenario and threat model the damage of the worst attack, its place, and every attack.

function showRanking(root, section) {
  for (const table of root.querySelectorAll('[data-part="ranks"]')) makeSortable(table);
  section.groups.forEach((group, i) => {
    const element = (name) => root.querySelector(`[data-plot="${name}-${i}"]`);
    plot(element("worst"), (colours) => worstDamage(group, colours));
    plot(element("placed"), (colours) => placesBetween(group, colours));
    const table = element("attacks").closest("details");
    table.addEventListener("toggle", () => plot(element("attacks"), attackMap(group, element("attacks"))), { once: true });
  });
}

function rankedRows(group, name) {
  return group.rows
    .filter((row) => row[name] && row[name].value !== null)
    .map((row) => ({
      ...row[name],
      name: row.defense,
      colour: lineColour(row.reference ? LINE_COLOURS.length - 1 : 0)
    }));
}

function worstDamage(group, colours) {
  const drawn = intervalPlot(rankedRows(group, "worst"), "damage per frame", true)(colours);
  const marks = (name, symbol, words) => ({
    type: "scatter",
    mode: "markers",
    x: group.rows.map((row) => row[name].value),
    y: group.rows.map((_, i) => i),
    text: group.rows.map((row) => row.defense),
    hovertemplate: `%{text}<br>${words}: %{x:.4g}<extra></extra>`,
    marker: { symbol, size: 9, color: colours.soft, line: { width: 1.5, color: colours.soft } }
  });
  const others = [
    marks("worst_tenth", "diamond-open", "worst tenth"),
    marks("mean", "line-ns", "mean of all attacks"),
    marks("honest", "circle-open", "no attack")
  ];
  return { ...drawn, traces: [...others, ...drawn.traces] };
}

function placesBetween(group, colours) {
  const drawn = intervalPlot(rankedRows(group, "placed"), "place", true)(colours);
  const bound = (x) => ({ type: "line", x0: x, x1: x, y0: 0, y1: 1, yref: "paper", line: { color: colours.soft, dash: "dot" } });
  return { ...drawn, layout: { ...drawn.layout, shapes: [bound(0), bound(1)] } };
}

function attackMap(group, element) {
  const defenses = group.rows.map((row) => row.defense);
  const cells = group.attacks.flatMap((attack, i) =>
    defenses.map((defense, j) => ({ attack, defense, damage: [group.damage[i][j], null, null] }))
  );
  const references = group.rows.filter((row) => row.reference).map((row) => row.defense);
  return (colours) =>
    heatmap(
      {
        section: { attacks: group.attacks, defenses, cells, references },
        cellOf: (attack, defense) => cells.findIndex((cell) => cell.attack === attack && cell.defense === defense),
        plotElement: () => element
      },
      colours
    );
}
