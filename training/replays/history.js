// What was before and what comes: charts over the frames, with a line at the present one.

// The charts of a recording, from the top: title, keys [words, colour], height and draw(context, box) each.
// most: the greatest damage that the first has room for.
function chartsOf(recording, chosen, most, colours) {
  const charts = [damageChart(recording, most, colours), agentsChart(recording, chosen, colours)];
  if (chosen?.agent !== undefined) charts.push(...agentCharts(recording, chosen.agent, colours));
  if (chosen?.track !== undefined) charts.push(...trackCharts(recording, chosen.track, colours));
  return charts;
}

function drawHistory(canvas, charts, recording, t, colours) {
  const heights = charts.map((chart) => chart.height + 34);
  const { context, width } = prepare(
    canvas,
    heights.reduce((a, b) => a + b, 18)
  );
  const box = { left: LEFT, width: width - LEFT - RIGHT, frames: recording.frames, top: 0 };
  charts.forEach((chart, i) => {
    box.top += 24;
    box.height = chart.height;
    drawTitle(context, chart, box, colours);
    chart.draw(context, box);
    const x = atFrame(box, t);
    polygon(
      context,
      [
        [x, box.top],
        [x, box.top + box.height]
      ],
      { stroke: colours.accent, width: 1.5, closed: false }
    );
    box.top += heights[i] - 24;
  });
  const words = { colour: colours.soft, size: 11 };
  text(context, "frame 1", box.left, box.top + 4, words);
  text(context, String(recording.frames), box.left + box.width, box.top + 4, { ...words, align: "right" });
}

function drawTitle(context, { title, keys = [] }, box, colours) {
  text(context, title, 0, box.top - 12, { colour: colours.ink, size: 12, weight: "600" });
  let right = box.left + box.width;
  for (const [words, colour] of [...keys].reverse()) {
    text(context, words, right, box.top - 12, { colour, size: 11, align: "right" });
    right -= context.measureText(words).width + 10;
  }
}

function greatestDamage({ false_tracks, missing_targets }) {
  return Math.max(...Array.from(false_tracks, (n, t) => n + missing_targets[t]));
}

function damageChart(recording, most, colours) {
  const injected = Array.from(recording.injected_tracks),
    missing = Array.from(recording.missing_targets);
  const others = Array.from(recording.false_tracks, (n, t) => n - injected[t]);
  const layers = [
    [injected, colours.injected],
    [others, colours.hidden],
    [missing, colours.missing]
  ];
  const keys = [
    ["injected", colours.injected],
    ["other false", colours.hidden],
    ["missing", colours.missing]
  ];
  return barChart("Damage", 64, layers, keys, colours, most);
}

function agentsChart(recording, chosen, colours) {
  const draw = (context, box) => {
    drawAxis(context, box, 0, 1, colours);
    recording.agents.forEach(({ adversary }, k) => {
      context.globalAlpha = chosen?.agent === undefined || chosen.agent === k ? 1 : 0.25;
      const width = chosen?.agent === k ? 2.5 : 1.3;
      drawLine(context, box, recording.agentTrust(k), 0, 1, colours[adversary ? "adversary" : "benign"], width);
    });
    context.globalAlpha = 1;
    if (recording.agent_trust.every(Number.isNaN))
      sayNothing(context, box, "the defense has no opinion of agents", colours);
  };
  const keys = [
    ["adversaries", colours.adversary],
    ["benign", colours.benign]
  ];
  return { title: "Trust in agents", height: 84, keys, draw };
}

// Mean and standard deviation of a belief, and a dashed line at `mark`.
function beliefChart(title, means, stds, mark, colour, colours) {
  const draw = (context, box) => {
    drawAxis(context, box, 0, 1, colours);
    const edge = (sign) => means.map((mean, t) => Math.min(1, Math.max(0, mean + sign * stds[t])));
    const points = (values) => values.map((value, t) => [atFrame(box, t), box.top + box.height * (1 - value)]);
    const upper = points(edge(1)),
      lower = points(edge(-1)),
      known = means.map((mean, t) => !Number.isNaN(mean + stds[t]));
    context.globalAlpha = 0.18;
    for (let t = 1; t < means.length; t++) {
      if (known[t] && known[t - 1])
        polygon(context, [upper[t - 1], upper[t], lower[t], lower[t - 1]], { fill: colour });
    }
    context.globalAlpha = 1;
    const y = box.top + box.height * (1 - mark);
    context.setLineDash([3, 4]);
    polygon(
      context,
      [
        [box.left, y],
        [box.left + box.width, y]
      ],
      { stroke: colours.soft, closed: false }
    );
    context.setLineDash([]);
    drawLine(context, box, means, 0, 1, colour, 2);
    if (means.every(Number.isNaN)) sayNothing(context, box, "no opinion", colours);
  };
  return { title, height: 84, draw, keys: [["mean ± std", colours.soft]] };
}

