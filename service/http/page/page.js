// The page: ground, anchors and question on the left, map in the middle, answer on the right.

import { ask, calculate } from "./api.js";
import { list, showAnswer } from "./answer.js";
import { MapView } from "./map.js";

const by = (id) => document.getElementById(id);
const FIRST_HEIGHT_M = 150; // as high as the drones of the demo
const state = { dem: null, anchors: [], placed: 0, cancelling: false, turn: 0 };
const map = new MapView({
  placed: (east, north) => addAnchor(east, north),
  moved: (anchor, east, north) => changeAnchor(anchor, { east_m: east, north_m: north }),
  removed: (anchor) => removeAnchor(anchor),
});

function tell(sentence) { by("status").textContent = sentence; }

// Run what somebody asked for; whatever goes wrong is told in one sentence.
async function attempt(work) {
  by("error").textContent = "";
  try {
    await work();
  } catch (error) {
    tell("");
    by("error").textContent = error.message;
  }
}

// Ground

async function listGround() {
  const { body } = await ask("/dems?limit=100");
  by("uploaded").replaceChildren(...body.dems.map((dem) => new Option(dem.name, `dem:${dem.id}`)));
}

async function takeGround(request) {
  tell("Reading the ground …");
  const turn = ++state.turn;
  const { body: dem } = await request;
  if (turn !== state.turn) return;
  state.dem = dem;
  state.anchors = [];
  state.placed = 0;
  map.show(dem);
  by("answer").hidden = true;
  drawAnchors();
  showFacts(dem);
  await listGround();
  by("ground").value = `dem:${dem.id}`;
  tell("Click on the map where the anchors are.");
}

function showFacts(dem) {
  const km = (cells, cell_m) => ((cells * cell_m) / 1000).toPrecision(3);
  const heights = dem.lowest_m === null ? "no height known" : `${dem.lowest_m.toFixed(0)} to ${dem.highest_m.toFixed(0)} m`;
  by("ground-facts").textContent = [
    `${dem.name}: ${km(dem.cols, dem.cell_east_m)} × ${km(dem.rows, dem.cell_north_m)} km, ${heights},`,
    `cells ${dem.cell_east_m.toPrecision(3)} × ${dem.cell_north_m.toPrecision(3)} m, ${dem.crs_name ?? "local metres"}.`,
  ].join(" ");
  list(by("ground-warnings"), dem.warnings);
  list(by("ground-conversions").querySelector("ul"), dem.conversions);
  by("ground-conversions").hidden = dem.conversions.length === 0;
}

// Anchors

function nextId() {
  const taken = new Set(state.anchors.map((anchor) => anchor.id));
  let number = 1;
  while (taken.has(`D${number}`)) number += 1;
  return `D${number}`;
}

function addAnchor(east, north) {
  const key = String((state.placed += 1));
  state.anchors.push({ key, id: nextId(), east_m: east, north_m: north, height_m: FIRST_HEIGHT_M, from: "above_ground_m" });
  anchorsChanged();
}

function changeAnchor(anchor, changes) {
  Object.assign(anchor, changes);
  anchorsChanged();
}

function removeAnchor(anchor) {
  state.anchors = state.anchors.filter((other) => other !== anchor);
  anchorsChanged();
}

function anchorsChanged() {
  drawAnchors();
  questionChanged();
}

function questionChanged() { by("stale").hidden = false; }

function drawAnchors() {
  map.mark(state.anchors);
  by("anchors").hidden = state.anchors.length === 0;
  by("anchors").querySelector("tbody").replaceChildren(...state.anchors.map(anchorRow));
}

