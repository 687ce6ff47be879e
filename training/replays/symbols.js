// The symbols of agents, targets, detections and tracks, which map and legend share.

function detectionSymbol(context, at, kind, colour, colours) {
  if (kind === INJECTED) crossSymbol(context, at, 4.5, colours.injected);
  else if (kind === CLUTTER) circle(context, at, 3, { stroke: colour });
  else circle(context, at, 2.4, { fill: colour });
}

function crossSymbol(context, [x, y], r, colour) {
  context.beginPath();
  (context.moveTo(x - r, y - r),
    context.lineTo(x + r, y + r),
    context.moveTo(x - r, y + r),
    context.lineTo(x + r, y - r));
  paint(context, null, colour, 2);
}

function targetSymbol(context, [x, y], state, colours) {
  const r = 5.5,
    points = [
      [x, y - r],
      [x + r, y],
      [x, y + r],
      [x - r, y]
    ];
  const fill = { shown: colours["in-picture"], missing: colours.missing, unseen: colours.map }[state];
  polygon(context, points, { fill, stroke: state === "unseen" ? colours.soft : colours.ink, width: 1.2 });
}

function trackColour(kind, isFalse, colours) {
  return isFalse ? colours.injected : [colours.tentative, colours.hidden, colours.published][kind];
}

function trackSymbol(context, at, kind, isFalse, colours) {
  const stroke = trackColour(kind, isFalse, colours);
  if (kind === TENTATIVE) circle(context, at, 5, { stroke });
  else circle(context, at, 8.5, { stroke, width: 2, dash: kind === HIDDEN ? [4, 3] : [] });
}

function agentSymbol(context, [x, y], adversary, colours) {
  if (adversary)
    polygon(
      context,
      [
        [x, y - 6.5],
        [x + 6, y + 4.5],
        [x - 6, y + 4.5]
      ],
      { fill: colours.adversary }
    );
  else
    polygon(
      context,
      [
        [x - 4.5, y - 4.5],
        [x + 4.5, y - 4.5],
        [x + 4.5, y + 4.5],
        [x - 4.5, y + 4.5]
      ],
      { fill: colours.benign }
    );
}

// adversary_0 as A0, benign_12 as B12.
function shortName(name) {
  const [role, number] = name.split("_");
  return `${role[0].toUpperCase()}${number}`;
}
