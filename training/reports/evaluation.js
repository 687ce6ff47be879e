// An evaluation: all cells at a glance, and the details of all that share an attack or a defense.

class EvaluationView {
  constructor(root, section, arrays) {
    Object.assign(this, { root, section, arrays });
    this.hidden = new Set();
    this.part = (name) => root.querySelector(`[data-part="${name}"]`);
    for (const name of ["cells", "glance", "differences"]) if (this.part(name)) makeSortable(this.part(name));
    this.part("group").value = `attack:${this.worstAttack()}`;
    this.plot("heatmap", (colours) => this.heatmap(colours));
    this.part("group").addEventListener("change", () => this.choose());
    this.plotElement("heatmap").on("plotly_click", ({ points: [point] }) => {
      this.part("group").value = `attack:${point.pointIndex[0]}`;
      this.choose();
    });
    this.choose();
  }

  plotElement(name) {
    return this.root.querySelector(`[data-plot="${name}"]`);
  }

  plot(name, make) {
    plot(this.plotElement(name), make);
  }

  cellOf(attack, defense) {
    return this.section.cells.findIndex((cell) => cell.attack === attack && cell.defense === defense);
  }

  // The cells of the chosen group: what they are called there, their number, how they are drawn.
  get group() {
    const [kind, index] = this.part("group").value.split(":"), { attacks, defenses } = this.section;
    const names = kind === "attack" ? defenses : attacks, fixed = (kind === "attack" ? attacks : defenses)[index];
    return names
      .map((name, i) => ({ name, cell: kind === "attack" ? this.cellOf(fixed, name) : this.cellOf(name, fixed), colour: lineColour(i), dash: lineDash(i) }))
      .filter((line) => line.cell >= 0);
  }

  // The attack that does the most damage to all defenses together, but for those that are there to compare with.
  worstAttack() {
    const { attacks, cells, references } = this.section;
    const total = (attack) => cells.filter((cell) => cell.attack === attack && !references.includes(cell.defense)).reduce((sum, { damage }) => sum + damage[0], 0);
    return attacks.map(total).reduce((best, value, i, all) => (value > all[best] ? i : best), 0);
  }

  get lines() {
    return this.group.filter((line) => !this.hidden.has(line.name));
  }

  choose() {
    this.hidden.clear();
    const boxes = this.group.map(({ name, colour, dash }) => {
      const label = document.createElement("label"), box = Object.assign(document.createElement("input"), { type: "checkbox", checked: true });
      const sample = document.createElement("i");
      sample.style.borderTopColor = colour;
      sample.style.borderTopStyle = dash === "solid" ? "solid" : "dashed";
      box.addEventListener("change", () => {
        box.checked ? this.hidden.delete(name) : this.hidden.add(name);
        this.drawGroup();
      });
      label.append(box, sample, name);
      return label;
    });
    this.part("lines").replaceChildren(...boxes);
    this.drawGroup();
  }

  drawGroup() {
    const { lines, section } = this;
    const rows = lines.map((line) => ({ ...line, ...asRow(section.cells[line.cell].damage) }));
    this.plot("intervals", intervalPlot(rows, "damage per frame", true));
    this.plot("differences", intervalPlot(this.differences(lines), "difference of damage", false));
    this.plot("distribution", () => this.distribution(lines));
    this.plot("damage", () => this.damageCourse(lines));
    this.plot("trust", () => this.trustCourse(lines));
    this.plot("roc", (colours) => this.roc(lines, colours));
    for (const kind of ["track_trust", "agent_trust"]) this.plot(kind, (colours) => this.calibration(kind, lines, colours));
  }

