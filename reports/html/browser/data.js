// The run as the page holds it: base64 of little-endian arrays, see run_data.py.
const run = JSON.parse(document.getElementById("run").textContent);

function bytes(text) {
  const letters = atob(text);
  const array = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) array[i] = letters.charCodeAt(i);
  return array;
}
const floats = text => new Float32Array(bytes(text).buffer);
const integers = text => new Uint32Array(bytes(text).buffer);

const seconds = floats(run.t);
const TRUTH = "truth";

// Trajectories by key: the number of an estimator as text, or "truth".
const trajectories = new Map();
run.estimators.forEach((estimator, i) => {
  if (!estimator.answered) return;
  const index = integers(estimator.landmarks);
  trajectories.set(String(i), {
    key: String(i),
    name: estimator.name,
    path: floats(estimator.path),
    cameras: floats(estimator.cameras),
    covariance: estimator.covariance && floats(estimator.covariance),
    points: floats(estimator.points),
    row: new Map(Array.from(index, (landmark, row) => [landmark, row])),
    used: estimator.used && bytes(estimator.used),
  });
});
if (run.truth) trajectories.set(TRUTH, { key: TRUTH, name: "truth", path: floats(run.truth) });

const charts = run.charts.map(chart => ({
  ...chart,
  lines: new Map(Object.entries(chart.lines).map(([key, text]) => [key, floats(text)])),
}));

const observations = run.observations && {
  starts: integers(run.observations.starts),
  landmark: integers(run.observations.landmark),
  pixel: new Int16Array(bytes(run.observations.pixel).buffer),
  parts: run.observations.parts,
  excluded: bytes(run.observations.excluded),
};

// For each observation the one before of the same landmark, or -1: the tail of a track.
if (observations) {
  const last = new Map();
  observations.previous = Int32Array.from(observations.landmark, (landmark, i) => {
    const before = last.has(landmark) ? last.get(landmark) : -1;
    last.set(landmark, i);
    return before;
  });
}

const isReference = key => key !== TRUTH && run.estimators[Number(key)].name === run.reference;
const isBit = (flags, i) => flags !== null && ((flags[i >> 3] >> (i & 7)) & 1) === 1;

// What is chosen: one frame and a set of estimators for the whole page.
const chosen = { frame: 0, shown: new Set(trajectories.keys()) };
const onFrame = [];
const onShown = [];

function goTo(frame) {
  const last = run.frames - 1;
  const next = Math.max(0, Math.min(last, Math.round(frame)));
  if (next === chosen.frame) return;
  chosen.frame = next;
  onFrame.forEach(update => update());
}

function show(key, shown) {
  if (shown) chosen.shown.add(key);
  else chosen.shown.delete(key);
  onShown.forEach(update => update());
}

// The frame whose time is nearest.
function frameAt(time) {
  let low = 0;
  let high = run.frames - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (seconds[middle] <= time) low = middle;
    else high = middle;
  }
  return time - seconds[low] <= seconds[high] - time ? low : high;
}
