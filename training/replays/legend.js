// What the symbols of the map mean, drawn by what draws the map.

const LEGEND = [
  ["adversary, trust around it", (c, at, k) => agentSymbol(c, at, true, k)],
  ["benign agent", (c, at, k) => agentSymbol(c, at, false, k)],
  ["target in the picture", (c, at, k) => targetSymbol(c, at, "shown", k)],
  ["target missing from it", (c, at, k) => targetSymbol(c, at, "missing", k)],
  ["target in no FOV", (c, at, k) => targetSymbol(c, at, "unseen", k)],
  ["detection, in its agent's colour", (c, at, k) => circle(c, at, 2.4, { fill: k.benign })],
  ["clutter", (c, at, k) => circle(c, at, 3, { stroke: k.benign })],
  ["injection", (c, at, k) => crossSymbol(c, at, 4.5, k.injected)],
  ["track, published", (c, at, k) => trackSymbol(c, at, PUBLISHED, false, k)],
  ["track, published and false", (c, at, k) => trackSymbol(c, at, PUBLISHED, true, k)],
  ["track, hidden by the defense", (c, at, k) => trackSymbol(c, at, HIDDEN, false, k)],
  ["track, tentative", (c, at, k) => trackSymbol(c, at, TENTATIVE, false, k)]
];

function drawLegend(list, colours) {
  const entries = LEGEND.map(([words, draw]) => {
    const entry = document.createElement("li"),
      holder = document.createElement("span"),
      canvas = document.createElement("canvas");
    holder.append(canvas);
    entry.append(holder, words);
    return { entry, canvas, draw };
  });
  list.replaceChildren(...entries.map(({ entry }) => entry));
  for (const { canvas, draw } of entries) draw(prepare(canvas, 22).context, [11, 11], colours);
}
