/* The two views: the world as it is, and what the channels make of it. */
const LOOK_AHEAD = 2.5; // seconds over which a command is drawn as a path

function drawFields(camera, replay, row, ego) {
  const { context } = camera;
  replay.sensors.forEach((sensor, index) => {
    if (sensor.fov === null || sensor.range === null) return;
    const cosine = Math.cos(ego.heading);
    const sine = Math.sin(ego.heading);
    const [x, y] = camera.place(
      ego.x + cosine * sensor.x - sine * sensor.y,
      ego.y + sine * sensor.x + cosine * sensor.y,
    );
    // The canvas counts angles clockwise, and the camera is turned.
    const middle = camera.pose.heading - ego.heading - sensor.yaw;
    const whole = sensor.fov >= 2 * Math.PI - 1e-6;
    context.beginPath();
    if (!whole) context.moveTo(x, y);
    context.arc(x, y, sensor.range * camera.scale, middle - sensor.fov / 2, middle + sensor.fov / 2);
    if (!whole) context.closePath();
    const alive = sensor.alive[row];
    if (alive) {
      context.fillStyle = withAlpha(sensorColour(index), whole ? 0.03 : 0.09);
      context.fill();
    }
    context.setLineDash(alive ? [] : [5, 5]);
    context.strokeStyle = alive ? withAlpha(sensorColour(index), 0.45) : palette.fail;
    context.lineWidth = 1;
    context.stroke();
    context.setLineDash([]);
  });
}

function drawPoints(camera, replay, row) {
  const { context } = camera;
  replay.sensors.forEach(({ points }, index) => {
    if (!points) return;
    context.fillStyle = withAlpha(sensorColour(index), 0.75);
    const sample = points.sample[row];
    for (let at = points.ends[sample]; at < points.ends[sample + 1]; at += 1) {
      const [x, y] = camera.place(points.x[at], points.y[at]);
      context.fillRect(x - 1, y - 1, 2, 2);
    }
  });
}

function drawDetections(camera, replay, row, radius) {
  drawPoints(camera, replay, row);
  replay.sensors.forEach((sensor, index) => {
    for (let at = sensor.offsets[row]; at < sensor.offsets[row + 1]; at += 1) {
      const [x, y] = camera.place(sensor.dx[at], sensor.dy[at]);
      drawMark(camera.context, x, y, index, radius);
    }
  });
}

function drawBoxes(camera, replay, faint) {
  for (const box of replay.boxes) {
    drawBody(camera, box, box, {
      fill: faint ? null : withAlpha(palette.static, 0.55),
      stroke: faint ? withAlpha(palette.static, 0.7) : palette.static,
      dash: faint ? [2, 3] : [],
      plain: true,
    });
  }
}

function drawWorld(size, replay, moment, options) {
  const { row, share } = moment;
  const ego = poseAt(replay.ego, row, share);
  const camera = new Camera(size, { x: ego.x, y: ego.y, heading: moment.heading }, moment.scale);
  drawSurface(camera, replay, false);
  drawMarkings(camera, replay, false);
  if (options.fields) drawFields(camera, replay, row, ego);
  drawBoxes(camera, replay, false);
  for (const actor of replay.actors) {
    const pose = poseAt(actor, row, share);
    const colour = bodyColour(actor.kind);
    drawBody(camera, pose, actor, { fill: withAlpha(colour, 0.85), stroke: colour, mark: palette.surface });
  }
  const authority = channelColour(replay.authority[row]);
  drawBody(camera, ego, replay.ego, {
    fill: authority, stroke: palette.ink, mark: palette.surface, lineWidth: 1.4,
  });
  if (options.detections) drawDetections(camera, replay, row, 4);
  for (const box of replay.boxes) nameBody(camera, box, box, box.id, palette.quiet);
  for (const actor of replay.actors) {
    const text = `${actor.id}  ${fixed(actor.speed[row] * 3.6, 0)} km/h`;
    nameBody(camera, poseAt(actor, row, share), actor, text, bodyColour(actor.kind));
  }
  const who = replay.authority[row] < 0 ? "no channel" : replay.channels[replay.authority[row]].id;
  const text = `ego · ${who}  ${fixed(replay.ego.speed[row] * 3.6, 0)} km/h`;
  const behind = camera.anchorX - replay.ego.length * camera.scale / 2 - 6;
  drawLabel(camera, behind, camera.anchorY, text, authority, "left");
  drawScaleBar(camera);
}

