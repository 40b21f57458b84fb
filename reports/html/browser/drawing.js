// Small pieces of SVG and HTML; text only ever goes in as text.
const SVG = "http://www.w3.org/2000/svg";

function filled(element, attributes, text) {
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text) element.textContent = text;
  return element;
}
const svg = (name, attributes = {}, text = "") => filled(document.createElementNS(SVG, name), attributes, text);
const html = (name, attributes = {}, text = "") => filled(document.createElement(name), attributes, text);
const press = (button, on) => button.setAttribute("aria-pressed", String(on));

// Far outside a picture, numbers only make the file longer.
const bounded = value => Math.max(-1e5, Math.min(1e5, value)).toFixed(1);

// A line through n places, broken where `place` gives none; places less than half a pixel on are left out.
function polyline(n, place) {
  let d = "";
  let from = null;
  for (let i = 0; i < n; i++) {
    const at = place(i);
    if (at && from && Math.abs(at[0] - from[0]) + Math.abs(at[1] - from[1]) < 0.5) continue;
    if (at) d += `${from ? "L" : "M"}${bounded(at[0])} ${bounded(at[1])}`;
    from = at;
  }
  return d;
}

// Frames of a line between two ends that show all of it in so many pixels: all, or the extremes of each piece.
function thinned(line, [first, last], pixels) {
  const n = last - first + 1;
  const pieces = Math.max(1, Math.floor(pixels));
  if (n <= 2 * pieces) return Array.from({ length: n }, (_, i) => first + i);
  const frames = [];
  for (let piece = 0; piece < pieces; piece++) {
    const from = first + Math.floor(piece * n / pieces);
    const until = first + Math.floor((piece + 1) * n / pieces);
    let [low, high] = [from, from];
    for (let k = from; k < until; k++) {
      if (!Number.isFinite(line[k])) continue;
      if (!(line[k] >= line[low])) low = k;
      if (!(line[k] <= line[high])) high = k;
    }
    frames.push(...new Set([low, high].sort((a, b) => a - b)));
  }
  return frames;
}

// The median of those values that are finite; NaN without any.
function median(values) {
  const known = values.filter(Number.isFinite).sort((a, b) => a - b);
  const half = known.length >> 1;
  return known.length % 2 ? known[half] : (known[half - 1] + known[half]) / 2;
}

// Smallest and largest of those values that are finite; [Infinity, -Infinity] without any.
function extremes(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  return [low, high];
}

// Medians of a line over the frames around every `half`-th frame between two ends, which are among them: [frame, value].
function runningMedian(line, [first, last], half) {
  const frames = Array.from({ length: Math.floor((last - first) / half) + 1 }, (_, i) => first + i * half);
  if (frames[frames.length - 1] !== last) frames.push(last);
  return frames.map(k => [k, median(Array.from(line.subarray(Math.max(0, k - half), k + half + 1)))]);
}

const SAMPLES = 200;  // places of two lines that are compared
const SAME = 1;  // px: lines nearer than this everywhere coincide
const STRIPE = 2;  // px by which a line is wider than the one on it

// Whether two lines coincide, by their places ([x, y] or null) in n frames.
function coincide(a, b, n) {
  const step = Math.max(1, Math.floor(n / SAMPLES));
  let both = 0;
  for (let k = 0; k < n; k += step) {
    const [at, other] = [a(k), b(k)];
    if (!at !== !other) return false;
    if (!at) continue;
    if (Math.abs(at[0] - other[0]) + Math.abs(at[1] - other[1]) > SAME) return false;
    both++;
  }
  return both > 0;
}

