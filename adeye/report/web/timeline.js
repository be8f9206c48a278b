/* The strip under the views: who has authority, faults, events, the tail and the playhead. */
const INSET = 8; // half the thumb of the range input that lies over the strip

function bands(column) {
  const found = [];
  column.forEach((value, row) => {
    const last = found[found.length - 1];
    if (last && last.value === value) last.end = row + 1;
    else found.push({ value, start: row, end: row + 1 });
  });
  return found;
}

function eventColour(kind) {
  if (kind === "contact" || kind === "verdict") return palette.fail;
  if (kind === "fault") return palette.inconclusive;
  if (kind === "switch" || kind === "channel" || kind === "monitor") return palette.accent;
  return palette.quiet;
}

/* When each verdict that is not green was decided. */
function decisive(replay) {
  return replay.verdicts.filter((item) => item.binding && item.binding.time_s !== null
    && item.verdict !== "PASS" && item.verdict !== "VACUOUS");
}

function drawTimeline(size, replay, row) {
  const { context, width, height } = size;
  const last = Math.max(1, replay.rows - 1);
  const at = (tick) => INSET + tick / last * (width - 2 * INSET);
  const atTime = (seconds) => at(Math.min(last, seconds / replay.step_s));
  const bandTop = 22;
  const bandHeight = 12;
  context.font = `10.5px ${palette.sans}`;
  context.textBaseline = "middle";
  for (const band of bands(replay.authority)) {
    const left = at(band.start);
    const right = at(Math.min(band.end, last));
    context.fillStyle = channelColour(band.value);
    context.fillRect(left, bandTop, Math.max(1, right - left), bandHeight);
    const name = band.value < 0 ? "no channel" : replay.channels[band.value].id;
    if (context.measureText(name).width + 10 < right - left) {
      context.fillStyle = palette.surface;
      context.textAlign = "left";
      context.fillText(name, left + 5, bandTop + bandHeight / 2 + 0.5);
    }
  }
  if (replay.horizon_s !== null && replay.horizon_s < last * replay.step_s) {
    const x = atTime(replay.horizon_s);
    context.fillStyle = withAlpha(palette.surface, 0.55);
    context.fillRect(x, bandTop, at(last) - x, bandHeight);
    context.fillStyle = palette.quiet;
    context.textAlign = "left";
    context.fillRect(x, bandTop - 4, 1, bandHeight + 8);
    context.fillStyle = palette.ink;
    context.fillText("tail", x + 5, bandTop + bandHeight / 2 + 0.5);
  }
  replay.faults.forEach((fault, index) => {
    for (const band of bands(fault.active)) {
      if (!band.value) continue;
      const left = at(band.start);
      context.fillStyle = palette.fail;
      context.fillRect(left, bandTop + bandHeight + 2 + 4 * index, Math.max(2, at(Math.min(band.end, last)) - left), 3);
    }
  });
  for (const event of replay.events) {
    const x = atTime(event.time_s);
    context.fillStyle = eventColour(event.kind);
    context.beginPath();
    context.moveTo(x, bandTop - 1);
    context.lineTo(x - 4, bandTop - 9);
    context.lineTo(x + 4, bandTop - 9);
    context.closePath();
    context.fill();
  }
  for (const item of decisive(replay)) {
    const x = atTime(item.binding.time_s);
    context.strokeStyle = palette.fail;
    context.lineWidth = 1.6;
    context.beginPath();
    context.moveTo(x - 3.5, 3);
    context.lineTo(x + 3.5, 10);
    context.moveTo(x + 3.5, 3);
    context.lineTo(x - 3.5, 10);
    context.stroke();
  }
  context.fillStyle = palette.ink;
  context.fillRect(at(row) - 1, 1, 2, height - 14);
  drawTicks(context, replay, at, width, height);
}

function drawTicks(context, replay, at, width, height) {
  const seconds = (replay.rows - 1) * replay.step_s;
  const apart = [0.5, 1, 2, 5, 10, 20, 60].find((step) => seconds / step <= width / 60) || 120;
  context.fillStyle = palette.quiet;
  context.textAlign = "center";
  context.textBaseline = "alphabetic";
  for (let time = 0; time <= seconds + 1e-9; time += apart) {
    const x = at(time / replay.step_s);
    context.fillRect(x, height - 13, 1, 3);
    if (x > 8 && x < width - 12) context.fillText(`${+time.toFixed(1)} s`, x, height - 1);
  }
}

/* The event under the pointer, if there is one. */
function eventAt(replay, canvas, pointer) {
  const box = canvas.getBoundingClientRect();
  const total = Math.max(1, replay.rows - 1) * replay.step_s;
  const width = box.width - 2 * INSET;
  const away = (event) => Math.abs(box.left + INSET + event.time_s / total * width - pointer.clientX);
  const near = replay.events.filter((event) => away(event) < 6 && pointer.clientY - box.top < 24);
  return near.sort((one, other) => away(one) - away(other))[0] || null;
}
