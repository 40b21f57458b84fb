// The data that the page holds: base64 of little-endian arrays, see plot_data.py. A comparison has paths and charts only.
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
  const known = (text, read) => (text ? read(text) : null);
  const index = known(estimator.landmarks, integers) || [];
  trajectories.set(String(i), {
    key: String(i),
    name: estimator.name,
    path: floats(estimator.path),
    cameras: known(estimator.cameras, floats),
    covariance: known(estimator.covariance, floats),
    points: known(estimator.points, floats),
    row: new Map(Array.from(index, (landmark, row) => [landmark, row])),
    used: known(estimator.used, bytes),
  });
});
if (run.truth) trajectories.set(TRUTH, { key: TRUTH, name: "truth", path: floats(run.truth) });

const unpacked = texts => new Map(Object.entries(texts).map(([key, text]) => [key, floats(text)]));
const charts = run.charts.map(chart => ({
  ...chart,
  lines: unpacked(chart.lines),
  bounds: unpacked(chart.bounds || {}),
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

// What is chosen for the whole page: one frame, a set of estimators, and a span of time, or null for all of it.
const chosen = { frame: 0, shown: new Set(trajectories.keys()), span: null };
const onFrame = [];
const onShown = [];
const onSpan = [];
const onPointed = [];  // with the time under the pointer, or null

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

const span = () => chosen.span || [0, seconds[run.frames - 1]];

// Shows the times between two ends, a few frames at least; null for all of the time.
function zoom(ends) {
  const last = seconds[run.frames - 1];
  const shortest = Math.min(last, 4 * last / Math.max(1, run.frames - 1));
  if (ends !== null) {
    const length = Math.max(ends[1] - ends[0], shortest);
    const from = Math.max(0, Math.min(last - length, (ends[0] + ends[1] - length) / 2));
    ends = length < last ? [from, from + length] : null;
  }
  chosen.span = ends;
  onSpan.forEach(update => update());
}

// Magnifies the time around the cursor.
function magnify(factor) {
  const [from, until] = span();
  const at = seconds[chosen.frame];
  const middle = at >= from && at <= until ? at : (from + until) / 2;
  const half = (until - from) / factor / 2;
  zoom([middle - half, middle + half]);
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
