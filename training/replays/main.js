// The page of a replay.

async function main() {
  const written = JSON.parse(document.getElementById("recordings").textContent);
  const viewer = new Viewer(document.getElementById("viewer"), true);
  viewer.show(await Promise.all(written.map((recording) => Recording.load(recording))));
}

main();
