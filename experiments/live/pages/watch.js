// The page that watches a run: it asks for the state once a second while the run lasts.
import { byId, darkness, drawChart, element, number, show, table } from "./page.js";
import { View } from "./heap_view.js";

const RUNNING_EVERY = 1000, ENDED_EVERY = 5000, LONGEST_SILENCE = 8000;
const tiles = new Map(), charts = new Map();
let tag = null, state = null, heard = Date.now(), shownStages = -1;

async function look() {
  try {
    const answer = await fetch("state.json", { headers: tag ? { "If-None-Match": tag } : {}, cache: "no-store" });
    heard = Date.now();
    show("lost", false);
    if (answer.status === 200) {
      tag = answer.headers.get("ETag");
      state = await answer.json();
      render();
    }
    await refreshHeaps();
  } catch (error) {
    if (!(error instanceof TypeError)) throw error; // a TypeError is how a lost server shows
    show("lost", Date.now() - heard > LONGEST_SILENCE || (state && state.progress.state !== "running"));
  } finally {
    const lasting = !state || ["running", "waiting"].includes(state.progress.state);
    setTimeout(look, lasting ? RUNNING_EVERY : ENDED_EVERY);
  }
}

function render() {
  const { run, progress } = state;
  const about = [run.command, run.scale && `scale ${run.scale}`, run.device, state.folder];
  byId("title").textContent = run.study || state.folder;
  byId("about").textContent = about.filter(Boolean).join(" · ");
  byId("state").textContent = progress.state;
  byId("state").className = `badge ${progress.state}`;
  byId("message").textContent = progress.message || "";
  document.title = `${progress.state === "running" ? `${Math.round(100 * (progress.fraction || 0))} % ` : ""}` +
    `${run.study || state.folder} – dem-warp`;
  renderBatch(progress);
  renderResults();
  renderTiles();
  renderCharts();
  renderStages();
  renderCases();
  renderLog();
}

function renderBatch(progress) {
  const busy = progress.state === "running" && Boolean(progress.title);
  show("batch", busy);
  if (!busy) return;
  const phases = Object.entries(progress.phases || {}).filter(([name]) => name !== "waiting");
  const words = [`${Math.round(100 * (progress.fraction || 0))} %`, `${progress.done} of ${progress.total} cases`,
    ...phases.map(([name, count]) => `${count} ${name}`)];
  if (progress.left_text) words.unshift(`${progress.left_text} left`);
  byId("batch-title").textContent = `${progress.title}:`;
  byId("batch-text").textContent = words.join(", ");
  byId("bar").value = progress.fraction || 0;
}

function renderResults() {
  show("results-section", state.outputs.length > 0);
  const links = state.outputs.map((name) => element("li", {}, element(
    "a", { href: `file/${name}`, class: name === "report.html" ? "first" : "" },
    name === "report.html" ? "The report" : name)));
  byId("results").replaceChildren(...links);
}

function renderTiles() {
  const wanted = new Set(state.heaps.map((heap) => heap.id));
  for (const [id, tile] of tiles) {
    if (!wanted.has(id)) { tile.figure.remove(); tiles.delete(id); }
  }
  byId("heaps").className = state.heaps.length === 1 ? "tiles one" : "tiles";
  show("heaps-note", state.heaps.length === 0);
  state.heaps.forEach((heap, place) => {
    if (!tiles.has(heap.id)) tiles.set(heap.id, newTile(heap));
    const tile = tiles.get(heap.id);
    tile.heap = heap;
    caption(tile);
    const shown = byId("heaps").children[place];
    if (shown !== tile.figure) byId("heaps").insertBefore(tile.figure, shown || null);
  });
}

function newTile(heap) {
  const canvas = element("canvas", { role: "img" });
  const words = element("figcaption");
  const figure = element("figure", { class: "tile" }, canvas, words);
  return { heap, canvas, words, figure, view: new View(canvas), phase: "", fraction: 0, drawn: false };
}

