// The plots of an evaluation, each as what `plot` draws. view: `section` and `arrays`; lines: {name, cell, colour, dash}.

function heatmap(view, colours) {
  const { attacks, defenses, cells } = view.section;
  const at = (attack, defense) => cells[view.cellOf(attack, defense)]?.damage ?? [null, null, null];
  const values = attacks.map((attack) => defenses.map((defense) => at(attack, defense)));
  const judged = cells
    .filter(({ defense }) => !view.section.references.includes(defense))
    .map(({ damage }) => damage[0]);
  const element = view.plotElement("heatmap");
  element.style.minWidth = `${180 + 62 * defenses.length}px`;
  return {
    height: 90 + 30 * attacks.length + (defenses.length > 5 ? 70 : 0),
    traces: [
      {
        type: "heatmap",
        z: values.map((row) => row.map(([mean]) => mean)),
        x: defenses.map((_, i) => i),
        y: attacks.map((_, i) => i),
        text: values.map((row) => row.map(([mean]) => (mean === null ? "" : mean.toPrecision(3)))),
        texttemplate: "%{text}",
        customdata: values.map((row, i) =>
          row.map(([mean, low, high], j) =>
            mean === null
              ? ""
              : `${attacks[i]}<br>${defenses[j]}<br>${mean.toPrecision(4)}` +
                (low === null ? "" : ` (${low.toPrecision(4)} to ${high.toPrecision(4)})`)
          )
        ),
        hovertemplate: "%{customdata}<extra></extra>",
        xgap: 2,
        ygap: 2,
        zmin: 0,
        zmax: judged.length ? Math.max(...judged) : undefined,
        colorscale: [
          [0, colours.page],
          [0.5, DARK.matches ? "#7a4a2a" : "#f7c59b"],
          [1, DARK.matches ? "#e0523f" : "#d6452f"]
        ],
        colorbar: { thickness: 10, outlinewidth: 0, tickfont: { size: 11 } }
      }
    ],
    layout: {
      margin: { l: 60, r: 10, t: 8, b: 30 },
      xaxis: {
        tickvals: defenses.map((_, i) => i),
        ticktext: defenses.map((name) => shorten(name, 24)),
        ...(defenses.length > 5 ? { tickangle: -35 } : {}),
        showgrid: false
      },
      yaxis: {
        tickvals: attacks.map((_, i) => i),
        ticktext: attacks.map((name) => shorten(name)),
        autorange: "reversed",
        showgrid: false
      }
    }
  };
}

function differences(view, lines) {
  const found = view.section.compared?.rows ?? [];
  return lines.flatMap((line) => {
    const { attack, defense } = view.section.cells[line.cell];
    const row = found.find((each) => each.attack === attack && each.defense === defense);
    return row ? [{ ...line, ...row.difference }] : [];
  });
}

function distribution(view, lines) {
  const n = view.section.episodes;
  return {
    height: 70 + 34 * Math.max(2, lines.length),
    traces: lines.map((line) => ({
      type: "box",
      orientation: "h",
      name: shorten(line.name, 26),
      x: view.arrays.damage.slice(line.cell * n, (line.cell + 1) * n),
      boxpoints: lines.length > 8 ? "outliers" : "all",
      jitter: 0.6,
      pointpos: 0,
      line: { width: 1.5, color: line.colour },
      marker: { size: 4, color: withAlpha(line.colour, 0.55) },
      fillcolor: withAlpha(line.colour, 0.16),
      text: Array.from({ length: n }, (_, world) => `world ${world}`),
      hovertemplate: "%{text}: %{x:.3g}<extra></extra>"
    })),
    layout: { xaxis: { title: "damage per frame", rangemode: "tozero" }, yaxis: { autorange: "reversed" } }
  };
}

// For rising damages the share of the episodes that have more, as performance profiles show the scores of runs.
function profile(view, lines) {
  const n = view.section.episodes;
  const sorted = lines.map((line) => view.arrays.damage.slice(line.cell * n, (line.cell + 1) * n).sort());
  const most = Math.max(1e-9, ...sorted.map((damage) => damage[n - 1])),
    at = Array.from({ length: 201 }, (_, i) => (i / 200) * most);
  const above = sorted.map((damage) => at.map((x) => damage.filter((value) => value > x).length));
  const bands = lines.length > 5 ? [] : lines.map((line, i) => band(line, at, above[i].map((k) => wilson(k, n))));
  const curves = lines.map((line, i) => ({
    ...curve(
      line,
      at,
      above[i].map((k) => k / n)
    ),
    line: { color: line.colour, dash: line.dash, width: 2, shape: "hv" },
    hovertemplate: `${line.name}<br>more than %{x:.3g} in %{y:.0%} of the episodes<extra></extra>`
  }));
  return {
    traces: [...bands, ...curves],
    layout: {
      xaxis: { title: "damage per frame" },
      yaxis: { title: "share of episodes", range: [0, 1.02], tickformat: ".0%" }
    }
  };
}

// Wilson's 95 % interval of the share k / n.
function wilson(k, n) {
  const z = 1.959964,
    share = k / n,
    middle = share + (z * z) / (2 * n),
    half = z * Math.sqrt((share * (1 - share)) / n + (z * z) / (4 * n * n));
  return [middle - half, middle + half].map((bound) => Math.min(1, Math.max(0, bound / (1 + (z * z) / n))));
}