  heatmap(colours) {
    const { attacks, defenses, cells } = this.section;
    const at = (attack, defense) => cells[this.cellOf(attack, defense)]?.damage ?? [null, null, null];
    const values = attacks.map((attack) => defenses.map((defense) => at(attack, defense)));
    const judged = cells.filter(({ defense }) => !this.section.references.includes(defense)).map(({ damage }) => damage[0]);
    const element = this.plotElement("heatmap");
    element.style.minWidth = `${180 + 62 * defenses.length}px`;
    return {
      height: 90 + 30 * attacks.length + (defenses.length > 5 ? 70 : 0),
      traces: [{
        type: "heatmap", z: values.map((row) => row.map(([mean]) => mean)), x: defenses.map((_, i) => i), y: attacks.map((_, i) => i),
        text: values.map((row) => row.map(([mean]) => (mean === null ? "" : mean.toPrecision(3)))), texttemplate: "%{text}",
        customdata: values.map((row, i) => row.map(([mean, low, high], j) =>
          mean === null ? "" : `${attacks[i]}<br>${defenses[j]}<br>${mean.toPrecision(4)} (${low.toPrecision(4)} to ${high.toPrecision(4)})`)),
        hovertemplate: "%{customdata}<extra></extra>", xgap: 2, ygap: 2, zmin: 0, zmax: judged.length ? Math.max(...judged) : undefined,
        colorscale: [[0, colours.page], [0.5, DARK.matches ? "#7a4a2a" : "#f7c59b"], [1, DARK.matches ? "#e0523f" : "#d6452f"]],
        colorbar: { thickness: 10, outlinewidth: 0, tickfont: { size: 11 } },
      }],
      layout: {
        margin: { l: 60, r: 10, t: 8, b: 30 },
        xaxis: { tickvals: defenses.map((_, i) => i), ticktext: defenses.map((name) => shorten(name, 24)), ...(defenses.length > 5 ? { tickangle: -35 } : {}), showgrid: false },
        yaxis: { tickvals: attacks.map((_, i) => i), ticktext: attacks.map((name) => shorten(name)), autorange: "reversed", showgrid: false },
      },
    };
  }

  differences(lines) {
    const found = this.section.compared?.rows ?? [];
    return lines.flatMap((line) => {
      const { attack, defense } = this.section.cells[line.cell];
      const row = found.find((each) => each.attack === attack && each.defense === defense);
      return row ? [{ ...line, ...row.difference }] : [];
    });
  }

  distribution(lines) {
    const n = this.section.episodes;
    return {
      height: 70 + 34 * Math.max(2, lines.length),
      traces: lines.map((line) => ({
        type: "box", orientation: "h", name: shorten(line.name, 26), x: this.arrays.damage.slice(line.cell * n, (line.cell + 1) * n),
        boxpoints: lines.length > 8 ? "outliers" : "all", jitter: 0.6, pointpos: 0, line: { width: 1.5, color: line.colour },
        marker: { size: 4, color: withAlpha(line.colour, 0.55) }, fillcolor: withAlpha(line.colour, 0.16),
        text: Array.from({ length: n }, (_, world) => `world ${world}`), hovertemplate: "%{text}: %{x:.3g}<extra></extra>",
      })),
      layout: { xaxis: { title: "damage per frame", rangemode: "tozero" }, yaxis: { autorange: "reversed" } },
    };
  }

  course(line, name) {
    const { horizon } = this.section, values = this.arrays[name].slice(line.cell * horizon, (line.cell + 1) * horizon);
    return Array.from(values, (value) => (Number.isNaN(value) ? null : value));
  }

  damageCourse(lines) {
    const frames = Array.from({ length: this.section.horizon }, (_, t) => t + 1);
    const bands = lines.length > 5 ? [] : lines.map((line) => ({
      type: "scatter", mode: "lines", line: { width: 0 }, fill: "toself", fillcolor: withAlpha(line.colour, 0.1), hoverinfo: "skip",
      x: [...frames, ...[...frames].reverse()], y: [...this.course(line, "damage_q90"), ...this.course(line, "damage_q10").reverse()],
    }));
    const means = lines.map((line) => curve(line, frames, this.course(line, "damage_mean")));
    return { traces: [...bands, ...means], layout: { xaxis: { title: "frame" }, yaxis: { title: "damage", rangemode: "tozero" } } };
  }