function agentCharts(recording, k, colours) {
  const { name, adversary } = recording.agents[k];
  const seen = (bits) => (row) => (recording.evidenceOn(row, k) & (EXPECTED | DETECTED)) === bits;
  const own = (kind) => (row) => recording.detection_agent[row] === k && recording.detection_kind[row] === kind;
  const isConfirmed = (row) => recording.track_kind[row] !== TENTATIVE;
  const tracks = (bits) => recording.counts("track", (row) => isConfirmed(row) && seen(bits)(row));
  const colour = colours[adversary ? "adversary" : "benign"];
  return [
    beliefChart(
      `${name}: trust`,
      recording.agentTrust(k),
      recording.agentStd(k),
      recording.accuse_below,
      colour,
      colours
    ),
    barChart(
      "Confirmed tracks in its FOV",
      56,
      [
        [tracks(EXPECTED | DETECTED), colours.published],
        [tracks(EXPECTED), colours.adversary]
      ],
      [
        ["it sees", colours.published],
        ["it does not", colours.adversary]
      ],
      colours
    ),
    barChart(
      "Its reports",
      56,
      [
        [recording.counts("detection", own(HONEST)), colours.accent],
        [recording.counts("detection", own(CLUTTER)), colours["no-opinion"]],
        [recording.counts("detection", own(INJECTED)), colours.injected]
      ],
      [
        ["targets", colours.accent],
        ["clutter", colours["no-opinion"]],
        ["injected", colours.injected]
      ],
      colours
    )
  ];
}

function trackCharts(recording, id, colours) {
  const rows = recording.rowsOfTrack(id),
    of = (values) => rows.map((row) => (row < 0 ? NaN : values[row]));
  const scores = of(recording.track_score),
    known = scores.filter((score) => !Number.isNaN(score));
  const low = Math.floor(Math.min(0, ...known)),
    high = Math.ceil(Math.max(1, ...known));
  const drawScore = (context, box) => {
    drawAxis(context, box, low, high, colours);
    drawLine(context, box, scores, low, high, colours.accent, 2);
  };
  return [
    beliefChart(
      `Track ${id}: trust`,
      of(recording.track_trust),
      of(recording.track_std),
      0.5,
      colours.published,
      colours
    ),
    { title: "Its score (nats)", height: 56, draw: drawScore },
    evidenceChart(recording, rows, colours)
  ];
}

// A line for every agent that was ever to see the track, a cell for every frame.
function evidenceChart(recording, rows, colours) {
  const seen = (k) => rows.some((row) => row >= 0 && recording.evidenceOn(row, k) & (EXPECTED | HIT));
  const agents = recording.agents.map((_, k) => k).filter(seen),
    step = 15;
  const draw = (context, box) => {
    const width = Math.max(1, box.width / box.frames);
    agents.forEach((k, i) => {
      const y = box.top + i * step,
        { name, adversary } = recording.agents[k];
      text(context, shortName(name), box.left - 5, y + step / 2, {
        colour: colours[adversary ? "adversary" : "benign"],
        size: 10,
        align: "right"
      });
      rows.forEach((row, t) => {
        const bits = row < 0 ? 0 : recording.evidenceOn(row, k);
        if (!(bits & (EXPECTED | HIT))) return;
        context.fillStyle = bits & (DETECTED | HIT) ? colours.published : colours.adversary;
        context.globalAlpha = bits & HELD ? 1 : 0.55;
        context.fillRect(atFrame(box, t) - width / 2, y + 2, width + 0.3, step - 4);
      });
      context.globalAlpha = 1;
    });
  };
  const keys = [
    ["detected", colours.published],
    ["missed", colours.adversary],
    ["pale: not held", colours.soft]
  ];
  return { title: "Evidence by agent", height: Math.max(1, agents.length) * step, keys, draw };
}
