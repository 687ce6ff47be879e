// An evaluation: all cells at a glance, and the details of all that share an attack or a defense.

class EvaluationView {
  constructor(root, section, arrays) {
    Object.assign(this, { root, section, arrays });
    this.hidden = new Set();
    this.part = (name) => root.querySelector(`[data-part="${name}"]`);
    for (const name of ["cells", "glance", "differences"]) if (this.part(name)) makeSortable(this.part(name));
    this.part("group").value = `attack:${this.worstAttack()}`;
    this.plot("heatmap", (colours) => heatmap(this, colours));
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
    const [kind, index] = this.part("group").value.split(":"),
      { attacks, defenses } = this.section;
    const names = kind === "attack" ? defenses : attacks,
      fixed = (kind === "attack" ? attacks : defenses)[index];
    return names
      .map((name, i) => ({
        name,
        cell: kind === "attack" ? this.cellOf(fixed, name) : this.cellOf(name, fixed),
        colour: lineColour(i),
        dash: lineDash(i)
      }))
      .filter((line) => line.cell >= 0);
  }

  // The attack with the highest mean damage over the defenses, but for those that are there to compare with.
  worstAttack() {
    const { attacks, cells, references } = this.section;
    const mean = (attack) => {
      const judged = cells.filter((cell) => cell.attack === attack && !references.includes(cell.defense));
      return judged.reduce((sum, { damage }) => sum + damage[0] / judged.length, 0);
    };
    return attacks.map(mean).reduce((best, value, i, all) => (value > all[best] ? i : best), 0);
  }

  get lines() {
    return this.group.filter((line) => !this.hidden.has(line.name));
  }

  choose() {
    this.hidden.clear();
    const boxes = this.group.map(({ name, colour, dash }) => {
      const label = document.createElement("label"),
        box = Object.assign(document.createElement("input"), { type: "checkbox", checked: true });
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
    this.plot("differences", intervalPlot(differences(this, lines), "difference of damage", false));
    this.plot("distribution", () => distribution(this, lines));
    this.plot("profile", () => profile(this, lines));
    this.plot("damage", () => damageCourse(this, lines));
    this.plot("trust", () => trustCourse(this, lines));
    this.plot("roc", (colours) => roc(this, lines, colours));
    for (const kind of ["track_trust", "agent_trust"])
      this.plot(kind, (colours) => calibration(this, kind, lines, colours));
  }
}

function asRow([value, low, high]) {
  return { value, low, high };
}
