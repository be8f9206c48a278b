/* The player: one clock for the views, the strip, the read-outs and the plots. */
const player = {
  keys: [], replay: null, index: -1, time: 0, playing: false, scale: 1, cache: new Map(), plots: [],
};

function byId(id) {
  return document.getElementById(id);
}

function rowNow() {
  return Math.min(player.replay.rows - 1, Math.floor(player.time / player.replay.step_s + 1e-6));
}

function drawAll() {
  const { replay } = player;
  if (!replay) return;
  const row = rowNow();
  const share = Math.max(0, Math.min(1, player.time / replay.step_s - row));
  const size = prepare(byId("world"));
  const moment = {
    row, share, scale: size.width / 125 * player.scale, heading: replay.camera[row],
  };
  const options = {
    fields: byId("show-fields").checked,
    detections: byId("show-detections").checked,
    truth: byId("show-truth").checked,
    fan: byId("show-fan").checked,
    grid: replay.grid && byId("show-grid").checked,
  };
  drawWorld(size, replay, moment, options);
  drawBelief(prepare(byId("belief")), replay, moment, options);
  drawTimeline(prepare(byId("strip")), replay, row);
  player.readout.draw(row);
  for (const plot of player.plots) plot.draw(row);
  byId("scrub").value = row;
  const total = (replay.rows - 1) * replay.step_s;
  byId("clock").textContent = `${(row * replay.step_s).toFixed(2)} / ${total.toFixed(2)} s`;
  byId("scrub").setAttribute("aria-valuetext", `${(row * replay.step_s).toFixed(2)} s`);
}

function seek(row) {
  if (!player.replay) return;
  player.time = Math.min(player.replay.rows - 1, Math.max(0, row)) * player.replay.step_s;
  drawAll();
}

function setPlaying(playing) {
  const { replay } = player;
  if (!replay) return;
  const end = (replay.rows - 1) * replay.step_s;
  if (playing && player.time >= end - 1e-9) player.time = 0;
  player.playing = playing;
  byId("play").textContent = playing ? "❚❚" : "▶";
  byId("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  if (playing) {
    player.last = performance.now();
    requestAnimationFrame(advance);
  } else {
    // What is shown at rest is a recorded row, not a place between two.
    seek(rowNow());
  }
}

function advance(now) {
  if (!player.playing) return;
  const { replay } = player;
  const elapsed = Math.min(0.25, Math.max(0, (now - player.last) / 1000));
  player.last = now;
  const end = (replay.rows - 1) * replay.step_s;
  player.time = Math.min(end, player.time + elapsed * Number(byId("speed").value));
  if (player.time >= end) {
    setPlaying(false);
    return;
  }
  drawAll();
  requestAnimationFrame(advance);
}

function keyEntry(draw, text, look = "") {
  const canvas = element("canvas", { class: look });
  const node = element("span", {}, canvas, element("span", { textContent: text }));
  return { node, draw: () => draw(prepare(canvas)) };
}

/* The colours of the cells, side by side. */
function gridKeys(grid) {
  const swatches = (colours) => ({ context, width }) => {
    const each = width / colours.length;
    colours.forEach((colour, index) => {
      context.fillStyle = ratingColour(grid, Math.floor(grid.levels.length / 2));
      context.fillRect(index * each, 2, each, 10);
      context.fillStyle = colour;
      context.fillRect(index * each, 2, each, 10);
    });
    context.strokeStyle = palette.edge;
    context.strokeRect(0.5, 2.5, width - 1, 9);
  };
  const ratings = grid.levels.map((_, level) => ratingColour(grid, level));
  const times = grid.times_s.map((_, index) => occupiedColour(grid, index + 1));
  const later = grid.times_s.slice(1).join(", ");
  return [
    keyEntry(swatches(ratings), `cell rated ${grid.levels.join(", ")} to stand on (darker: less safe)`, "wide"),
    keyEntry(swatches(times), `occupied now, within ${later} s (${grid.view === "truth" ? "truth" : `as ${grid.view} predicts`})`, "wide"),
  ];
}

