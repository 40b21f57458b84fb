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
run.who.forEach((who, i) => {
  if (!who.answered) return;
  const index = integers(who.landmarks);
  trajectories.set(String(i), {
    key: String(i),
    name: who.name,
    path: floats(who.path),
    cameras: floats(who.cameras),
    covariance: who.covariance && floats(who.covariance),
    points: floats(who.points),
    row: new Map(Array.from(index, (landmark, row) => [landmark, row])),
    used: who.used && bytes(who.used),
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

const isReference = key => key !== TRUTH && run.who[Number(key)].name === run.reference;
const isBit = (flags, i) => flags !== null && ((flags[i >> 3] >> (i & 7)) & 1) === 1;
