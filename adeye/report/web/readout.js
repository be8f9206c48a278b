/* What is true and what is commanded at the cursor, as text. */
class Readout {
  constructor(replay, seek) {
    this.replay = replay;
    this.now = document.getElementById("now");
    this.banner = document.getElementById("banner");
    this.fields = {};
    this.now.replaceChildren();
    for (const name of ["Authority", "Why", "Speed", "Acceleration", "Steering", "Nearest ahead"]) {
      this.fields[name] = element("dd");
      this.now.append(element("dt", { textContent: name }), this.fields[name]);
    }
    this.who = element("span", { class: "who" });
    this.fields.Authority.append(this.who);
    this.channels = replay.channels.map((channel, index) => this.channelRow(channel, index));
    document.getElementById("commands").replaceChildren(...this.channels.map((row) => row.node));
    this.listVerdicts(seek);
    this.listEvents(seek);
  }

  channelRow(channel, index) {
    const gauge = (name) => {
      const bar = element("span");
      const text = element("span");
      const node = element("div", { class: "gauge" }, element("span", { textContent: name }), element("div", {}, bar), text);
      return { node, bar, text };
    };
    const dot = element("i");
    const name = element("b", {}, dot, element("span", { textContent: channel.id }));
    const status = element("span", { class: "status" });
    const acceleration = gauge("accel.");
    const steering = gauge("steer");
    const node = element("div", { class: "channel" }, name, status, acceleration.node, steering.node);
    return { node, dot, status, acceleration, steering, index };
  }

  listVerdicts(seek) {
    const signs = { PASS: "✓", FAIL: "✖", INCONCLUSIVE: "?", VACUOUS: "○", INVALID: "⊘", ERROR: "!", NOT_RUN: "–" };
    const rows = this.replay.verdicts.map((item) => {
      const time = item.binding ? item.binding.time_s : null;
      let text = item.verdict.replace("_", " ");
      const isNumber = !item.binding || !["boolean", "string"].includes(typeof item.binding.value);
      if (item.margin && isNumber && ["PASS", "FAIL"].includes(item.verdict)) {
        const sign = item.margin.value > 0 ? "+" : "";
        text = `${sign}${fixed(item.margin.value, 2)} ${unitText(item.margin.unit)}`;
      }
      if (time !== null) text += ` · ${fixed(time, 2)} s`;
      const button = element(
        "button", { type: "button", class: `v-${item.verdict}`, disabled: time === null },
        element("span", { textContent: signs[item.verdict] }),
        element("span", { textContent: item.fsr }), element("span", { textContent: text }),
      );
      button.title = [item.verdict, item.binding ? item.binding.predicate : "", item.note].filter(Boolean).join("\n");
      if (time !== null) button.addEventListener("click", () => seek(Math.round(time / this.replay.step_s)));
      return button;
    });
    document.getElementById("run-verdicts").replaceChildren(...rows);
  }

  listEvents(seek) {
    const ordered = [...this.replay.events].sort((one, other) => one.time_s - other.time_s);
    this.events = ordered.map((event) => {
      const button = element(
        "button", { type: "button" },
        element("span", { textContent: `${fixed(event.time_s, 2)} s` }),
        element("span", { textContent: event.text }),
      );
      button.addEventListener("click", () => seek(Math.round(event.time_s / this.replay.step_s)));
      return { button, time: event.time_s };
    });
    document.getElementById("events").replaceChildren(...this.events.map(({ button }) => element("li", {}, button)));
  }

  draw(row) {
    const { replay, fields } = this;
    const authority = replay.authority[row];
    this.who.textContent = authority < 0 ? "no channel" : replay.channels[authority].id;
    this.who.style.background = channelColour(authority);
    fields.Why.textContent = replay.reason[row].replace("_", " ");
    const speed = replay.ego.speed[row];
    fields.Speed.textContent = `${fixed(speed, 1)} m/s · ${fixed(speed * 3.6, 0)} km/h`;
    fields.Acceleration.textContent = `${fixed(replay.ego.acceleration[row], 2)} m/s²`;
    fields.Steering.textContent = `${fixed(replay.ego.steering[row] * 180 / Math.PI, 2)}°`;
    fields["Nearest ahead"].textContent = nearestAhead(replay, row);
    for (const channel of this.channels) this.drawChannel(channel, row);
    const active = replay.faults.filter((fault) => fault.active[row]);
    this.banner.hidden = active.length === 0;
    this.banner.textContent = active.map((fault) => `fault: ${fault.id}`).join(" + ");
    const time = row * replay.step_s + 1e-9;
    let current = null;
    for (const event of this.events) {
      event.button.classList.toggle("past", event.time <= time);
      event.button.classList.remove("current");
      if (event.time <= time) current = event;
    }
    if (current && time - current.time < 1) current.button.classList.add("current");
  }

  drawChannel(row_, row) {
    const channel = this.replay.channels[row_.index];
    const acts = this.replay.authority[row] === row_.index;
    const status = channel.status[row];
    row_.node.classList.toggle("acts", acts);
    row_.node.style.color = "";
    row_.dot.style.color = channelColour(row_.index);
    row_.status.textContent = (acts ? "acts · " : "shadow · ") + status.replace("_", " ");
    row_.status.classList.toggle("bad", status === "silent" || status === "fault");
    const set = (gauge, value, full, text) => {
      gauge.bar.style.background = channelColour(row_.index);
      gauge.bar.style.transform = `scaleX(${Math.max(-1, Math.min(1, value / full)) || 0})`;
      gauge.text.textContent = text;
    };
    const acceleration = channel.acceleration[row];
    const degrees = channel.steering[row] * 180 / Math.PI;
    set(row_.acceleration, acceleration, 10, `${fixed(acceleration, 2)} m/s²`);
    set(row_.steering, -degrees, 5, `${fixed(degrees, 2)}°`);
  }
}

function nearestAhead(replay, row) {
  const { ego } = replay;
  let best = null;
  const still = (box) => ({ id: box.id, x: box.x, y: box.y, length: box.length });
  const moving = (actor) => ({ id: actor.id, x: actor.x[row], y: actor.y[row], length: actor.length });
  for (const body of [...replay.actors.map(moving), ...replay.boxes.map(still)]) {
    const dx = body.x - ego.x[row];
    const dy = body.y - ego.y[row];
    const along = dx * Math.cos(ego.heading[row]) + dy * Math.sin(ego.heading[row]);
    const across = dy * Math.cos(ego.heading[row]) - dx * Math.sin(ego.heading[row]);
    if (along <= 0 || Math.abs(across) > 1.9) continue;
    const gap = along - (body.length + ego.length) / 2;
    if (best === null || gap < best.gap) best = { gap, id: body.id };
  }
  return best === null ? "–" : `${best.id} ${fixed(Math.max(0, best.gap), 1)} m`;
}
