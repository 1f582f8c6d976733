// Helpers of both pages: elements, requests, tables, charts in the colours of the page.

export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) continue;
    if (key === "class") made.className = value;
    else if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

export const byId = (id) => document.getElementById(id);

export function show(id, visible) {
  byId(id).hidden = !visible;
}

// The server's word on what went wrong is the command line's own.
export class Refused extends Error {
  constructor(answer) {
    super(answer.error || "the server refused this");
    this.problems = answer.problems || [];
  }
}

export async function ask(path, body) {
  const options = { headers: { "X-Dem-Warp": "1" } };
  if (body !== undefined) {
    options.method = "POST";
    options.body = body instanceof Blob ? body : JSON.stringify(body);
  }
  const answer = await fetch(path, options);
  const found = await answer.json();
  if (found && found.error) throw new Refused(found);
  if (!answer.ok) throw new Refused({ error: `the server answered ${answer.status}` });
  return found;
}

export function number(value) {
  if (typeof value !== "number") return value === null || value === undefined ? "" : String(value);
  if (Number.isInteger(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(3);
  return String(Number(value.toPrecision(5)));
}

export function table(columns, rows, caption) {
  const numeric = columns.map((_, i) => rows.every((row) => typeof row[i] === "number" || row[i] === null));
  const kind = (i) => (numeric[i] ? "number" : "text");
  const head = element("tr", {}, ...columns.map((name, i) =>
    element("th", { scope: "col", class: kind(i) }, name.replaceAll("_", " "))));
  const body = rows.map((row) => element("tr", {}, ...row.map((value, i) =>
    element("td", { class: typeof value === "string" && value.length > 60 ? "text long" : kind(i) }, number(value)))));
  const whole = element("table", {}, element("thead", {}, head), element("tbody", {}, ...body));
  const attributes = { class: "scroll tall", tabindex: "0", role: "region", "aria-label": caption };
  return element("div", attributes, whole);
}

const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Charts come in the colours of paper; the page may be dark.
function themed(figure) {
  const [ink, muted, grid] = ["--ink", "--muted", "--grid"].map(color);
  const layout = structuredClone(figure.layout);
  Object.assign(layout, { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)" });
  layout.font = { ...layout.font, color: ink };
  for (const name of ["xaxis", "yaxis"]) {
    Object.assign(layout[name], { linecolor: muted, tickcolor: muted, gridcolor: grid });
  }
  return layout;
}

export function drawChart(place, figure) {
  if (!place.dataset.watched) {
    place.dataset.watched = "yes";
    new ResizeObserver(() => place.data && Plotly.Plots.resize(place)).observe(place);
  }
  Plotly.react(place, structuredClone(figure.data), themed(figure), { displayModeBar: false });
}

export const darkness = matchMedia("(prefers-color-scheme: dark)");