function caption(tile) {
  const { heap } = tile;
  let shown = heap.at_rest ? "at rest" : `${tile.phase || "forming"}`;
  if (!heap.at_rest && state.progress.state !== "running") shown = `last seen: ${shown}`;
  if (!heap.at_rest && tile.fraction) shown += `, ${Math.round(100 * tile.fraction)} %`;
  if (typeof heap.angle === "number") shown += `, ${heap.angle.toFixed(1)}°`;
  else if (heap.at_rest) shown += ", no angle";
  const tagged = element("span", { class: heap.at_rest ? "tag rest" : "tag forming" }, shown);
  tile.words.replaceChildren(tagged, element("br"), heap.title);
  tile.words.title = heap.reason || "";
  tile.canvas.setAttribute("aria-label", `Heap of ${heap.title}: ${shown}. Arrow keys turn it.`);
}

async function refreshHeaps() {
  for (const tile of [...tiles.values()]) {
    if (tile.heap.at_rest && tile.drawn) continue;
    if (tile.drawn && state.progress.state !== "running") continue;
    const answer = await fetch(`heap/${tile.heap.id}`, { cache: "no-store" });
    if (!answer.ok) continue; // a case that has ended has no preview any more
    tile.phase = answer.headers.get("X-Phase");
    tile.fraction = Number(answer.headers.get("X-Fraction"));
    tile.view.set(new Float32Array(await answer.arrayBuffer()));
    tile.drawn = true;
    caption(tile);
  }
}

function renderCharts() {
  show("charts-note", state.charts.length === 0);
  const wanted = new Set(state.charts.map((chart) => chart.name));
  for (const [name, chart] of charts) {
    if (!wanted.has(name)) { chart.figure.remove(); charts.delete(name); }
  }
  for (const chart of state.charts) {
    if (!charts.has(chart.name)) {
      const place = element("div", { class: "chart", role: "img" });
      const words = element("figcaption");
      const figure = element("figure", {}, place, words);
      byId("charts").append(figure);
      charts.set(chart.name, { figure, place, words });
    }
    const { place, words } = charts.get(chart.name);
    place.setAttribute("aria-label", chart.caption);
    words.textContent = chart.caption;
    drawChart(place, chart.figure);
  }
}

function renderStages() {
  show("stages-note", state.stages.length === 0);
  if (state.stages.length === shownStages) return; // so that what a person has opened stays open
  shownStages = state.stages.length;
  byId("stages").replaceChildren(...state.stages.map((stage) => {
    const name = stage.name.replaceAll("_", " ");
    const decisions = stage.decisions.map((each) =>
      element("li", {}, each.outcome, " ", element("span", { class: "quiet" }, each.problem)));
    const tables = Object.entries(stage.tables).map(([title, found]) => element("details", {},
      element("summary", {}, `Table: ${title.replaceAll("_", " ")}`),
      table(found.columns, found.data, title.replaceAll("_", " "))));
    return element("div", {}, element("h3", {}, name), element("ul", {}, ...decisions), ...tables);
  }));
}

function renderCases() {
  const { columns, rows, ended, planned } = state.cases;
  const shown = rows.length < ended ? `, the last ${rows.length} are shown` : "";
  byId("cases-note").textContent = ended ? `${ended} of ${planned} planned cases have ended${shown}.`
    : planned ? `${planned} cases are planned, none has ended yet.` : "No case has ended yet.";
  const old = byId("cases").firstElementChild;
  const [down, across] = old ? [old.scrollTop, old.scrollLeft] : [0, 0];
  if (!rows.length) return byId("cases").replaceChildren();
  const made = table(columns, rows.map((row) => row.map((value) => value)), "Cases that have ended");
  byId("cases").replaceChildren(made);
  made.scrollTop = down;
  made.scrollLeft = across;
}

function renderLog() {
  show("log-section", state.log.length > 0);
  const place = byId("log").parentElement;
  const following = place.scrollTop + place.clientHeight >= place.scrollHeight - 8;
  byId("log").replaceChildren(...state.log.map((line) => {
    const when = new Date(1000 * (line.time || 0));
    const clock = element("time", { datetime: when.toISOString() }, when.toLocaleTimeString());
    return element("li", { class: line.level === "info" ? "" : `${line.level}-line` }, clock, number(line.text));
  }));
  if (following) place.scrollTop = place.scrollHeight;
}

darkness.addEventListener("change", () => {
  for (const chart of (state ? state.charts : [])) drawChart(charts.get(chart.name).place, chart.figure);
});
look();