// What lies between the bounds [[low, high], ...] at x.
function band(line, x, bounds) {
  return {
    type: "scatter",
    mode: "lines",
    line: { width: 0 },
    fill: "toself",
    fillcolor: withAlpha(line.colour, 0.1),
    hoverinfo: "skip",
    x: [...x, ...[...x].reverse()],
    y: [...bounds.map(([, high]) => high), ...bounds.map(([low]) => low).reverse()]
  };
}

function course(view, line, name) {
  const { horizon } = view.section,
    values = view.arrays[name].slice(line.cell * horizon, (line.cell + 1) * horizon);
  return Array.from(values, (value) => (Number.isNaN(value) ? null : value));
}

function damageCourse(view, lines) {
  const frames = Array.from({ length: view.section.horizon }, (_, t) => t + 1);
  const bands =
    lines.length > 5
      ? []
      : lines.map((line) => {
          const low = course(view, line, "damage_q10");
          return band(
            line,
            frames,
            course(view, line, "damage_q90").map((high, t) => [low[t], high])
          );
        });
  const means = lines.map((line) => curve(line, frames, course(view, line, "damage_mean")));
  return {
    traces: [...bands, ...means],
    layout: { xaxis: { title: "frame" }, yaxis: { title: "damage", rangemode: "tozero" } }
  };
}

function trustCourse(view, lines) {
  const frames = Array.from({ length: view.section.horizon }, (_, t) => t + 1);
  const traces = lines.flatMap((line) => [
    curve({ ...line, dash: "solid", name: `${line.name}, benign` }, frames, course(view, line, "benign_trust_mean")),
    curve(
      { ...line, dash: "dot", name: `${line.name}, adversaries` },
      frames,
      course(view, line, "adversary_trust_mean")
    )
  ]);
  return { traces, layout: { xaxis: { title: "frame" }, yaxis: { title: "trust", range: [0, 1.02] } } };
}

// Who is accused when every agent below a mean trust is: from nobody to everybody.
function rocOf(view, line) {
  const parts = view.arrays.scores.length / (2 * view.section.cells.length),
    first = 2 * parts * line.cell;
  const [adversaries, others] = [0, 1].map((i) =>
    Array.from(view.arrays.scores.slice(first + i * parts, first + (i + 1) * parts))
  );
  const rates = (counts) => {
    const total = counts.reduce((a, b) => a + b, 0);
    let sum = 0;
    return total ? [0, ...counts.map((count) => (sum += count) / total)] : null;
  };
  return { right: rates(adversaries), wrong: rates(others) };
}

function roc(view, lines, colours) {
  const traces = lines.flatMap((line) => {
    const { right, wrong } = rocOf(view, line);
    return right && wrong ? [curve(line, wrong, right)] : [];
  });
  return {
    traces: [diagonal(colours), ...traces],
    layout: {
      xaxis: { title: "share of the others accused", range: [-0.02, 1.02] },
      yaxis: { title: "adversaries accused", range: [-0.02, 1.04] },
      annotations: traces.length ? [] : [nothing("no adversary acts, or no defense shown has an opinion")]
    }
  };
}

function calibration(view, kind, lines, colours) {
  const traces = lines.flatMap((line) => {
    const pooled = view.section.cells[line.cell].pooled[kind];
    if (!pooled) return [];
    const most = Math.max(...pooled.count),
      kept = pooled.count.map((count, i) => i).filter((i) => pooled.count[i]);
    return [
      {
        ...curve(
          line,
          kept.map((i) => pooled.mean_forecast[i]),
          kept.map((i) => pooled.share_true[i])
        ),
        mode: "lines+markers",
        marker: { color: line.colour, size: kept.map((i) => 4 + 10 * Math.sqrt(pooled.count[i] / most)) },
        text: kept.map((i) => `${pooled.count[i]} forecasts`),
        hovertemplate: `${line.name}<br>trust %{x:.2f}, true %{y:.2f}, %{text}<extra></extra>`
      }
    ];
  });
  return {
    traces: [diagonal(colours), ...traces],
    layout: {
      xaxis: { title: "trust", range: [-0.03, 1.03] },
      yaxis: { title: "share true", range: [-0.03, 1.06] },
      annotations: traces.length ? [] : [nothing("no defense shown has an opinion")]
    }
  };
}

// The diagonal of a plot from 0 to 1: chance, or what ought to be.
function diagonal(colours) {
  return {
    type: "scatter",
    mode: "lines",
    x: [0, 1],
    y: [0, 1],
    line: { color: colours.line, dash: "dot", width: 1 },
    hoverinfo: "skip"
  };
}

function curve(line, x, y) {
  return {
    type: "scatter",
    mode: "lines",
    x,
    y,
    name: line.name,
    line: { color: line.colour, dash: line.dash, width: 2 },
    hovertemplate: `${line.name}<br>%{x:.3g}: %{y:.3g}<extra></extra>`
  };
}

function nothing(words) {
  return { text: words, xref: "paper", yref: "paper", x: 0.5, y: 0.5, showarrow: false };
}
