// One frame as a map.

class Camera {
  constructor([xMin, xMax, yMin, yMax], size) {
    this.scale = size / Math.max(xMax - xMin, yMax - yMin);
    this.x = (xMin + xMax) / 2;
    this.y = (yMin + yMax) / 2;
    this.middle = size / 2;
  }

  pixels(x, y) {
    return [this.middle + (x - this.x) * this.scale, this.middle - (y - this.y) * this.scale];
  }

  pixelsOf(values, row) {
    return this.pixels(values[2 * row], values[2 * row + 1]);
  }
}

// view: colours, layers {fovs, detections, trails, tracks, labels}, chosen {agent} or {track} or null.
function drawMap(context, size, extent, recording, t, view) {
  const camera = new Camera(extent, size),
    { colours, layers } = view;
  context.fillStyle = colours.map;
  context.fillRect(0, 0, size, size);
  drawGrid(context, size, camera, colours);
  if (layers.fovs)
    recording.agents.forEach((agent, k) => drawFov(context, camera, agent, view, view.chosen?.agent === k, recording.count));
  if (layers.trails) drawTargetTrails(context, camera, recording, t, colours);
  if (layers.tracks) drawTrackTrails(context, camera, recording, t, colours);
  for (const row of recording.rows("track", t)) drawEllipse(context, camera, recording, row, view);
  if (layers.detections) drawDetections(context, camera, recording, t, view);
  for (const row of recording.rows("target", t)) {
    const state = recording.target_shown[row] ? "shown" : recording.target_visible[row] ? "missing" : "unseen";
    targetSymbol(context, camera.pixelsOf(recording.target_at, row), state, colours);
  }
  for (const row of recording.rows("track", t)) drawTrack(context, camera, recording, row, view);
  drawAgents(context, camera, recording, t, view);
}

function drawGrid(context, size, camera, colours) {
  const metres = size / camera.scale,
    step = niceStep(metres / 5);
  context.beginPath();
  for (let i = Math.ceil((camera.x - metres / 2) / step); i * step < camera.x + metres / 2; i++) {
    const [x] = camera.pixels(i * step, 0);
    (context.moveTo(x, 0), context.lineTo(x, size));
  }
  for (let i = Math.ceil((camera.y - metres / 2) / step); i * step < camera.y + metres / 2; i++) {
    const [, y] = camera.pixels(0, i * step);
    (context.moveTo(0, y), context.lineTo(size, y));
  }
  paint(context, null, colours.grid, 1);
  const length = step * camera.scale,
    words = step >= 1000 ? `${step / 1000} km` : `${step} m`;
  polygon(
    context,
    [
      [10, size - 10],
      [10 + length, size - 10]
    ],
    { stroke: colours.soft, width: 2, closed: false }
  );
  text(context, words, 10 + length / 2, size - 20, { colour: colours.soft, align: "center", halo: colours.map });
}

function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least);
}

// The more agents there are, the fainter their FOVs, so that many on one another stay light.
function drawFov(context, camera, agent, { colours }, isChosen, count) {
  const role = agent.adversary ? "adversary" : "benign";
  const outline = agent.outline.map(([x, y]) => camera.pixels(x, y));
  context.globalAlpha = Math.min(1, 6 / count);
  polygon(context, outline, { fill: colours[`fov-${role}`] });
  context.globalAlpha = isChosen ? 1 : 0.45;
  polygon(context, outline, { stroke: colours[role], width: isChosen ? 2 : 1 });
  context.globalAlpha = 1;
}

const TRAIL = 15, // frames
  LEAP = 0.1; // of the extent: nothing moves as far in a frame, so that something else has taken the place

// Where the targets were in the last frames. A slot that a new target has taken begins a new trail.
function drawTargetTrails(context, camera, recording, t, colours) {
  drawTrails(context, camera, recording, t, "target", () => colours["in-picture"]);
}

// Where the tracks were, in the colours of what they were then.
function drawTrackTrails(context, camera, recording, t, colours) {
  const colourOf = (row) => trackColour(recording.track_kind[row], recording.track_false[row], colours);
  drawTrails(context, camera, recording, t, "track", colourOf);
}

function drawTrails(context, camera, recording, t, kind, colourOf) {
  const last = new Map(),
    [xMin, xMax] = recording.extent,
    leap = LEAP * (xMax - xMin) * camera.scale;
  for (let s = Math.max(0, t - TRAIL); s <= t; s++) {
    for (const row of recording.rows(kind, s)) {
      const at = camera.pixelsOf(recording[`${kind}_at`], row),
        before = last.get(recording[kind][row]);
      if (before?.s === s - 1 && Math.hypot(at[0] - before.at[0], at[1] - before.at[1]) < leap)
        polygon(context, [before.at, at], { stroke: colourOf(row), width: 1.5, closed: false });
      last.set(recording[kind][row], { s, at });
    }
  }
}