function anchorRow(anchor) {
  const line = document.createElement("tr");
  const cell = (content) => line.insertCell().append(content);
  const field = (name, type, words) => {
    const input = Object.assign(document.createElement("input"), { type, value: anchor[name], required: true });
    if (type === "number") input.step = "any";
    input.setAttribute("aria-label", `${words} of anchor ${anchor.id}`);
    input.addEventListener("change", () => {
      anchor[name] = type === "number" ? input.valueAsNumber : input.value.trim();
      map.mark(state.anchors);
      questionChanged();
    });
    cell(input);
  };
  field("id", "text", "Id");
  field("east_m", "number", "East in metres");
  field("north_m", "number", "North in metres");
  field("height_m", "number", "Height in metres");
  const from = document.createElement("select");
  from.append(new Option("ground", "above_ground_m"), new Option("datum", "altitude_m"));
  from.value = anchor.from;
  from.setAttribute("aria-label", `What the height of anchor ${anchor.id} counts from`);
  from.addEventListener("change", () => { anchor.from = from.value; questionChanged(); });
  cell(from);
  const remove = Object.assign(document.createElement("button"), { type: "button", textContent: "×" });
  remove.setAttribute("aria-label", `Remove anchor ${anchor.id}`);
  remove.addEventListener("click", () => { removeAnchor(anchor); by("add").focus(); });
  cell(remove);
  return line;
}

// Question and answer

function number(id, words) {
  const value = by(id).valueAsNumber;
  if (Number.isNaN(value)) throw new Error(`${words} is not a number.`);
  return value;
}

function question(kind) {
  if (!state.dem) throw new Error("Choose a ground first.");
  if (!state.anchors.length) throw new Error("Place at least one anchor: click on the map.");
  const anchors = state.anchors.map(({ id, east_m, north_m, height_m, from }) => {
    if ([east_m, north_m, height_m].some(Number.isNaN)) throw new Error(`Anchor ${id} lacks a number.`);
    return { id, east_m, north_m, [from]: height_m };
  });
  const asked = {
    dem_id: state.dem.id,
    anchors,
    mode: by("mode").value,
    receiver_above_ground_m: number("receiver", "The antenna's height"),
  };
  if (kind === "visibility-maps") return asked;
  return {
    ...asked,
    kind: by("ranging").value,
    measure: by("measure").value,
    dop_limit: number("limit", "The limit of the dilution"),
    on_surface: by("surface").checked,
  };
}

async function answer() {
  const kind = document.querySelector("input[name=kind]:checked").value;
  const asked = question(kind);
  const turn = state.turn;
  for (const [id, hidden] of [["cancel", false], ["progress", false]]) by(id).hidden = hidden;
  by("ask").disabled = true;
  by("progress").removeAttribute("value");
  state.cancelling = false;
  tell("Calculating …");
  try {
    const job = await calculate(`/${kind}`, asked, async (running) => {
      if (state.cancelling) await ask(running.links.self, { method: "DELETE" });
      if (running.progress !== null) by("progress").value = running.progress;
    });
    if (turn !== state.turn) return;
    if (job === null) {
      tell("Cancelled.");
      return;
    }
    const href = (name) => job.layers.find((layer) => layer.name === name).href;
    const { body: legend } = await ask(href("legend.json"));
    map.cover(href("overlay.png"), `Map of the answer: ${legend.title}; the legend tells its classes and their shares`);
    showAnswer(job, legend);
    tell("Done.");
  } finally {
    by("ask").disabled = false;
    for (const id of ["cancel", "progress"]) by(id).hidden = true;
  }
}

by("ground").addEventListener("change", (event) => {
  const [kind, name] = event.target.value.split(":");
  if (kind === "sample") attempt(() => takeGround(ask(`/dems?sample=${encodeURIComponent(name)}`, { method: "POST" })));
  if (kind === "dem") attempt(() => takeGround(ask(`/dems/${encodeURIComponent(name)}`)));
});
by("file").addEventListener("change", (event) => {
  const [file] = event.target.files;
  if (!file) return;
  const body = new FormData();
  body.append("file", file);
  attempt(() => takeGround(ask("/dems", { method: "POST", body })));
});
by("add").addEventListener("click", () => attempt(() => {
  if (!state.dem) throw new Error("Choose a ground first.");
  addAnchor(...map.middle());
}));
by("cancel").addEventListener("click", () => {
  state.cancelling = true;
  tell("Cancelling …");
});
by("question").addEventListener("submit", (event) => {
  event.preventDefault();
  attempt(answer);
});
for (const id of ["receiver", "mode", "dop-options"]) by(id).addEventListener("change", questionChanged);
for (const choice of document.querySelectorAll("input[name=kind]")) {
  choice.addEventListener("change", () => {
    by("dop-options").hidden = choice.value !== "dop-maps";
    questionChanged();
  });
}
attempt(listGround);
