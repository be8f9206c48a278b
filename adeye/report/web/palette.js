/* Colours come from the style sheet, so that drawings follow light, dark and print. */
const palette = {};

function readPalette() {
  const style = getComputedStyle(document.documentElement);
  const names = [
    "bg", "surface", "sunken", "ink", "quiet", "line", "strong-line", "accent", "fail", "pass",
    "inconclusive", "road", "shoulder", "ground", "marking", "edge", "car", "heavy", "person",
    "cycle", "static", "nobody", "cell-safe", "cell-unsafe", "cell-taken", "cell-soon",
  ];
  for (const name of names) palette[name] = style.getPropertyValue(`--${name}`).trim();
  palette.channels = [0, 1, 2, 3].map((i) => style.getPropertyValue(`--channel-${i}`).trim());
  palette.sensors = [0, 1, 2, 3, 4].map((i) => style.getPropertyValue(`--sensor-${i}`).trim());
  palette.sans = style.getPropertyValue("--sans").trim();
}

function channelColour(index) {
  return index < 0 ? palette.nobody : palette.channels[index % palette.channels.length];
}

function sensorColour(index) {
  return palette.sensors[index % palette.sensors.length];
}

function bodyColour(kind) {
  if (kind === "pedestrian") return palette.person;
  if (kind === "cyclist" || kind === "motorcycle") return palette.cycle;
  if (["truck", "bus", "van", "trailer"].includes(kind)) return palette.heavy;
  return palette.car;
}

function withAlpha(colour, alpha) {
  return `color-mix(in srgb, ${colour} ${Math.round(alpha * 100)}%, transparent)`;
}

/* From the colour of failure, faint, to the channel's own. */
function fanColour(colour, desirability) {
  const share = Math.round(100 * desirability);
  return withAlpha(`color-mix(in oklab, ${colour} ${share}%, ${palette.fail})`, 0.25 + 0.6 * desirability);
}

/* How safe it is to stand somewhere: the darker the less. */
function ratingColour(grid, level) {
  const share = Math.min(1, grid.levels[level] / grid.worst);
  return `color-mix(in oklab, ${palette["cell-unsafe"]} ${Math.round(100 * share)}%, ${palette["cell-safe"]})`;
}

/* When a cell is occupied: never, the code 0, now, 1, or later, the fainter the later. */
function occupiedColour(grid, code) {
  if (code < 2) return code ? palette["cell-taken"] : "transparent";
  const later = (code - 2) / Math.max(1, grid.times_s.length - 2);
  return withAlpha(palette["cell-soon"], 0.85 - 0.67 * later);
}

/* Make a canvas as sharp as the screen; returns its context, in CSS pixels. */
function prepare(canvas) {
  const box = canvas.getBoundingClientRect();
  const ratio = Math.max(1, Math.min(3, window.devicePixelRatio || 1));
  const width = Math.max(1, Math.round(box.width * ratio));
  const height = Math.max(1, Math.round(box.height * ratio));
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, box.width, box.height);
  return { context, width: box.width, height: box.height, ratio };
}

function element(name, properties, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties || {})) {
    if (key === "class") made.className = value;
    else if (key.startsWith("data-") || key.startsWith("aria-")) made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children.filter((child) => child !== null && child !== ""));
  return made;
}

function fixed(value, digits) {
  if (!Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
}

function unitText(unit) {
  const raised = { 0: "⁰", 1: "¹", 2: "²", 3: "³", "-": "⁻" };
  if (unit === "1") return "";
  return unit.replace(/\^(-?\d)/g, (_, power) => [...power].map((c) => raised[c] || c).join(""));
}
