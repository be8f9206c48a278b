/* Read what embed.py packed: differences to numbers, repeats to columns. */
function decodeNumbers(packed) {
  const values = new Float64Array(packed.d.length);
  let steps = 0;
  packed.d.forEach((difference, row) => {
    if (difference === null) {
      values[row] = NaN;
    } else {
      steps += difference;
      values[row] = steps / packed.k;
    }
  });
  return values;
}

function decodeRepeats(packed) {
  const values = [];
  for (let index = 0; index < packed.length; index += 2) {
    for (let left = packed[index + 1]; left > 0; left -= 1) values.push(packed[index]);
  }
  return values;
}

/* Where the entries of each row begin in the columns that hold all rows one after the other. */
function offsetsOf(counts) {
  const offsets = new Int32Array(counts.length + 1);
  counts.forEach((count, row) => { offsets[row + 1] = offsets[row] + count; });
  return offsets;
}

function decodeLine(packed) {
  return { marking: packed.marking, x: decodeNumbers(packed.x), y: decodeNumbers(packed.y) };
}

function decodeMotion(packed) {
  const columns = {};
  for (const name of ["x", "y", "heading", "speed", "acceleration", "steering"]) {
    if (packed[name]) columns[name] = decodeNumbers(packed[name]);
  }
  return { ...packed, ...columns };
}

function decodeSensor(packed) {
  return {
    ...packed,
    alive: decodeRepeats(packed.alive),
    offsets: offsetsOf(decodeRepeats(packed.count)),
    dx: decodeNumbers(packed.dx),
    dy: decodeNumbers(packed.dy),
    points: packed.points && decodePoints(packed.points),
  };
}

/* Returns of a lidar: rows that show one sample share its places. */
function decodePoints(packed) {
  const ends = offsetsOf(packed.count);
  const sample = packed.rows.flatMap((rows, index) => Array(rows).fill(index));
  return { ends, sample, x: decodeNumbers(packed.x), y: decodeNumbers(packed.y) };
}

function decodeChannel(packed) {
  return {
    ...packed,
    acceleration: decodeNumbers(packed.acceleration),
    steering: decodeNumbers(packed.steering),
    status: decodeRepeats(packed.status),
    tracks: packed.tracks && {
      offsets: offsetsOf(decodeRepeats(packed.tracks.count)),
      columns: packed.tracks.columns.map(decodeNumbers),
    },
    fan: packed.fan ? decodeFan(packed.fan) : null,
  };
}

function decodeFan(packed) {
  return {
    every: packed.every,
    offsets: offsetsOf(decodeRepeats(packed.count)),
    points: offsetsOf(decodeRepeats(packed.points)),
    chosen: decodeRepeats(packed.chosen),
    desirability: decodeNumbers(packed.desirability),
    x: decodeNumbers(packed.x),
    y: decodeNumbers(packed.y),
  };
}

/* The cells of each map: runs of changes against the row before, or against the map before, too. */
function decodeCells(texts, columns, count) {
  let before = new Uint8Array(count);
  return texts.map((text) => {
    const cells = new Uint8Array(count);
    let at = 0;
    for (const [, letter, times] of text.matchAll(/([a-p])(\d*)/g)) {
      const end = at + Number(times || 1);
      cells.fill(letter.charCodeAt(0) - 97, at, end);
      at = end;
    }
    for (let cell = columns; cell < count; cell += 1) cells[cell] ^= cells[cell - columns];
    if (text[0] === "+") {
      for (let cell = 0; cell < count; cell += 1) cells[cell] ^= before[cell];
    }
    before = cells;
    return cells;
  });
}

function decodeGrid(packed) {
  const cells = (texts) => decodeCells(decodeRepeats(texts), packed.columns, packed.columns * packed.rows);
  return { ...packed, number: cells(packed.number), occupied: cells(packed.occupied), pictures: {} };
}

/* The camera turns with the road, not with every twitch of the ego: the mean over two seconds. */
function smoothHeading(heading, step) {
  const reach = Math.max(1, Math.round(1 / step));
  return heading.map((_, row) => {
    let sine = 0;
    let cosine = 0;
    const last = Math.min(heading.length - 1, row + reach);
    for (let other = Math.max(0, row - reach); other <= last; other += 1) {
      sine += Math.sin(heading[other]);
      cosine += Math.cos(heading[other]);
    }
    return Math.atan2(sine, cosine);
  });
}

/* A run in left-hand traffic is told in the mirror: turn what is positive to the left round. */
function turnRound({ ego, boundaries, shoulder, actors, boxes, sensors, channels, grid }) {
  const turn = (values) => { if (values) values.forEach((value, at) => { values[at] = -value; }); };
  const fans = channels.map((channel) => channel.fan || {});
  const points = sensors.map((sensor) => sensor.points || {});
  for (const part of [ego, shoulder || {}, ...boundaries, ...actors, ...channels, ...fans, ...points]) {
    for (const name of ["y", "heading", "steering"]) turn(part[name]);
  }
  for (const box of boxes) Object.assign(box, { y: -box.y, heading: -box.heading });
  for (const sensor of sensors) {
    Object.assign(sensor, { y: -sensor.y, yaw: -sensor.yaw });
    turn(sensor.dy);
  }
  // Of a track, y and the speed along it.
  for (const { tracks } of channels) for (const at of [1, 3]) if (tracks) turn(tracks.columns[at]);
  if (grid) {
    grid.y_m = -grid.y_m - grid.rows * grid.cell_m;
    const row = (cells, at) => cells.slice(at * grid.columns, (at + 1) * grid.columns);
    for (const cells of [...grid.number, ...grid.occupied]) {
      const rows = Array.from({ length: grid.rows }, (_, at) => row(cells, grid.rows - 1 - at));
      rows.forEach((found, at) => cells.set(found, at * grid.columns));
    }
  }
}

function decodeReplay(raw) {
  const replay = decodeParts(raw);
  if (raw.left_hand) turnRound(replay);
  return { ...replay, camera: smoothHeading(replay.ego.heading, raw.step_s) };
}

function decodeParts(raw) {
  return {
    ...raw,
    ego: decodeMotion(raw.ego),
    boundaries: raw.boundaries.map(decodeLine),
    shoulder: raw.shoulder && decodeLine(raw.shoulder),
    actors: raw.actors.map(decodeMotion),
    boxes: raw.boxes.map((box) => ({ ...box })),
    sensors: raw.sensors.map(decodeSensor),
    channels: raw.channels.map(decodeChannel),
    grid: raw.grid ? decodeGrid(raw.grid) : null,
    faults: raw.faults.map((fault) => ({ ...fault, active: decodeRepeats(fault.active) })),
    authority: decodeRepeats(raw.authority),
    reason: decodeRepeats(raw.reason),
    signals: raw.signals.map((signal) => ({ ...signal, values: decodeNumbers(signal.values) })),
  };
}

/* A place between two rows, for smooth drawing; everything that is read off is taken at a row. */
function poseAt(motion, row, share) {
  const next = Math.min(row + 1, motion.x.length - 1);
  const mix = (column) => column[row] + share * (column[next] - column[row]);
  let turn = motion.heading[next] - motion.heading[row];
  turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI));
  return { x: mix(motion.x), y: mix(motion.y), heading: motion.heading[row] + share * turn };
}
