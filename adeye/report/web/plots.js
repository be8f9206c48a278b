/* Signals over time with the limits that FSRs set on them, on the clock of the replay. */
function rangeOf(signal) {
  if (signal.labels.length) return [-0.25, signal.labels.length - 0.75];
  const present = signal.values.filter(Number.isFinite);
  const limits = signal.thresholds.map((line) => line.value);
  let low = Math.min(...present, ...limits);
  let high = Math.max(...present, ...limits);
  // Far above a lower limit nothing is decided: keep the limit readable.
  const floor = Math.max(0, ...signal.thresholds.filter((line) => line.side === "at_least").map((line) => line.value));
  if (floor > 0) high = Math.min(high, 6 * floor);
  // A time to collision of hours would leave nothing to see of one of seconds.
  if (signal.cap) high = Math.min(high, Math.max(1.5 * signal.cap, ...limits));
  if (!(high > low)) {
    low = Number.isFinite(low) ? low - 1 : 0;
    high = low + 2;
  }
  const room = 0.09 * (high - low);
  return [low - room, high + room];
}

class Plot {
  constructor(replay, signal, seek) {
    this.replay = replay;
    this.signal = signal;
    this.value = element("span");
    this.canvas = element("canvas", { "aria-label": `${signal.name} over time` });
    const unit = unitText(signal.unit);
    this.node = element(
      "div", { class: signal.labels.length ? "plot coded" : "plot" },
      element("header", {}, element("b", { textContent: signal.name }), this.value), this.canvas,
    );
    this.unit = unit;
    this.range = rangeOf(signal);
    this.left = 42;
    const pick = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const share = (event.clientX - box.left - this.left) / (box.width - this.left - 4);
      seek(Math.round(Math.min(1, Math.max(0, share)) * (replay.rows - 1)));
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      pick(event);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) pick(event);
    });
  }

  x(row) {
    return this.left + row / Math.max(1, this.replay.rows - 1) * (this.width - this.left - 4);
  }

  y(value) {
    const [low, high] = this.range;
    return 5 + (1 - (value - low) / (high - low)) * (this.height - 10);
  }

  /* Draw everything but the cursor, once per size and palette. */
  drawBase() {
    const size = prepare(this.canvas);
    const { context } = size;
    this.width = size.width;
    this.height = size.height;
    this.ratio = size.ratio;
    this.drawGrid(context);
    context.save();
    context.beginPath();
    context.rect(this.left, 0, this.width - this.left, this.height);
    context.clip();
    this.drawLimits(context);
    this.drawCurve(context);
    context.restore();
    this.drawLimitNames(context);
    this.base = document.createElement("canvas");
    this.base.width = this.canvas.width;
    this.base.height = this.canvas.height;
    this.base.getContext("2d").drawImage(this.canvas, 0, 0);
  }

  drawGrid(context) {
    context.font = `10.5px ${palette.sans}`;
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.lineWidth = 1;
    const mark = (value, text) => {
      const y = Math.round(this.y(value)) + 0.5;
      context.strokeStyle = palette.line;
      context.beginPath();
      context.moveTo(this.left, y);
      context.lineTo(this.width - 4, y);
      context.stroke();
      context.fillStyle = palette.quiet;
      context.fillText(text, this.left - 5, y, this.left - 7);
    };
    if (this.signal.labels.length) {
      this.signal.labels.forEach((label, code) => mark(code, label));
      return;
    }
    const [low, high] = this.range;
    const raw = (high - low) / 4.6;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= raw);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let value = Math.ceil(low / step) * step; value <= high; value += step) mark(value, fixed(value, digits));
  }

  drawLimits(context) {
    for (const line of this.signal.thresholds) {
      const y = this.y(line.value);
      context.fillStyle = withAlpha(palette.fail, 0.07);
      if (line.side === "at_most") context.fillRect(this.left, 0, this.width, y);
      else context.fillRect(this.left, y, this.width, this.height - y);
      context.strokeStyle = palette.fail;
      context.lineWidth = 1.2;
      context.setLineDash([5, 3]);
      context.beginPath();
      context.moveTo(this.left, y);
      context.lineTo(this.width, y);
      context.stroke();
      context.setLineDash([]);
    }
    if (this.replay.horizon_s === null) return;
    const x = this.x(this.replay.horizon_s / this.replay.step_s);
    context.fillStyle = withAlpha(palette.quiet, 0.07);
    context.fillRect(x, 0, this.width - x, this.height);
  }

  drawLimitNames(context) {
    context.font = `600 10.5px ${palette.sans}`;
    context.textAlign = "right";
    this.signal.thresholds.forEach((line) => {
      const y = this.y(line.value);
      const text = `${line.fsr} ${line.side === "at_most" ? "≤" : "≥"} ${fixed(line.value, 2).replace(/\.?0+$/, "")} ${this.unit}`;
      const below = y < 14 || (line.side === "at_most" && y < this.height - 14);
      const middle = y + (below ? 8 : -8);
      context.fillStyle = withAlpha(palette.surface, 0.78);
      const width = context.measureText(text).width;
      context.fillRect(this.width - 10 - width, middle - 6, width + 4, 12);
      context.fillStyle = palette.fail;
      context.textBaseline = "middle";
      context.fillText(text, this.width - 8, middle);
    });
  }

  drawCurve(context) {
    const { values } = this.signal;
    context.strokeStyle = palette.accent;
    context.lineWidth = 1.7;
    context.lineJoin = "round";
    context.beginPath();
    let drawing = false;
    values.forEach((value, row) => {
      if (!Number.isFinite(value)) {
        drawing = false;
        return;
      }
      if (drawing && this.signal.labels.length) context.lineTo(this.x(row), this.y(values[row - 1]));
      if (drawing) context.lineTo(this.x(row), this.y(value));
      else context.moveTo(this.x(row), this.y(value));
      drawing = true;
    });
    context.stroke();
  }

  draw(row) {
    if (!this.base) this.drawBase();
    const context = this.canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.base, 0, 0);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const x = this.x(row);
    context.fillStyle = withAlpha(palette.ink, 0.7);
    context.fillRect(x - 0.5, 0, 1, this.height);
    const value = this.signal.values[row];
    if (Number.isFinite(value)) {
      context.fillStyle = palette.accent;
      context.beginPath();
      context.arc(x, Math.min(this.height - 3, Math.max(3, this.y(value))), 3.2, 0, 2 * Math.PI);
      context.fill();
    }
    const { labels } = this.signal;
    const text = labels.length ? labels[value] || "–" : `${fixed(value, Math.abs(value) < 10 ? 2 : 1)} ${this.unit}`;
    this.value.textContent = text;
  }
}