function drawDetections(context, camera, recording, t, { colours, chosen, detectionColours }) {
  for (const row of recording.rows("detection", t)) {
    const agent = recording.detection_agent[row],
      at = camera.pixelsOf(recording.detection_at, row);
    context.globalAlpha = chosen?.agent === undefined || chosen.agent === agent ? 1 : 0.2;
    detectionSymbol(context, at, recording.detection_kind[row], detectionColours[agent], colours);
  }
  context.globalAlpha = 1;
}

// Two standard deviations, and where the track will be in five frames.
function drawEllipse(context, camera, recording, row, { colours }) {
  const [a, b, angle] = recording.track_ellipse.subarray(3 * row, 3 * row + 3);
  const kind = recording.track_kind[row],
    colour = trackColour(kind, recording.track_false[row], colours);
  const [x, y] = camera.pixelsOf(recording.track_at, row);
  const [vx, vy] = recording.track_velocity.subarray(2 * row, 2 * row + 2),
    ahead = 5 * recording.dt * camera.scale;
  if (2 * a * camera.scale > 2) {
    context.beginPath();
    context.ellipse(x, y, 2 * a * camera.scale, 2 * b * camera.scale, -angle, 0, 2 * Math.PI);
    context.globalAlpha = 0.14;
    if (kind === PUBLISHED) paint(context, colour);
    context.globalAlpha = 0.8;
    paint(context, null, colour, 1);
    context.globalAlpha = 1;
  }
  polygon(
    context,
    [
      [x, y],
      [x + vx * ahead, y - vy * ahead]
    ],
    { stroke: colour, closed: false }
  );
}

function drawTrack(context, camera, recording, row, { colours, layers, chosen }) {
  const at = camera.pixelsOf(recording.track_at, row),
    kind = recording.track_kind[row];
  trackSymbol(context, at, kind, recording.track_false[row], colours);
  if (chosen?.track === recording.track[row]) circle(context, at, 13, { stroke: colours.accent, width: 2.5 });
  if (!layers.labels || kind === TENTATIVE) return;
  const trust = recording.track_trust[row];
  const words = Number.isNaN(trust) ? "" : trust.toFixed(2).replace(/^0/, "");
  const colour = trackColour(kind, recording.track_false[row], colours);
  text(context, words, at[0] + 11, at[1] - 8, { colour, size: 10, halo: colours.map });
}

// Triangle or square, and around it a ring that is as long and as green as the trust in the agent.
function drawAgents(context, camera, recording, t, { colours, layers, chosen }) {
  recording.agents.forEach((agent, k) => {
    const at = camera.pixels(...agent.at),
      trust = recording.agent_trust[t * recording.count + k],
      radius = recording.count > 8 ? 9.5 : 12;
    circle(context, at, radius, { fill: colours.card, stroke: colours.line, width: 3 });
    if (!Number.isNaN(trust)) {
      context.beginPath();
      context.arc(at[0], at[1], radius, -Math.PI / 2, -Math.PI / 2 + 2 * Math.PI * trust);
      paint(context, null, trustColour(trust, colours), 3);
    }
    agentSymbol(context, at, agent.adversary, colours);
    if (chosen?.agent === k) circle(context, at, 17, { stroke: colours.accent, width: 2.5 });
    if (layers.labels) {
      const colour = colours[agent.adversary ? "adversary" : "benign"];
      text(context, shortName(agent.name), at[0], at[1] + radius + 9, {
        colour,
        align: "center",
        weight: "600",
        halo: colours.map
      });
    }
  });
}

// What is nearest to a point of the map, {agent} or {track}; null where nothing is near.
function findAt(recording, t, camera, x, y) {
  const found = recording.agents.map((agent, k) => [camera.pixels(...agent.at), { agent: k }]);
  for (const row of recording.rows("track", t)) {
    found.push([camera.pixelsOf(recording.track_at, row), { track: recording.track[row] }]);
  }
  const distances = found.map(([at]) => Math.hypot(at[0] - x, at[1] - y));
  const nearest = distances.indexOf(Math.min(...distances));
  return nearest >= 0 && distances[nearest] <= 18 ? found[nearest][1] : null;
}