function showKey(replay) {
  const entry = keyEntry;
  const entries = [
    ...replay.channels.map((channel, index) => entry(({ context }) => {
      context.fillStyle = channelColour(index);
      context.fillRect(1, 4, 14, 6);
    }, channel.id)),
    ...replay.sensors.map((sensor, index) => entry(
      ({ context }) => drawMark(context, 8, 7, index, 4), `${sensor.id} (${sensor.kind.replace("_", " ")})`,
    )),
    entry(({ context }) => {
      context.setLineDash([2, 2]);
      context.strokeStyle = palette.ink;
      context.strokeRect(2.5, 3.5, 11, 7);
    }, "truth"),
    entry(({ context }) => {
      context.strokeStyle = palette.quiet;
      context.fillStyle = withAlpha(palette.quiet, 0.2);
      context.fillRect(2.5, 3.5, 11, 7);
      context.strokeRect(2.5, 3.5, 11, 7);
    }, "track"),
    entry(({ context }) => {
      context.strokeStyle = palette.quiet;
      context.setLineDash([4, 2]);
      context.beginPath();
      context.moveTo(0, 7);
      context.lineTo(16, 7);
      context.stroke();
    }, `command held for ${LOOK_AHEAD} s (dashed: shadow)`),
  ];
  const fan = replay.channels.findIndex((channel) => channel.fan);
  byId("show-fan").parentElement.hidden = fan < 0;
  if (fan >= 0) {
    entries.push(entry(({ context }) => {
      [0, 0.5, 1].forEach((shade, index) => {
        context.beginPath();
        context.moveTo(0, 7);
        context.lineTo(16, 2 + 5 * index);
        context.strokeStyle = fanColour(channelColour(fan), shade);
        context.lineWidth = 1 + 1.4 * shade;
        context.stroke();
      });
    }, "candidate (stronger: better; wide: chosen; dotted: not allowed)"));
  }
  byId("show-grid").parentElement.hidden = !replay.grid;
  if (replay.grid) entries.push(...gridKeys(replay.grid));
  byId("keys").replaceChildren(...entries.map(({ node }) => node));
  player.keys = entries;
}

function showHead(replay, context) {
  const head = byId("run-head");
  const line = (...children) => element("div", { class: "line" }, ...children);
  const parameter = (label, value) => element(
    "span", { class: "parameter" }, element("span", { class: "key", textContent: label }), ` ${value}`,
  );
  const back = element("button", { type: "button", class: "back", textContent: "↑ back to the verdicts" });
  back.addEventListener("click", () => byId("verdicts").scrollIntoView());
  const outcome = replay.outcome === "completed" ? "" : parameter("outcome", replay.outcome.replaceAll("_", " "));
  head.replaceChildren(
    line(
      element("h3", { textContent: replay.scenario }), element("span", { textContent: replay.architecture }),
      parameter("fault", replay.fault), outcome,
      element("span", { class: "quiet", textContent: context || replay.why }), back,
    ),
    line(...replay.parameters.map((item) => parameter(item.label, item.value))),
    line(commandButton(replay.command), parameter("run", replay.run), replay.trace_digest ? parameter("trace", replay.trace_digest) : ""),
  );
}

function selectReplay(index, { time = null, context = "" } = {}) {
  const source = byId(`replay-${index}`);
  if (!source) return;
  setPlaying(false);
  if (!player.cache.has(index)) player.cache.set(index, decodeReplay(JSON.parse(source.textContent)));
  const replay = player.cache.get(index);
  player.replay = replay;
  player.index = index;
  player.scale = 1;
  player.time = 0;
  byId("scrub").max = replay.rows - 1;
  for (const button of document.querySelectorAll("#runs [data-replay]")) {
    const isThis = Number(button.dataset.replay) === index;
    button.setAttribute("aria-selected", String(isThis));
    if (isThis) reveal(button);
  }
  showHead(replay, context);
  showKey(replay);
  player.readout = new Readout(replay, seek);
  player.plots = replay.signals.map((signal) => new Plot(replay, signal, seek));
  byId("plots").replaceChildren(...player.plots.map((plot) => plot.node));
  for (const entry of player.keys) entry.draw();
  // A second before the decisive moment, where one was asked for.
  seek(time === null ? 0 : Math.round((time - 1) / replay.step_s));
}