/* Where the ego would go if a command were held: constant acceleration and curvature. */
function commandPath(replay, row, ego, channel) {
  const curvature = Math.tan(channel.steering[row]) / replay.ego.wheelbase;
  const points = [[ego.x, ego.y]];
  let { x, y, heading } = ego;
  let speed = replay.ego.speed[row];
  const step = 0.05;
  for (let time = 0; time < LOOK_AHEAD - 1e-9; time += step) {
    const next = Math.max(0, speed + channel.acceleration[row] * step);
    const travelled = (speed + next) / 2 * step;
    const turn = curvature * travelled;
    x += travelled * Math.cos(heading + turn / 2);
    y += travelled * Math.sin(heading + turn / 2);
    heading += turn;
    speed = next;
    points.push([x, y]);
  }
  return points;
}

function drawCommand(camera, replay, row, ego, index) {
  const { context } = camera;
  const channel = replay.channels[index];
  if (channel.status[row] === "silent") return;
  if (!Number.isFinite(channel.acceleration[row]) || !Number.isFinite(channel.steering[row])) return;
  const acts = replay.authority[row] === index;
  // Shadow commands run beside the acting one, so that equal commands stay visible.
  const side = (acts ? 0 : 1) * (index % 2 === 0 ? 1 : -1) * 0.55;
  const shifted = commandPath(replay, row, ego, channel).map(([x, y]) => [
    x - side * Math.sin(ego.heading), y + side * Math.cos(ego.heading),
  ]);
  camera.path(shifted);
  context.strokeStyle = channelColour(index);
  context.lineWidth = acts ? 3.5 : 1.8;
  context.setLineDash(acts ? [] : [6, 4]);
  context.lineJoin = "round";
  context.stroke();
  context.setLineDash([]);
  const [x, y] = camera.place(...shifted[shifted.length - 1]);
  context.beginPath();
  context.arc(x, y, acts ? 4.5 : 3.2, 0, 2 * Math.PI);
  context.fillStyle = channelColour(index);
  context.fill();
}

/* A smooth line through places of the map: straight pieces rounded at their middles. */
function smoothPath(camera, places) {
  const { context } = camera;
  const points = places.map(([x, y]) => camera.place(x, y));
  context.beginPath();
  context.moveTo(...points[0]);
  for (let at = 1; at < points.length - 1; at += 1) {
    const middle = [0, 1].map((axis) => (points[at][axis] + points[at + 1][axis]) / 2);
    context.quadraticCurveTo(...points[at], ...middle);
  }
  context.lineTo(...points[points.length - 1]);
}

/* The trajectories that a channel chose from: the more desirable the stronger, the chosen one wide. */
function drawFan(camera, replay, row, channel, colour) {
  const { fan } = channel;
  if (!fan || channel.status[row] === "silent") return;
  const { context } = camera;
  const shown = Math.floor(row / fan.every);
  const from = [replay.ego.x[shown * fan.every], replay.ego.y[shown * fan.every]];
  context.lineCap = "round";
  context.lineJoin = "round";
  // They lie in the order of their desirability, so that the better ones are drawn over the worse.
  for (let at = fan.offsets[shown]; at < fan.offsets[shown + 1]; at += 1) {
    const places = [from];
    for (let point = fan.points[at]; point < fan.points[at + 1]; point += 1) {
      places.push([fan.x[point], fan.y[point]]);
    }
    const [x, y] = camera.place(...places[places.length - 1]);
    smoothPath(camera, places);
    if (fan.chosen[at]) {
      context.strokeStyle = palette.surface;
      context.lineWidth = 7;
      context.stroke();
    }
    const shade = fan.desirability[at];
    const look = fan.chosen[at] ? colour : fanColour(colour, shade);
    context.strokeStyle = look;
    context.lineWidth = fan.chosen[at] ? 4 : 1 + 1.4 * shade;
    context.setLineDash(shade > 0 || fan.chosen[at] ? [] : [2, 5]);
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.arc(x, y, fan.chosen[at] ? 5 : 2.2, 0, 2 * Math.PI);
    context.fillStyle = look;
    context.fill();
  }
  context.lineCap = "butt";
}

function drawTracks(camera, ego, channel, row, colour) {
  if (!channel.tracks) return;
  const { context } = camera;
  const [xs, ys, vxs, vys, lengths, widths] = channel.tracks.columns;
  const cosine = Math.cos(ego.heading);
  const sine = Math.sin(ego.heading);
  for (let at = channel.tracks.offsets[row]; at < channel.tracks.offsets[row + 1]; at += 1) {
    const x = ego.x + cosine * xs[at] - sine * ys[at];
    const y = ego.y + sine * xs[at] + cosine * ys[at];
    const pose = { x, y, heading: ego.heading };
    drawBody(camera, pose, { length: lengths[at], width: widths[at] }, {
      fill: withAlpha(colour, 0.14), stroke: colour, plain: true, lineWidth: 1.6,
    });
    camera.path([[x, y], [x + cosine * vxs[at] - sine * vys[at], y + sine * vxs[at] + cosine * vys[at]]]);
    context.strokeStyle = colour;
    context.lineWidth = 1.4;
    context.stroke();
  }
}