  trustCourse(lines) {
    const frames = Array.from({ length: this.section.horizon }, (_, t) => t + 1);
    const traces = lines.flatMap((line) => [
      curve({ ...line, dash: "solid", name: `${line.name}, benign` }, frames, this.course(line, "benign_trust_mean")),
      curve({ ...line, dash: "dot", name: `${line.name}, adversaries` }, frames, this.course(line, "adversary_trust_mean")),
    ]);
    return { traces, layout: { xaxis: { title: "frame" }, yaxis: { title: "trust", range: [0, 1.02] } } };
  }

  // Who is accused when every agent below a mean trust is: from nobody to everybody.
  rocOf(line) {
    const parts = this.arrays.scores.length / (2 * this.section.cells.length), first = 2 * parts * line.cell;
    const [adversaries, others] = [0, 1].map((i) => Array.from(this.arrays.scores.slice(first + i * parts, first + (i + 1) * parts)));
    const rates = (counts) => {
      const total = counts.reduce((a, b) => a + b, 0);
      let sum = 0;
      return total ? [0, ...counts.map((count) => (sum += count) / total)] : null;
    };
    return { right: rates(adversaries), wrong: rates(others) };
  }

  roc(lines, colours) {
    const traces = lines.flatMap((line) => {
      const { right, wrong } = this.rocOf(line);
      return right && wrong ? [curve(line, wrong, right)] : [];
    });
    const chance = { type: "scatter", mode: "lines", x: [0, 1], y: [0, 1], line: { color: colours.line, dash: "dot", width: 1 }, hoverinfo: "skip" };
    return {
      traces: [chance, ...traces],
      layout: {
        xaxis: { title: "share of the others accused", range: [-0.02, 1.02] }, yaxis: { title: "adversaries accused", range: [-0.02, 1.04] },
        annotations: traces.length ? [] : [nothing("no adversary acts, or no defense shown has an opinion")],
      },
    };
  }

  calibration(kind, lines, colours) {
    const traces = lines.flatMap((line) => {
      const pooled = this.section.cells[line.cell].pooled[kind];
      if (!pooled) return [];
      const most = Math.max(...pooled.count), kept = pooled.count.map((count, i) => i).filter((i) => pooled.count[i]);
      return [{
        ...curve(line, kept.map((i) => pooled.mean_forecast[i]), kept.map((i) => pooled.share_true[i])), mode: "lines+markers",
        marker: { color: line.colour, size: kept.map((i) => 4 + 10 * Math.sqrt(pooled.count[i] / most)) },
        text: kept.map((i) => `${pooled.count[i]} forecasts`), hovertemplate: `${line.name}<br>trust %{x:.2f}, true %{y:.2f}, %{text}<extra></extra>`,
      }];
    });
    const ideal = { type: "scatter", mode: "lines", x: [0, 1], y: [0, 1], line: { color: colours.line, dash: "dot", width: 1 }, hoverinfo: "skip" };
    return {
      traces: [ideal, ...traces],
      layout: {
        xaxis: { title: "trust", range: [-0.03, 1.03] }, yaxis: { title: "share true", range: [-0.03, 1.06] },
        annotations: traces.length ? [] : [nothing("no defense shown has an opinion")],
      },
    };
  }
}

function asRow([value, low, high]) {
  return { value, low, high };
}

function curve(line, x, y) {
  return {
    type: "scatter", mode: "lines", x, y, name: line.name, line: { color: line.colour, dash: line.dash, width: 2 },
    hovertemplate: `${line.name}<br>%{x:.3g}: %{y:.3g}<extra></extra>`,
  };
}

function nothing(words) {
  return { text: words, xref: "paper", yref: "paper", x: 0.5, y: 0.5, showarrow: false };
}
