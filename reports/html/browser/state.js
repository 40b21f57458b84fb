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
