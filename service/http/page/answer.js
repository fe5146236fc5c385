// What an answer says: legend, numbers, warnings and files. Texts of others are set as text, never as HTML.

const by = (id) => document.getElementById(id);
const percent = (share) => (share === null || share === undefined ? "–" : `${(100 * share).toFixed(1)} %`);
const figure = (value, unit = "") => (value === null || value === undefined ? "no fix" : `${value.toFixed(2)}${unit}`);

function row(label, value, colour) {
  const line = document.createElement("tr");
  const name = Object.assign(document.createElement("th"), { scope: "row" });
  if (colour) {
    const swatch = Object.assign(document.createElement("span"), { className: "swatch" });
    swatch.style.backgroundColor = colour;
    name.append(swatch);
  }
  name.append(label);
  line.append(name, Object.assign(document.createElement("td"), { className: "number", textContent: value }));
  return line;
}

function fill(table, caption, rows) {
  by(table).querySelector("caption").textContent = caption;
  by(table).querySelector("tbody").replaceChildren(...rows);
}

function item(...content) {
  const entry = document.createElement("li");
  entry.append(...content);
  return entry;
}

export function list(element, sentences) {
  element.replaceChildren(...sentences.map((sentence) => item(sentence)));
}

function numbersOfSight(result) {
  const rows = result.anchors.map((anchor) => row(anchor.id, percent(anchor.visible_share)));
  fill("numbers", "Ground that sees each anchor", rows);
}

function numbersOfDop(result) {
  const { p50, p95 } = result.dop_quantiles;
  const rows = [
    row(`${result.measure.toUpperCase()} below ${result.dop_limit}`, percent(result.share_within_limit)),
    row("no-go: beyond it, or no fix", percent(result.share_no_go)),
    row("unknown", percent(result.share_unknown)),
    row("median dilution", figure(p50)),
    row("dilution at the 95th percent", figure(p95)),
  ];
  const error = result.position_error_quantiles_m.position;
  if (error) rows.push(row("median position error, 1σ", figure(error.p50, " m")));
  fill("numbers", "Positioning on the ground", rows);
}

export function showAnswer(job, legend) {
  const { result, layers } = job;
  const rows = legend.classes.map((kind) => row(kind.label, percent(kind.share), kind.colour));
  fill("legend", `${legend.title}, share of known ground`, rows);
  if (result.dop_quantiles) numbersOfDop(result);
  else numbersOfSight(result);
  list(by("warnings"), result.warnings);
  by("trust").textContent = `Mode ${result.mode}: ${result.error_statement}. Curvature: ${result.curvature}.`;
  const files = layers.map((layer) => {
    const link = Object.assign(document.createElement("a"), { href: layer.href, textContent: layer.name });
    link.download = layer.name;
    return item(link, ` – ${layer.description}`);
  });
  by("downloads").querySelector("ul").replaceChildren(...files);
  by("stale").hidden = true;
  by("answer").hidden = false;
}
