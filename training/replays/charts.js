// What charts over the frames are made of: axes, lines, bars. box: left, top, width, height, frames.

const LEFT = 34,
  RIGHT = 8;

function atFrame(box, t) {
  return box.left + (box.frames > 1 ? (t / (box.frames - 1)) * box.width : 0);
}

function frameAt(box, x) {
  return Math.round(((x - box.left) / box.width) * (box.frames - 1));
}

function drawAxis(context, box, low, high, colours) {
  for (const value of [low, high]) {
    const y = box.top + box.height * (1 - (value - low) / (high - low));
    polygon(
      context,
      [
        [box.left, y],
        [box.left + box.width, y]
      ],
      { stroke: colours.line, closed: false }
    );
    const words = Number.isInteger(value) ? String(value) : value.toFixed(1);
    text(context, words, box.left - 5, y, { colour: colours.soft, size: 10, align: "right" });
  }
}

function sayNothing(context, box, words, colours) {
  text(context, words, box.left + box.width / 2, box.top + box.height / 2, { colour: colours.soft, align: "center" });
}

// Values over the frames; a gap where they are not numbers.
function drawLine(context, box, values, low, high, colour, width = 1.5) {
  context.beginPath();
  let drawing = false;
  values.forEach((value, t) => {
    if (Number.isNaN(value)) return (drawing = false);
    const x = atFrame(box, t),
      y = box.top + box.height * (1 - (value - low) / (high - low));
    drawing ? context.lineTo(x, y) : context.moveTo(x, y);
    drawing = true;
  });
  paint(context, null, colour, width);
}

// Bars that stand on one another: [[values, colour], ...].
function drawBars(context, box, layers, high) {
  const width = Math.max(1, box.width / box.frames);
  for (let t = 0; t < box.frames; t++) {
    let below = 0;
    for (const [values, colour] of layers) {
      const bottom = box.top + box.height * (1 - below / high),
        height = (box.height * values[t]) / high;
      context.fillStyle = colour;
      if (height) context.fillRect(atFrame(box, t) - width / 2, bottom - height, width + 0.3, height);
      below += values[t];
    }
  }
}

function barChart(title, height, layers, keys, colours, most = 1) {
  const totals = layers[0][0].map((_, t) => layers.reduce((sum, [values]) => sum + values[t], 0));
  const high = Math.max(most, ...totals);
  const draw = (context, box) => {
    drawAxis(context, box, 0, high, colours);
    drawBars(context, box, layers, high);
  };
  return { title, height, keys, draw };
}
