// A viewer: one or two recordings of the same episode, on one clock.

const FRAMES_PER_SECOND = 10; // at speed 1

class Viewer {
  // ownsPage: keys count wherever the focus is; otherwise only where it is within the viewer.
  constructor(root, ownsPage = false) {
    this.root = root;
    this.ownsPage = ownsPage;
    this.recordings = [];
    this.frame = 0;
    this.playing = false;
    this.chosen = null; // {agent}, or {track, stage}
    this.extent = null; // what part of the world the maps show
    this.part = (name) => root.querySelector(`[data-part="${name}"]`);
    this.bindControls();
    this.bindKeys();
    new ResizeObserver(() => this.redraw()).observe(root);
    DARK.addEventListener("change", () => this.redraw());
  }

  // Shows other recordings, from their first frame on.
  show(recordings) {
    this.recordings = recordings;
    this.stages = recordings.map((recording, i) => this.addStage(recording, i));
    this.part("stages").replaceChildren(...this.stages.map((stage) => stage.figure));
    this.root.classList.toggle("single", recordings.length === 1);
    this.part("frame").max = recordings[0].frames;
    this.detectionColours = null;
    this.chosen = null;
    this.extent = recordings[0].extent;
    this.frame = 0;
    this.redraw();
  }

  addStage(recording, index) {
    const figure = this.part("stage").content.cloneNode(true).firstElementChild;
    const part = (name) => figure.querySelector(`[data-part="${name}"]`);
    part("title").textContent = recording.defense;
    const stage = { figure, part, recording, map: part("map"), history: part("history") };
    stage.map.addEventListener("click", (event) => this.chooseAt(index, event));
    stage.map.addEventListener("pointermove", (event) => this.drag(stage, event));
    for (const [name, factor] of [
      ["in", 0.5],
      ["out", 2],
      ["all", Infinity]
    ]) {
      part(name).addEventListener("click", () => this.zoom(factor));
    }
    stage.history.addEventListener("pointerdown", (event) => this.goToPointer(stage, event));
    stage.history.addEventListener("pointermove", (event) => event.buttons && this.goToPointer(stage, event));
    return stage;
  }

  bindControls() {
    this.part("play").addEventListener("click", () => this.toggle());
    this.part("back").addEventListener("click", () => this.step(-1));
    this.part("forward").addEventListener("click", () => this.step(1));
    this.part("frame").addEventListener("input", (event) => this.goTo(event.target.value - 1));
    this.part("look").addEventListener("change", (event) => this.choose(JSON.parse(event.target.value)));
    for (const box of this.root.querySelectorAll("[data-layer]")) box.addEventListener("change", () => this.redraw());
  }

  bindKeys() {
    const keys = {
      " ": () => this.toggle(),
      k: () => this.toggle(),
      ArrowLeft: () => this.step(-1),
      ArrowRight: () => this.step(1),
      ",": () => this.step(-1),
      ".": () => this.step(1),
      PageDown: () => this.step(10),
      PageUp: () => this.step(-10),
      Home: () => this.goTo(0),
      End: () => this.goTo(Infinity),
      Escape: () => this.choose(null),
      z: () => this.zoom(0.5),
      x: () => this.zoom(2),
      "+": () => this.changeSpeed(1),
      "-": () => this.changeSpeed(-1)
    };
    document.addEventListener("keydown", (event) => {
      const action = keys[event.key],
        at = event.target;
      if (!action || !this.recordings.length || event.ctrlKey || event.metaKey || event.altKey) return;
      if (at.closest?.("select, a, summary") || !(this.root.contains(at) || (this.ownsPage && at === document.body))) return;
      if (event.key === " " && at.closest?.("button, input[type=checkbox]")) return;
      event.preventDefault();
      action();
    });
  }

  get speed() {
    return Number(this.part("speed").value);
  }

  changeSpeed(by) {
    const select = this.part("speed"),
      last = select.options.length - 1;
    select.selectedIndex = Math.min(last, Math.max(0, select.selectedIndex + by));
  }

  toggle() {
    this.playing ? this.pause() : this.play();
  }

  play() {
    if (this.frame === this.recordings[0].frames - 1) this.goTo(0);
    this.playing = true;
    this.updateControls();
    let due = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      const period = 1000 / (FRAMES_PER_SECOND * this.speed),
        frames = Math.floor((now - due) / period);
      if (frames > 0) {
        due = now - due > 1000 ? now : due + frames * period;
        this.goTo(this.frame + Math.min(frames, Math.ceil(this.speed)));
      }
      if (this.frame === this.recordings[0].frames - 1) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    this.updateControls();
  }

  step(by) {
    this.pause();
    this.goTo(this.frame + by);
  }

  goTo(frame) {
    this.frame = Math.min(this.recordings[0].frames - 1, Math.max(0, frame));
    this.draw();
  }

  goToPointer(stage, event) {
    const left = stage.history.getBoundingClientRect().left,
      width = stage.history.parentElement.clientWidth;
    this.pause();
    const box = { left: LEFT, width: width - LEFT - RIGHT, frames: stage.recording.frames };
    this.goTo(frameAt(box, event.clientX - left));
  }

