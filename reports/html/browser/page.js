// The slider and the switches, and a plot in every place that the page has for one.
const slider = document.getElementById("frame");
const clock = document.getElementById("clock");

function showFrame() {
  slider.value = String(chosen.frame);
  slider.setAttribute("aria-valuetext", momentOf(chosen.frame));
  clock.textContent = momentOf(chosen.frame, " · ");
}
slider.addEventListener("input", () => goTo(Number(slider.value)));
onFrame.push(showFrame);

for (const box of document.querySelectorAll("#estimators-shown input")) {
  box.addEventListener("change", () => show(box.value, box.checked));
}

// On a phone the list of estimators is folded away.
const list = document.querySelector("#controls details");
const phone = matchMedia("(max-width: 40rem)");
const fold = () => { list.open = !phone.matches; };
phone.addEventListener("change", fold);
fold();

// Headings of tables and of sections stop below the bar that holds slider and switches.
const bar = document.getElementById("controls");
new ResizeObserver(() => document.documentElement.style.setProperty("--bar", bar.offsetHeight + "px")).observe(bar);

// A table that is wider than the page scrolls in its place; only a narrower one has headings that stay in sight.
for (const table of document.querySelectorAll("#table .main")) {
  const fit = () => {
    const place = table.parentElement;
    place.classList.remove("scrolls");
    place.classList.toggle("scrolls", table.offsetWidth > place.parentElement.clientWidth + 1);
  };
  whenResized(document.body, fit);
  fit();
}

// Legends have what is shown.
onShown.push(() => {
  for (const entry of document.querySelectorAll(".legend li")) entry.hidden = !chosen.shown.has(entry.dataset.key);
});

for (const button of document.querySelectorAll("button[data-time]")) {
  button.addEventListener("click", () => (button.dataset.time === "all" ? zoom(null) : magnify(button.dataset.time === "in" ? 2 : 1 / 2)));
}

const play = document.getElementById("play");
let playing = null;
function stop() {
  clearInterval(playing);
  playing = null;
  press(play, false);
}
play.addEventListener("click", () => {
  if (playing !== null) return stop();
  if (chosen.frame === run.frames - 1) goTo(0);
  press(play, true);
  const step = Math.max(1, Math.round(run.frames / 400));
  playing = setInterval(() => (chosen.frame < run.frames - 1 ? goTo(chosen.frame + step) : stop()), 60);
  return undefined;
});

for (const button of document.querySelectorAll("button[data-frame]")) {
  button.addEventListener("click", () => goTo(Number(button.dataset.frame)));
}

// What every chart shows at the frame, as a table.
const table = document.getElementById("values");
function fill() {
  if (!table || !table.closest("details").open) return;
  for (const cell of table.querySelectorAll("td")) {
    const chart = charts[Number(cell.dataset.chart)];
    const line = chart.lines.get(cell.dataset.key);
    cell.textContent = line ? figure(line[chosen.frame], chart.unit) : "–";
  }
}
if (table) {
  table.closest("details").addEventListener("toggle", fill);
  onFrame.push(fill);
}

// Paper cannot be unfolded.
const folded = [];
addEventListener("beforeprint", () => {
  folded.push(...document.querySelectorAll("#behind details:not([open])"));
  folded.forEach(details => { details.open = true; });
});
addEventListener("afterprint", () => folded.splice(0).forEach(details => { details.open = false; }));

const paths = document.getElementById("path-view");
if (paths) new PathView(paths);
document.querySelectorAll(".chart").forEach(place => new TimeChart(place, charts[Number(place.dataset.chart)]));
const frame = document.getElementById("frame-view");
if (frame && observations) new FrameView(frame);
document.documentElement.classList.add("live");
if (run.bookmarks.length) goTo(run.bookmarks[0].frame);
showFrame();
