/* A camera over the map, and the things that stand in it. */
class Camera {
  constructor(size, pose, scale) {
    this.context = size.context;
    this.width = size.width;
    this.height = size.height;
    this.ratio = size.ratio;
    this.pose = pose;
    this.scale = scale;
    this.anchorX = size.width * 0.3;
    this.anchorY = size.height * 0.5;
    this.sine = Math.sin(pose.heading);
    this.cosine = Math.cos(pose.heading);
  }

  /* From the map to the canvas. */
  place(x, y) {
    const dx = x - this.pose.x;
    const dy = y - this.pose.y;
    return [
      this.anchorX + this.scale * (this.cosine * dx + this.sine * dy),
      this.anchorY + this.scale * (this.sine * dx - this.cosine * dy),
    ];
  }

  /* Trace a closed or open path through places of the map. */
  path(points) {
    this.context.beginPath();
    points.forEach(([x, y], index) => {
      const [column, row] = this.place(x, y);
      if (index === 0) this.context.moveTo(column, row);
      else this.context.lineTo(column, row);
    });
  }

  sees(x, y, margin) {
    const [column, row] = this.place(x, y);
    return column > -margin && row > -margin && column < this.width + margin
      && row < this.height + margin;
  }
}

function pointsOf(line) {
  return Array.from(line.x, (x, index) => [x, line.y[index]]);
}

function fillBetween(camera, one, other, colour) {
  camera.path([...pointsOf(one), ...pointsOf(other).reverse()]);
  camera.context.closePath();
  camera.context.fillStyle = colour;
  camera.context.fill();
}

function drawSurface(camera, replay, faint) {
  const lines = replay.boundaries;
  const surface = faint ? withAlpha(palette.road, 0.55) : palette.road;
  if (replay.shoulder) fillBetween(camera, replay.shoulder, lines[0], faint ? surface : palette.shoulder);
  fillBetween(camera, lines[0], lines[lines.length - 1], surface);
}

function drawMarkings(camera, replay, faint) {
  const { context } = camera;
  const lines = replay.boundaries;
  context.lineCap = "butt";
  for (const line of lines) {
    if (line.marking === "none") continue;
    camera.path(pointsOf(line));
    context.setLineDash(line.marking === "dashed" ? [6 * camera.scale, 12 * camera.scale] : []);
    context.strokeStyle = faint ? withAlpha(palette.edge, 0.5) : palette.marking;
    context.lineWidth = faint ? 1 : Math.max(1.4, 0.15 * camera.scale);
    context.stroke();
  }
  context.setLineDash([]);
  const outer = replay.shoulder || lines[0];
  for (const line of [outer, lines[lines.length - 1]]) {
    camera.path(pointsOf(line));
    context.strokeStyle = faint ? withAlpha(palette.edge, 0.4) : palette.edge;
    context.lineWidth = 1;
    context.stroke();
  }
}

function corners(pose, length, width) {
  const ahead = [Math.cos(pose.heading) * length / 2, Math.sin(pose.heading) * length / 2];
  const left = [-Math.sin(pose.heading) * width / 2, Math.cos(pose.heading) * width / 2];
  return [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([along, across]) => [
    pose.x + along * ahead[0] + across * left[0],
    pose.y + along * ahead[1] + across * left[1],
  ]);
}

/* A body with a mark at its front. */
function drawBody(camera, pose, size, look) {
  const { context } = camera;
  camera.path(corners(pose, size.length, size.width));
  context.closePath();
  if (look.fill) {
    context.fillStyle = look.fill;
    context.fill();
  }
  context.setLineDash(look.dash || []);
  context.strokeStyle = look.stroke;
  context.lineWidth = look.lineWidth || 1.2;
  context.stroke();
  context.setLineDash([]);
  if (look.plain || size.length * camera.scale < 9) return;
  const front = corners(pose, size.length * 0.5, size.width * 0.72);
  camera.path([front[0], [
    pose.x + Math.cos(pose.heading) * size.length * 0.4,
    pose.y + Math.sin(pose.heading) * size.length * 0.4,
  ], front[3]]);
  context.strokeStyle = look.mark || look.stroke;
  context.stroke();
}

/* Text near a place, on a plate that keeps it readable, never outside the canvas. */
function drawLabel(camera, column, row, text, colour, side) {
  const { context } = camera;
  context.font = `600 11px ${palette.sans}`;
  context.textBaseline = "middle";
  context.textAlign = "center";
  const width = context.measureText(text).width + 8;
  const wanted = side === "left" ? column - width / 2 : column;
  const centre = Math.min(Math.max(wanted, width / 2 + 2), camera.width - width / 2 - 2);
  const middle = Math.min(Math.max(row, 9), camera.height - 9);
  context.fillStyle = withAlpha(palette.surface, 0.8);
  context.beginPath();
  context.roundRect(centre - width / 2, middle - 8, width, 15, 3);
  context.fill();
  context.fillStyle = colour;
  context.fillText(text, centre, middle);
}

/* Name a body on the side that is away from the ego's lane. */
function nameBody(camera, pose, size, text, colour) {
  if (!camera.sees(pose.x, pose.y, 0)) return;
  const [column, row] = camera.place(pose.x, pose.y);
  const rows = corners(pose, size.length, size.width).map(([x, y]) => camera.place(x, y)[1]);
  const isBelow = row > camera.anchorY + 4;
  drawLabel(camera, column, isBelow ? Math.max(...rows) + 11 : Math.min(...rows) - 11, text, colour);
}

function drawScaleBar(camera) {
  const { context } = camera;
  const metres = [5, 10, 20, 50, 100, 200].find((size) => size * camera.scale > 60) || 500;
  const length = metres * camera.scale;
  const x = camera.width - length - 12;
  const y = camera.height - 10;
  context.strokeStyle = palette.quiet;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x, y);
  context.lineTo(x + length, y);
  context.lineTo(x + length, y - 4);
  context.stroke();
  context.fillStyle = palette.quiet;
  context.font = `11px ${palette.sans}`;
  context.textAlign = "right";
  context.textBaseline = "alphabetic";
  context.fillText(`${metres} m`, x + length - 4, y - 4);
}

const MARKS = [
  (c, x, y, r) => { c.moveTo(x - r, y); c.lineTo(x + r, y); c.moveTo(x, y - r); c.lineTo(x, y + r); },
  (c, x, y, r) => { c.moveTo(x - r, y - r); c.lineTo(x + r, y + r); c.moveTo(x - r, y + r); c.lineTo(x + r, y - r); },
  (c, x, y, r) => { c.moveTo(x, y - r); c.lineTo(x + r, y); c.lineTo(x, y + r); c.lineTo(x - r, y); c.closePath(); },
  (c, x, y, r) => { c.moveTo(x, y - r); c.lineTo(x + r, y + r); c.lineTo(x - r, y + r); c.closePath(); },
  (c, x, y, r) => { c.moveTo(x + r, y); c.arc(x, y, r, 0, 2 * Math.PI); },
];

/* The sign of a sensor's detections, told by shape as well as by colour. */
function drawMark(context, x, y, sensor, radius) {
  context.beginPath();
  MARKS[sensor % MARKS.length](context, x, y, radius);
  context.strokeStyle = sensorColour(sensor);
  context.lineWidth = 1.8;
  context.stroke();
}
