// The page of a report.

async function main() {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const replays = read("recordings");
  if (replays.length) showReplays(replays);
  await loadPlotly();
  const sections = read("sections"),
    others = { curve: showCurve, learning: showLearning, exploitation: showExploitation, ranking: showRanking };
  for (const root of document.querySelectorAll(".run")) {
    const section = sections[root.dataset.section];
    if (section.kind === "evaluation") new EvaluationView(root, section, await unpack(section.packed));
    else others[section.kind](root, section);
  }
  document.body.dataset.ready = "true";
}

async function loadPlotly() {
  const code = await inflate(document.getElementById("plotly").textContent);
  document.head.append(
    Object.assign(document.createElement("script"), { textContent: new TextDecoder().decode(code) })
  );
}

function showReplays(replays) {
  const viewer = new Viewer(document.getElementById("viewer")),
    select = document.getElementById("episode");
  const show = async () =>
    viewer.show(await Promise.all(replays[select.value].recordings.map((recording) => Recording.load(recording))));
  select.addEventListener("change", show);
  show();
}

main();