  // Shows `factor` times as much, around what is chosen; never more than everything.
  zoom(factor) {
    const whole = this.recordings[0].extent,
      [xMin, xMax, yMin, yMax] = this.extent;
    const at = this.placeOfChosen() ?? [(xMin + xMax) / 2, (yMin + yMax) / 2];
    const half = (factor * Math.max(xMax - xMin, yMax - yMin)) / 2;
    const isWhole = 2 * half >= Math.max(whole[1] - whole[0], whole[3] - whole[2]);
    this.extent = isWhole ? whole : [at[0] - half, at[0] + half, at[1] - half, at[1] + half];
    this.draw();
  }

  placeOfChosen() {
    const { agent, track, stage } = this.chosen ?? {},
      recording = this.recordings[stage ?? 0];
    if (agent !== undefined) return recording.agents[agent].at;
    const row = track === undefined ? -1 : recording.rowsOfTrack(track)[this.frame];
    return row < 0 ? null : [recording.track_at[2 * row], recording.track_at[2 * row + 1]];
  }

  drag(stage, event) {
    if (!event.buttons || this.extent === this.recordings[0].extent) return;
    const { scale } = new Camera(this.extent, stage.map.parentElement.clientWidth);
    const dx = -event.movementX / scale,
      dy = event.movementY / scale;
    this.dragged = true;
    this.extent = this.extent.map((edge, i) => edge + (i < 2 ? dx : dy));
    this.draw();
  }

  chooseAt(index, event) {
    if (this.dragged) return (this.dragged = false);
    const { map, recording } = this.stages[index],
      box = map.getBoundingClientRect();
    const camera = new Camera(this.extent, box.width);
    const found = findAt(recording, this.frame, camera, event.clientX - box.left, event.clientY - box.top);
    this.choose(found && (found.agent === undefined ? { ...found, stage: index } : found));
  }

  choose(chosen) {
    this.chosen = chosen;
    this.redraw();
  }

  chosenIn(index) {
    return this.chosen && (this.chosen.stage === undefined || this.chosen.stage === index) ? this.chosen : null;
  }

  // Everything anew: after other sizes, colours, layers, choices.
  redraw() {
    if (!this.recordings.length) return;
    this.colours = readColours();
    this.layers = Object.fromEntries(
      [...this.root.querySelectorAll("[data-layer]")].map((box) => [box.dataset.layer, box.checked])
    );
    const most = Math.max(1, ...this.recordings.map(greatestDamage));
    this.stages.forEach((stage, i) => {
      stage.charts = chartsOf(stage.recording, this.chosenIn(i), most, this.colours);
      stage.detectionColours = stage.recording.agents.map((_, k) => agentColour(stage.recording, k));
    });
    drawLegend(this.part("legend"), this.colours);
    this.listChoices();
    this.draw();
  }

  draw() {
    this.stages.forEach((stage, i) => {
      const { recording, detectionColours } = stage,
        side = stage.map.parentElement.clientWidth;
      const view = { colours: this.colours, layers: this.layers, chosen: this.chosenIn(i), detectionColours };
      drawMap(prepare(stage.map, side).context, side, this.extent, recording, this.frame, view);
      drawHistory(stage.history, stage.charts, recording, this.frame, this.colours);
      stage.part("now").textContent = describeFrame(recording, this.frame);
      stage.part("chosen").textContent = describeChosen(recording, this.frame, view.chosen);
    });
    this.updateControls();
  }

  updateControls() {
    const { frames, dt } = this.recordings[0],
      number = this.frame + 1,
      play = this.part("play");
    this.part("frame").value = number;
    this.part("frame").setAttribute("aria-valuetext", `frame ${number} of ${frames}`);
    this.part("number").textContent = `frame ${number} of ${frames} (${(number * dt).toPrecision(3) / 1} s)`;
    play.textContent = this.playing ? "❚❚ Pause" : "▶ Play";
    play.setAttribute("aria-pressed", this.playing);
  }

  // Everything that can be looked at, for who has no pointer: agents, and the confirmed tracks of every recording.
  listChoices() {
    const option = (words, value) => Object.assign(new Option(words, JSON.stringify(value)), {});
    const agents = this.recordings[0].agents.map(({ name }, agent) => option(name, { agent }));
    const groups = this.recordings.map((recording, stage) => {
      const confirmed = (row) => recording.track_kind[row] !== TENTATIVE;
      const rows = Array.from(recording.track.keys()).filter(confirmed);
      const ids = [...new Set(rows.map((row) => recording.track[row]))].sort((a, b) => a - b);
      return group(
        `tracks: ${recording.defense}`,
        ids.map((track) => option(`track ${track}`, { track, stage }))
      );
    });
    this.part("look").replaceChildren(option("nothing chosen", null), group("agents", agents), ...groups);
    this.part("look").value = JSON.stringify(this.chosen);
    if (this.part("look").selectedIndex < 0) {
      // a track that is tentative only
      this.part("look").append(option(`track ${this.chosen.track}`, this.chosen));
      this.part("look").selectedIndex = this.part("look").options.length - 1;
    }
  }
}

function group(label, options) {
  const element = Object.assign(document.createElement("optgroup"), { label });
  element.append(...options);
  return element;
}
