// Plots in the page's colours, drawn anew when these change.

const LINE_COLOURS = ["#3b82d6", "#e0653a", "#2fa36b", "#b565d4", "#c2930a", "#d94f8a", "#1aa3b5", "#8a8f98"];
const DASHES = ["solid", "dash", "dashdot"];
const drawn = new Map(); // element: what draws it

function lineColour(i) {
  return LINE_COLOURS[i % LINE_COLOURS.length];
}

function lineDash(i) {
  return DASHES[Math.floor(i / LINE_COLOURS.length) % DASHES.length];
}

function withAlpha(colour, alpha) {
  return (
    colour +
    Math.round(255 * alpha)
      .toString(16)
      .padStart(2, "0")
  );
}

function shorten(name, most = 30) {
  return name.length <= most ? name : `${name.slice(0, most - 9)}…${name.slice(-8)}`;
}

// Draws `make(colours)`, which gives {traces, layout, height}, now and whenever the colours change.
function plot(element, make) {
  if (!element) return;
  drawn.set(element, make);
  draw(element);
}

function draw(element) {
  const colours = readColours(),
    { traces, layout = {}, height = 300 } = drawn.get(element)(colours);
  const axis = { gridcolor: colours.grid, zerolinecolor: colours.line, linecolor: colours.line, automargin: true };
  const title = (own) => (typeof own?.title === "string" ? { ...own, title: { text: own.title, standoff: 6 } } : own);
  const whole = {
    height,
    autosize: true,
    margin: { l: 46, r: 12, t: 8, b: 38 },
    showlegend: false,
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    hovermode: "closest",
    font: { family: FONT, size: 12, color: colours.ink },
    hoverlabel: { bgcolor: colours.card, bordercolor: colours.line, font: { color: colours.ink } },
    ...layout,
    xaxis: { ...axis, ...title(layout.xaxis) },
    yaxis: { ...axis, ...title(layout.yaxis) }
  };
  const settings = {
    responsive: true,
    displaylogo: false,
    displayModeBar: "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]
  };
  Plotly.react(element, traces, whole, settings);
}

DARK.addEventListener("change", () => drawn.forEach((_, element) => draw(element)));

// Rows with a point and its interval, from the top: [{name, value, low, high, colour}].
function intervalPlot(rows, axisTitle, zero) {
  return (colours) => ({
    height: 70 + 26 * Math.max(2, rows.length),
    traces: [
      {
        type: "scatter",
        mode: "markers",
        x: rows.map((row) => row.value),
        y: rows.map((_, i) => i),
        text: rows.map((row) => row.name),
        customdata: rows.map(
          (row) => `${row.value.toPrecision(4)} (${row.low.toPrecision(4)} to ${row.high.toPrecision(4)})`
        ),
        hovertemplate: "%{text}<br>%{customdata}<extra></extra>",
        marker: { size: 10, color: rows.map((row) => row.colour) },
        error_x: {
          type: "data",
          symmetric: false,
          thickness: 2,
          width: 5,
          color: colours.soft,
          array: rows.map((row) => row.high - row.value),
          arrayminus: rows.map((row) => row.value - row.low)
        }
      }
    ],
    layout: {
      xaxis: { title: axisTitle, rangemode: zero ? "tozero" : "normal", zeroline: true },
      yaxis: {
        tickvals: rows.map((_, i) => i),
        ticktext: rows.map((row) => shorten(row.name, 26)),
        range: [rows.length - 0.4, -0.6],
        showgrid: false,
        zeroline: false
      }
    }
  });
}