// Lines { key, place } in the order they are drawn, each with its width: of lines that coincide the lower one is wider.
// The reference lies below all but those that coincide with it.
function stacked(lines, n) {
  const reference = lines.find(line => isReference(line.key));
  const level = line => (line === reference ? 1 : reference && coincide(line.place, reference.place, n) ? 0 : 2);
  const order = lines.map(line => [level(line), line]).sort(([a], [b]) => a - b).map(([, line]) => line);
  for (let i = order.length - 1; i >= 0; i--) {
    const above = order.slice(i + 1).filter(line => coincide(order[i].place, line.place, n)).map(line => line.width);
    order[i].width = Math.max(isReference(order[i].key) ? 3 : 1.6, STRIPE + Math.max(-Infinity, ...above));
  }
  return order;
}

const lineOf = ({ key, width }, d) => svg("path", { class: "line estimator-" + key, style: `stroke-width: ${width.toFixed(1)}px`, d });

const RESOLUTIONS = { m: 1e-5, "°": 1e-5, px: 1e-4 };  // formatting.py; pixels are kept in 32 bits

// A number with a power of ten, as tables have it; without `digits` as short as it is.
function scientific(value, digits) {
  const [mantissa, exponent] = value.toExponential(digits).split("e");
  const power = "10" + [...String(Number(exponent))].map(letter => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(letter)]).join("");
  return mantissa === "1" ? power : `${mantissa} × ${power}`;
}

// A figure without its unit; 0 for rounding.
function figure(value, unit) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  let text;
  if (size === 0 || size < RESOLUTIONS[unit]) text = "0";
  else if (size >= 1e6 || size < 1e-3) text = scientific(value, 2);
  else if (size >= 999.5) text = Math.round(value).toLocaleString("en");
  else text = value.toPrecision(3);
  return text.replace("-", "−");
}

function quantity(value, unit) {
  return Number.isFinite(value) ? figure(value, unit) + (unit === "°" ? unit : unit ? "\u00a0" + unit : "") : "–";
}

const timeOf = frame => seconds[frame].toFixed(1) + "\u00a0s";
const momentOf = (frame, mark = ", ") => `${run.step} ${frame}` + (run.stamped ? mark + timeOf(frame) : "");

// Round values between two ends, about so many of them.
function ticks(low, high, about) {
  const raw = (high - low) / Math.max(1, about);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find(factor => factor * power >= raw * 0.999);
  const values = [];
  // Counted, since adding 1 to a number beyond 2^53 changes nothing.
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.min(2 * about + 2, Math.floor(high / step + 1e-9) - first);
  for (let i = 0; i <= count; i++) values.push((first + i) * step);
  return values;
}

function logTicks(low, high, about) {
  const from = Math.ceil(Math.log10(low) - 1e-9);
  const to = Math.floor(Math.log10(high) + 1e-9);
  if (to - from < 1) return ticks(low, high, about);
  const every = Math.max(1, Math.ceil((to - from) / about));
  const values = [];
  if (!Number.isFinite(to - from)) return values;
  for (let i = from; i <= to; i += every) values.push(10 ** i);
  return values;
}

// Redraws when the element gets another width; the first time as soon as it has one.
function whenResized(element, draw) {
  let width = 0;
  new ResizeObserver(() => {
    const now = Math.round(element.clientWidth);
    if (now === 0 || now === width) return;
    width = now;
    draw();
  }).observe(element);
}

const hint = html("div", { class: "hint", role: "status", hidden: "" });
document.body.append(hint);

// Lines of [text, key of its estimator or null] beside the pointer.
function showHint(event, lines) {
  hint.replaceChildren(...lines.map(([text, key]) => {
    const line = html("div");
    if (key !== null) line.append(html("span", { class: "swatch estimator-" + key }));
    line.append(text);
    return line;
  }));
  hint.hidden = false;
  const { width, height } = hint.getBoundingClientRect();
  const left = event.clientX + 14 + width > innerWidth ? event.clientX - width - 10 : event.clientX + 14;
  const top = event.clientY + 14 + height > innerHeight ? event.clientY - height - 10 : event.clientY + 14;
  hint.style.left = Math.max(4, left) + "px";
  hint.style.top = Math.max(4, top) + "px";
}
const hideHint = () => { hint.hidden = true; };