function drawRings(camera, ego) {
  const { context } = camera;
  context.strokeStyle = withAlpha(palette.edge, 0.35);
  context.fillStyle = palette.quiet;
  context.font = `10.5px ${palette.sans}`;
  context.textAlign = "left";
  context.textBaseline = "alphabetic";
  context.lineWidth = 1;
  const [x, y] = camera.place(ego.x, ego.y);
  const apart = [10, 25, 50, 100].find((metres) => metres * camera.scale > 90) || 200;
  for (let metres = apart; x + metres * camera.scale < camera.width - 30; metres += apart) {
    context.beginPath();
    context.arc(x, y, metres * camera.scale, -0.9, 0.9);
    context.stroke();
    const at = [`${metres} m`, x + metres * camera.scale + 3, camera.height - 6];
    context.save();
    context.strokeStyle = withAlpha(palette.surface, 0.8);
    context.lineWidth = 3;
    context.strokeText(...at);
    context.restore();
    context.fillText(...at);
  }
}

/* The cells of a map, one pixel each, front to the right and left side up. */
function gridPicture(grid, name, shown, colour) {
  const look = `${shown} ${palette["cell-safe"]} ${palette["cell-taken"]}`;
  const kept = grid.pictures[name];
  if (kept && kept.look === look) return kept.canvas;
  const canvas = kept ? kept.canvas : element("canvas");
  canvas.width = grid.columns;
  canvas.height = grid.rows;
  const context = canvas.getContext("2d");
  const cells = grid[name][shown];
  for (let row = 0; row < grid.rows; row += 1) {
    const first = row * grid.columns;
    for (let from = 0; from < grid.columns;) {
      const code = cells[first + from];
      let to = from + 1;
      while (to < grid.columns && cells[first + to] === code) to += 1;
      context.fillStyle = colour(grid, code);
      context.fillRect(from, grid.rows - 1 - row, to - from, 1);
      from = to;
    }
  }
  grid.pictures[name] = { canvas, look };
  return canvas;
}

/* The newest maps of the ground and of what is occupied, each where the ego was when it was made. */
function drawGrid(camera, replay, row) {
  const { context } = camera;
  const { grid } = replay;
  const size = grid.cell_m * camera.scale;
  const box = [
    grid.x_m * camera.scale, -grid.y_m * camera.scale - grid.rows * size, grid.columns * size, grid.rows * size,
  ];
  const layers = [["number", grid.every, ratingColour], ["occupied", grid.occupied_every, occupiedColour]];
  for (const [name, every, colour] of layers) {
    const shown = Math.floor(row / every);
    const at = shown * every;
    context.save();
    context.translate(...camera.place(replay.ego.x[at], replay.ego.y[at]));
    context.rotate(camera.pose.heading - replay.ego.heading[at]);
    context.imageSmoothingEnabled = false;
    context.globalAlpha = 0.9;
    context.drawImage(gridPicture(grid, name, shown, colour), ...box);
    context.restore();
  }
}

function drawBelief(size, replay, moment, options) {
  const { row, share } = moment;
  const ego = poseAt(replay.ego, row, share);
  const camera = new Camera(size, { x: ego.x, y: ego.y, heading: moment.heading }, moment.scale);
  drawSurface(camera, replay, true);
  if (options.grid) drawGrid(camera, replay, row);
  drawMarkings(camera, replay, true);
  drawRings(camera, ego);
  if (options.truth) {
    drawBoxes(camera, replay, true);
    for (const actor of replay.actors) {
      drawBody(camera, poseAt(actor, row, share), actor, {
        stroke: withAlpha(palette.ink, 0.55), dash: [2, 3], plain: true, lineWidth: 1,
      });
    }
  }
  if (options.fan) {
    replay.channels.forEach((channel, index) => drawFan(camera, replay, row, channel, channelColour(index)));
  }
  replay.channels.forEach((channel, index) => drawTracks(camera, ego, channel, row, channelColour(index)));
  if (options.detections) drawDetections(camera, replay, row, 4.5);
  replay.channels.forEach((_, index) => drawCommand(camera, replay, row, ego, index));
  drawBody(camera, ego, replay.ego, {
    fill: palette.surface, stroke: channelColour(replay.authority[row]), lineWidth: 2,
  });
}
