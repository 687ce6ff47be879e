// A frame, and what is chosen in it, in words.

function describeFrame(recording, t) {
  const wrong = recording.false_tracks[t],
    made = recording.injected_tracks[t];
  return (
    `picture ${recording.published_tracks[t]}, false ${wrong} (injected ${made}), ` +
    `missing ${recording.missing_targets[t]} of ${recording.visible_targets[t]}, GOSPA ${recording.gospa[t].toPrecision(3)} m`
  );
}

function describeChosen(recording, t, chosen) {
  if (!chosen) return "";
  const number = (mean, std) => (Number.isNaN(mean) ? "no opinion" : `trust ${mean.toFixed(2)} ± ${std.toFixed(2)}`);
  if (chosen.agent !== undefined) {
    const k = chosen.agent,
      at = t * recording.count + k;
    return `${recording.agents[k].name}: ${number(recording.agent_trust[at], recording.agent_std[at])}`;
  }
  const row = recording.rows("track", t).find((r) => recording.track[r] === chosen.track);
  if (row === undefined) return `track ${chosen.track}: not there in this frame`;
  const kind = ["tentative", "hidden", "published"][recording.track_kind[row]],
    agents = recording.agents.map((_, k) => k);
  const counted = (bits) => agents.filter((k) => (recording.evidenceOn(row, k) & bits) === bits).length;
  const score = recording.track_score[row],
    existence = 1 / (1 + Math.exp(-score));
  return (
    `track ${chosen.track}: ${recording.track_false[row] ? "false, " : ""}${kind}, ` +
    `${number(recording.track_trust[row], recording.track_std[row])}, score ${score.toFixed(1)} nats ` +
    `(existence ${existence.toFixed(3)}), seen by ${counted(EXPECTED | DETECTED)} of ${counted(EXPECTED)} that should`
  );
}
