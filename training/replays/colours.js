// The page's colours by name, as they are now: light or dark.

const COLOUR_NAMES = [
  "page",
  "card",
  "ink",
  "soft",
  "line",
  "grid",
  "accent",
  "benign",
  "adversary",
  "injected",
  "published",
  "hidden",
  "tentative",
  "missing",
  "in-picture",
  "no-opinion",
  "map",
  "fov-benign",
  "fov-adversary"
];
const DARK = window.matchMedia("(prefers-color-scheme: dark)");

function readColours() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(COLOUR_NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

// Of the detections of one agent, among the agents of its role: teal to violet, or red to orange.
function agentColour(recording, agent) {
  const { adversary } = recording.agents[agent];
  const same = recording.agents.map((_, k) => k).filter((k) => recording.agents[k].adversary === adversary);
  const place = (same.indexOf(agent) + 0.5) / same.length;
  const hue = adversary ? 349 + 43 * place : 180 + 79 * place;
  return `hsl(${hue % 360} 70% ${DARK.matches ? 64 : 42}%)`;
}

// From red (0) over amber (0.5) to green (1).
function trustColour(trust, colours) {
  return Number.isNaN(trust) ? colours["no-opinion"] : `hsl(${137 * trust ** 1.6} 65% ${DARK.matches ? 58 : 40}%)`;
}
