/* The page around the player: filters, cells of the matrix, commands to copy. */
let toastTimer = 0;

function copyCommand(text) {
  const toast = byId("toast");
  const say = (word) => {
    toast.replaceChildren(word, element("code", { textContent: text }));
    toast.hidden = false;
    clearTimeout(toastTimer);
    toastTimer = setTimeout(() => { toast.hidden = true; }, 6000);
  };
  if (!navigator.clipboard) {
    say("Run: ");
    return;
  }
  navigator.clipboard.writeText(text).then(() => say("Copied: "), () => say("Run: "));
}

function commandButton(text) {
  const button = element("button", { type: "button", class: "command", title: `Copy: ${text}`, "data-command": text });
  button.append(element("code", { textContent: text }));
  return button;
}

function replayOf(run) {
  if (!run) return -1;
  const buttons = [...document.querySelectorAll("#runs [data-replay]")];
  const found = buttons.find((button) => button.dataset.run === run);
  return found ? Number(found.dataset.replay) : -1;
}

function openReplay(run, options) {
  const index = replayOf(run);
  if (index < 0) return false;
  selectReplay(index, options);
  byId("replays").scrollIntoView({ block: "start" });
  byId("player").focus({ preventScroll: true });
  return true;
}

function showCell(button, details) {
  const cell = details[Number(button.dataset.cell)];
  for (const other of document.querySelectorAll(".cell[aria-pressed]")) other.removeAttribute("aria-pressed");
  button.setAttribute("aria-pressed", "true");
  const lines = element("dl");
  for (const [label, text] of cell.lines) {
    lines.append(element("dt", { textContent: label }), element("dd", { textContent: text }));
  }
  const actions = element("div", { class: "actions" });
  const open = () => openReplay(cell.run, { time: cell.time, context: `worst run of ${cell.title}` });
  if (replayOf(cell.run) >= 0) {
    const watch = element("button", { type: "button", class: "open", textContent: "▶ Watch the worst run" });
    watch.addEventListener("click", open);
    actions.append(watch);
  }
  if (cell.command) actions.append(commandButton(cell.command));
  const detail = byId("detail");
  detail.className = `detail v-${cell.style}`;
  detail.replaceChildren(element("h3", { textContent: cell.title }), element("p", { textContent: cell.text }), lines, actions);
  detail.hidden = false;
  open();
}

function applyFilters() {
  const form = byId("filters");
  const wanted = { architecture: form.architecture.value, scenario: form.scenario.value, verdict: form.verdict.value };
  for (const select of form.querySelectorAll("select")) select.classList.toggle("on", select.value !== "");
  byId("reset").hidden = !Object.values(wanted).some(Boolean);
  const fits = (data) => (!wanted.architecture || !data.architecture || data.architecture === wanted.architecture)
    && (!wanted.scenario || data.scenario === undefined || data.scenario === wanted.scenario);
  const has = (data) => !wanted.verdict || data.verdict === undefined || data.verdict === wanted.verdict;
  filterMatrix(fits, has, wanted.scenario !== "");
  for (const node of document.querySelectorAll(".list tbody tr, .card, .suite, .requirement .chip")) {
    node.hidden = !(fits(node.dataset) && has(node.dataset));
  }
  let shown = 0;
  for (const button of document.querySelectorAll("#runs [data-replay]")) {
    const verdicts = button.dataset.verdicts.split(" ");
    button.hidden = !(fits(button.dataset) && (!wanted.verdict || verdicts.includes(wanted.verdict)));
    shown += button.hidden ? 0 : 1;
  }
  if (byId("no-runs")) byId("no-runs").hidden = shown > 0;
}

function filterMatrix(fits, has, onlyOne) {
  const matrix = byId("matrix");
  for (const node of matrix.querySelectorAll("thead tr + tr th, tbody td")) {
    node.hidden = !fits(node.dataset);
    node.classList.toggle("first", onlyOne || node.dataset.scenario === "");
    if (node.tagName === "TD") node.classList.toggle("dim", !has(node.dataset));
  }
  for (const group of matrix.querySelectorAll("thead .group")) {
    const columns = [...matrix.querySelectorAll("thead tr + tr th")].filter(
      (head) => head.dataset.architecture === group.dataset.architecture && !head.hidden,
    );
    group.hidden = columns.length === 0;
    if (columns.length) group.colSpan = columns.length;
  }
  for (const row of matrix.querySelectorAll("tbody tr")) {
    row.hidden = ![...row.querySelectorAll("td")].some((cell) => !cell.hidden && has(cell.dataset));
  }
}

function startPage() {
  readPalette();
  const details = JSON.parse(byId("details").textContent);
  startPlayer();
  for (const button of document.querySelectorAll(".run")) {
    button.classList.toggle("has-replay", replayOf(button.dataset.run) >= 0);
  }
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if (button.dataset.cell !== undefined) showCell(button, details);
    else if (button.classList.contains("run")) {
      const context = `worst case of ${button.dataset.fsr}`;
      const time = button.dataset.time === undefined ? null : Number(button.dataset.time);
      if (!openReplay(button.dataset.run, { context, time })) copyCommand(button.dataset.command);
    } else if (button.dataset.command !== undefined) copyCommand(button.dataset.command);
  });
  const form = byId("filters");
  form.addEventListener("change", applyFilters);
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(applyFilters));
}

startPage();
