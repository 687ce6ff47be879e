// A recording as `recording.py` writes it: what stays the same, and typed arrays with every frame one after the other.

const TENTATIVE = 0,
  HIDDEN = 1,
  PUBLISHED = 2; // track_kind
const HONEST = 0,
  CLUTTER = 1,
  INJECTED = 2; // detection_kind
const EXPECTED = 1,
  DETECTED = 2,
  HIT = 4,
  HELD = 8; // bits of evidence

class Recording {
  static async load(written) {
    return new Recording(written, await unpack(written.packed));
  }

  constructor(written, arrays) {
    Object.assign(this, written, arrays);
    this.count = this.agents.length;
  }

  // The rows of `target`, `detection` or `track` that belong to frame t, counted from 0.
  rows(kind, t) {
    const end = this[`${kind}_end`],
      rows = [];
    for (let row = t ? end[t - 1] : 0; row < end[t]; row++) rows.push(row);
    return rows;
  }

  // The row of the track with this id in every frame; -1 where there is none.
  rowsOfTrack(id) {
    return Array.from(
      { length: this.frames },
      (_, t) => this.rows("track", t).find((row) => this.track[row] === id) ?? -1
    );
  }

  evidenceOn(row, agent) {
    return this.evidence[row * this.count + agent];
  }

  agentTrust(agent) {
    return Array.from({ length: this.frames }, (_, t) => this.agent_trust[t * this.count + agent]);
  }

  agentStd(agent) {
    return Array.from({ length: this.frames }, (_, t) => this.agent_std[t * this.count + agent]);
  }

  // How many of the rows of each frame pass a test.
  counts(kind, test) {
    return Array.from({ length: this.frames }, (_, t) => this.rows(kind, t).filter(test).length);
  }
}
