// Security curves, learning curves, and the attackers of an exploitation.

function showCurve(root, section) {
  const attacks = [...new Set(section.lines.map((line) => line.attack))];
  const defenses = [...new Set(section.lines.map((line) => line.defense))];
  const numeric = section.values.every((value) => typeof value === "number");
  const most = Math.max(...section.lines.flatMap((line) => line.mean_high.filter((value) => value !== null)));
  attacks.forEach((attack, i) => {
    const lines = section.lines.filter((line) => line.attack === attack);
    plot(root.querySelector(`[data-plot="${i}"]`), () => ({
      traces: lines.map((line) => {
        const k = defenses.indexOf(line.defense),
          minus = (a, b) => (a === null || b === null ? 0 : a - b);
        return {
          ...curve({ name: line.defense, colour: lineColour(k), dash: lineDash(k) }, section.values, line.mean),
          mode: "lines+markers",
          error_y: {
            type: "data",
            symmetric: false,
            width: 4,
            thickness: 1.5,
            color: lineColour(k),
            array: line.mean.map((mean, j) => minus(line.mean_high[j], mean)),
            arrayminus: line.mean.map((mean, j) => minus(mean, line.mean_low[j]))
          }
        };
      }),
      layout: {
        showlegend: true,
        legend: { orientation: "h", y: 1.12, x: 0 },
        margin: { l: 46, r: 12, t: 34, b: 40 },
        xaxis: { title: section.over, type: numeric ? "linear" : "category" },
        yaxis: { title: section.metric.replaceAll("_", " "), range: [0, 1.05 * most] }
      }
    }));
  });
}

function showLearning(root, section) {
  const layout = { xaxis: { title: "steps" }, yaxis: { title: "damage per frame", rangemode: "tozero" } };
  const runs = section.runs,
    same = runs.every((run) => String(run.steps) === String(runs[0].steps));
  const mean = (name) => runs[0].steps.map((_, i) => runs.reduce((sum, run) => sum + run[name][i], 0) / runs.length);
  const thick = (name, i, dash) => ({
    ...curve({ name, colour: lineColour(i), dash }, runs[0].steps, mean(name)),
    line: { color: lineColour(i), width: 3, dash }
  });
  plot(root.querySelector('[data-plot="damage_per_frame"]'), () => ({
    traces: [
      ...runs.map((run) => ({
        ...curve(
          { name: run.name, colour: withAlpha(lineColour(0), runs.length > 1 ? 0.45 : 1), dash: "solid" },
          run.steps,
          run.damage_per_frame
        )
      })),
      ...(same && runs.length > 1 ? [thick("damage_per_frame", 0, "solid")] : [])
    ],
    layout
  }));
  plot(root.querySelector('[data-plot="parts"]'), () => ({
    traces: same
      ? [thick("false_tracks_per_frame", 1, "solid"), thick("missing_targets_per_frame", 2, "dot")]
      : runs.flatMap((run) => [
          curve(
            { name: `${run.name}, false`, colour: lineColour(1), dash: "solid" },
            run.steps,
            run.false_tracks_per_frame
          ),
          curve(
            { name: `${run.name}, missing`, colour: lineColour(2), dash: "dot" },
            run.steps,
            run.missing_targets_per_frame
          )
        ]),
    layout
  }));
}

function showExploitation(root, section) {
  const kinds = ["scripted", "searched", "learned"];
  const rows = section.attackers.map(({ name, kind, damage }) => ({
    name,
    ...damage.mean,
    colour: lineColour(kinds.indexOf(kind))
  }));
  plot(root.querySelector('[data-plot="attackers"]'), intervalPlot(rows, "mean damage per frame", true));
}