/* Scroll the list, not the page. */
function reveal(button) {
  const list = byId("runs");
  const bottom = button.offsetTop - list.offsetTop + button.offsetHeight;
  const top = button.offsetTop - list.offsetTop;
  if (top < list.scrollTop) list.scrollTop = top;
  else if (bottom > list.scrollTop + list.clientHeight) list.scrollTop = bottom - list.clientHeight;
}

function redraw() {
  readPalette();
  for (const plot of player.plots) plot.base = null;
  for (const entry of player.keys) entry.draw();
  drawAll();
}

function nextReplay(step) {
  const shown = [...document.querySelectorAll("#runs [data-replay]")].filter((button) => !button.hidden);
  const here = shown.findIndex((button) => Number(button.dataset.replay) === player.index);
  const target = shown[(here + step + shown.length) % shown.length];
  if (target) selectReplay(Number(target.dataset.replay));
}

function zoom(factor) {
  player.scale = Math.min(8, Math.max(0.2, player.scale * factor));
  drawAll();
}

const KEYS = {
  " ": () => setPlaying(!player.playing),
  ArrowLeft: (event) => seek(rowNow() - (event.shiftKey ? Math.round(1 / player.replay.step_s) : 1)),
  ArrowRight: (event) => seek(rowNow() + (event.shiftKey ? Math.round(1 / player.replay.step_s) : 1)),
  Home: () => seek(0),
  End: () => seek(Infinity),
  "+": () => zoom(1.25),
  "=": () => zoom(1.25),
  "-": () => zoom(0.8),
  n: () => nextReplay(1),
  p: () => nextReplay(-1),
};

function onKey(event) {
  const { target } = event;
  if (event.ctrlKey || event.metaKey || event.altKey || !player.replay) return;
  const isScrub = target.id === "scrub";
  if (!isScrub && ["INPUT", "SELECT", "TEXTAREA"].includes(target.tagName)) return;
  if (event.key === " " && ["BUTTON", "A", "SUMMARY"].includes(target.tagName)) return;
  const action = KEYS[event.key];
  const box = byId("player").getBoundingClientRect();
  // Away from the player the keys belong to the page.
  if (!action || box.bottom < 120 || box.top > window.innerHeight - 120) return;
  event.preventDefault();
  action(event);
}

function startPlayer() {
  if (!byId("player")) return;
  byId("play").addEventListener("click", () => setPlaying(!player.playing));
  byId("to-start").addEventListener("click", () => seek(0));
  byId("back").addEventListener("click", () => seek(rowNow() - 1));
  byId("ahead").addEventListener("click", () => seek(rowNow() + 1));
  byId("zoom-in").addEventListener("click", () => zoom(1.25));
  byId("zoom-out").addEventListener("click", () => zoom(0.8));
  byId("scrub").addEventListener("input", (event) => seek(Number(event.target.value)));
  byId("scrub").addEventListener("click", (pointer) => {
    const event = eventAt(player.replay, byId("strip"), pointer);
    if (event) seek(Math.round(event.time_s / player.replay.step_s));
  });
  byId("scrub").addEventListener("pointermove", (pointer) => {
    const event = eventAt(player.replay, byId("strip"), pointer);
    byId("scrub").title = event ? `${event.time_s.toFixed(2)} s: ${event.text}` : "";
  });
  for (const id of ["show-fields", "show-detections", "show-truth", "show-fan", "show-grid"]) byId(id).addEventListener("change", drawAll);
  for (const button of document.querySelectorAll("#runs [data-replay]")) {
    button.addEventListener("click", () => selectReplay(Number(button.dataset.replay)));
  }
  document.addEventListener("keydown", onKey);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new ResizeObserver(redraw).observe(byId("player"));
  selectReplay(0);
}
