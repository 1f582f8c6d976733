// The page to start from. It asks the server for everything: what the form holds, what a shape gives, what a
// file breaks, which command is called. Nothing is worked out here.
import { ask as request, byId, element, show, table } from "./page.js";
import { View } from "./heap_view.js";

const ask = (what, asked = {}) => request(`api/${what}`, asked);
const value = (id) => byId(id).value.trim();
const chosen = (name) => document.querySelector(`input[name="${name}"]:checked`).value;

const GRAIN = ["grain.density", "grain.shear_modulus", "grain.poisson_ratio", "grain.size_mean", "grain.size_sd"];
const CONTACT = ["wall.density", "wall.shear_modulus", "wall.poisson_ratio", "contact.grain-grain.restitution",
  "contact.grain-wall.restitution", "numerics.modulus_scale", "solver.laws"];
const TARGET = ["target.mean", "target.sd", "target.n"];
const MEASUREMENT = ["measurement.fit", "measurement.azimuths"];
const FACTOR = ["name", "label", "parameter", "low", "high"];
let form = null, clumpFile = "", photoFolder = "";
const views = {};

// ---- fields ------------------------------------------------------------------------------------------------

const found = (document, place) => place.split(".").reduce((at, key) => (at || {})[key], document);

const PLAIN = ["grain", "scene", "target", "measurement", "numerics", "solver"];

function field(place, initial, hint = "") {
  const id = `field-${place}`, keys = place.split(".");
  const label = keys.slice(PLAIN.includes(keys[0]) ? -1 : -2).join(" ").replaceAll("_", " ");
  const words = element("label", { for: id }, label);
  if (hint) words.append(" ", element("span", { class: "hint" }, hint.replaceAll("`", "")));
  const input = element("input", { type: "text", id, "data-place": place });
  input.value = initial ?? "";
  return element("div", {}, words, input);
}

function fill(id, places) {
  byId(id).replaceChildren(...places.map((place) =>
    field(place, found(form.template, place), form.meanings[place] || "")));
}

function fillTest() {
  const test = value("test"), first = [], further = [];
  for (const row of form.tests[test]) {
    const place = `scene.${test}.${row.key}`, initial = found(form.template, place);
    const left = row.default ? ` Default: ${row.default}.` : "";
    const made = field(place, initial, `${row.meaning}${left}`);
    (initial !== undefined || row.required ? first : further).push(made);
  }
  byId("test-fields").replaceChildren(...first);
  byId("test-further").replaceChildren(...further);
}

function addFactor(factor = {}) {
  const inputs = FACTOR.map((key) => {
    const input = element("input", { type: "text", "data-key": key, "aria-label": `${key} of the factor` });
    input.value = factor[key] ?? "";
    return element("div", {}, element("span", { class: "hint", "aria-hidden": "true" }, key), input);
  });
  const row = element("div", { class: "row factor" }, ...inputs);
  row.append(element("button", { type: "button", onclick: () => row.remove() }, "Remove"));
  byId("factors").append(row);
}

const factors = () => [...document.querySelectorAll(".factor")].map((row) =>
  Object.fromEntries([...row.querySelectorAll("input")].map((input) => [input.dataset.key, input.value])));

// What was written, by its place in a study file.
function values() {
  const hidden = chosen("target") === "pictures" ? TARGET : [];
  const inputs = [...document.querySelectorAll("[data-place]")];
  const all = Object.fromEntries(inputs.map((input) => [input.dataset.place, input.value]));
  for (const place of hidden) delete all[place];
  if (chosen("shape") === "sphere") all["grain.sphere"] = value("sphere");
  else all["grain.clump"] = clumpFile;
  if (chosen("target") === "pictures") all["target.pictures"] = photoFolder;
  if (chosen("target") === "pictures" && value("test") === "drum") all["target.observable"] = "dynamic_angle";
  return all;
}

// ---- what goes wrong ---------------------------------------------------------------------------------------

async function attempt(place, button, work) {
  show(place, false);
  if (button) button.disabled = true;
  try {
    return await work();
  } catch (error) {
    byId(place).textContent = error.message;
    show(place, true);
    return null;
  } finally {
    if (button) button.disabled = false;
  }
}

// ---- grain -------------------------------------------------------------------------------------------------

function clumpAsked(source) {
  return { source, unit: chosen("shape") === "file" ? value("unit") : "", spheres: value("tolerance") ? "" : value("spheres"),
    tolerance: value("tolerance"), protrusion: value("protrusion") };
}

async function source() {
  if (chosen("shape") === "sphere") return `sphere:${2 * parseFloat(value("sphere"))}`;
  if (chosen("shape") === "solid") return `${value("solid")}:${value("sizes")}`;
  const [file] = byId("mesh").files;
  if (!file) throw new Error("Choose a file first.");
  return (await request(`upload/${encodeURIComponent(file.name)}`, file)).file;
}

async function preview(out = "") {
  const asked = { source: await source(), out };
  if (chosen("shape") === "sphere") asked.spheres = "1";
  else Object.assign(asked, clumpAsked(asked.source), { out });
  const density = document.querySelector('[data-place="grain.density"]').value;
  const made = await ask("clump", { ...asked, density: out ? "" : density });
  show("grain", true);
  show("solid-tile", made.faces.length > 0);
  views.solid = views.solid || new View(byId("solid-view"), { plate: false, elevation: 0.4 });
  views.clump = views.clump || new View(byId("clump-view"), { plate: false, elevation: 0.4 });
  views.solid.set(new Float32Array(), new Float32Array(made.faces));
  views.clump.set(new Float32Array(made.spheres));
  const { facts } = made;
  const parts = [`${facts.sphere_count} ${facts.sphere_count === 1 ? "sphere" : "spheres"}`,
    `volume ${facts.volume_mm3.toFixed(2)} mm³`, facts.mass_mg && `mass ${facts.mass_mg.toFixed(2)} mg`,
    facts.coverage && `covers ${(100 * facts.coverage).toFixed(1)} % of the solid`];
  byId("clump-words").textContent = parts.filter(Boolean).join(", ");
  byId("clump-advice").textContent = [made.description, made.advice].filter(Boolean).join(" ");
  show("clump-advice", Boolean(made.description || made.advice));
  byId("clump-command").textContent = made.command;
  return made;
}

// ---- photographs -------------------------------------------------------------------------------------------

async function measure() {
  const files = [...byId("photos").files];
  if (!files.length) throw new Error("Choose photographs first.");
  const folder = `${value("name")}-photos`;
  for (const file of files) {
    await request(`upload/${encodeURIComponent(folder)}/${encodeURIComponent(file.name)}`, file);
  }
  const fit = document.querySelector('[data-place="measurement.fit"]').value;
  const drum = value("test") === "drum";
  const measured = await ask("angles", { folder, fit, test: value("test") });
  photoFolder = folder;
  const columns = drum ? ["picture", "mean", "se", "upper_angle", "lower_angle", "filling"] : ["picture", "left", "right", "mean", "se"];
  const rows = measured.rows.map((row) => [...columns.map((name) => row[name]), [row.reason, ...row.doubts].filter(Boolean).join("; ")]);
  const heads = [...columns.map((name) => name.replace("_", " ")), "doubts"];
  byId("angles").replaceChildren(table(heads, rows, "Measured photographs"));
  byId("angles-mean").textContent = measured.mean;
  byId("angles-command").textContent = measured.command;
  show("angles-command", true);
}

// ---- study file --------------------------------------------------------------------------------------------

function showCheck(check) {
  const doubts = [check.note, check.doubtful && `Doubtful: ${check.doubtful}`].filter(Boolean).join(" ");
  byId("draft-note").textContent = check.error ? "" : doubts || "The file keeps every rule.";
  show("draft-note", !check.error);
  byId("draft-error").textContent = check.error || "";
  show("draft-error", Boolean(check.error));
}

async function draft() {
  if (chosen("shape") !== "sphere") {
    const name = `${value("name")}-clump.txt`;
    if (clumpFile !== name) await preview(name);
    clumpFile = name;
  }
  if (chosen("target") === "pictures" && !photoFolder) await measure();
  // a draft with an error is shown too, with its error
  const answer = await fetch("api/draft", { method: "POST", headers: { "X-Dem-Warp": "1" },
    body: JSON.stringify({ name: value("name"), values: values(), factors: factors() }) });
  const drafted = await answer.json();
  if (drafted.text) {
    byId("text").value = drafted.text;
    byId("draft-file").textContent = `${drafted.file}; you may change it here by hand`;
    byId("text").dataset.file = drafted.file;
  }
  showCheck(drafted);
}

const textAsked = () => ({ file: byId("text").dataset.file || `${value("name")}.toml`, text: byId("text").value });

async function write() {
  const { file } = await ask("write", textAsked());
  byId("written").textContent = `Wrote ${file}.`;
  await refreshForm();
  byId("study").value = file;
  await plan();
}

// ---- runs --------------------------------------------------------------------------------------------------

const runAsked = () => ({ command: value("command"), file: value("study"), scale: value("scale"),
  device: value("device"), out: value("out"), measured: value("measured") });

async function plan() {
  show("measured-field", value("command") === "discover");
  // A click on Start ends the change of a field, which asks for this plan: Start stays enabled, and where it is
  let command = "";
  if (value("study")) await attempt("run-error", null, async () => ({ command } = await ask("plan", runAsked())));
  byId("run-command").textContent = command;
}

async function start() {
  if (!value("study")) throw new Error("Write the study file first.");
  await ask("start", runAsked());
  await refreshRuns();
}

function runItem(run) {
  const base = `run/${run.folder.split("/").map(encodeURIComponent).join("/")}/-/`;
  const links = [element("a", { href: base, target: "_blank", rel: "noopener" }, "Watch"),
    ...run.outputs.map((name) => element("a", { href: `${base}file/${name}`, target: "_blank", rel: "noopener" },
      name === "report.html" ? "Report" : name))];
  const buttons = [];
  const act = (what) => async () => { await ask(what, { folder: run.folder }); await refreshRuns(); };
  if (run.running) buttons.push(element("button", { type: "button", onclick: act("stop") }, "Stop"));
  else if (run.code) buttons.push(element("button", { type: "button", onclick: act("resume") }, "Resume"));
  const status = [run.left && `${run.left} left.`, run.message].filter(Boolean).join(" ");
  const messages = run.code && run.messages ? element("p", { class: "error" }, run.messages.trim()) : null;
  return element("li", { "data-folder": run.folder },
    element("p", {}, element("span", { class: `badge ${run.state}` }, run.state), " ",
      element("strong", {}, run.folder), " ", status),
    run.command ? element("p", {}, element("code", { class: "command" }, run.command)) : null,
    messages, element("div", { class: "row" }, element("span", { class: "links" }, ...links), ...buttons));
}

let shownRuns = "";
async function refreshRuns() {
  const runs = await ask("runs");
  const text = JSON.stringify(runs);
  if (text === shownRuns) return; // so that a focus stays where it is
  shownRuns = text;
  show("runs-note", runs.length === 0);
  byId("runs").replaceChildren(...runs.map(runItem));
}

async function keepRefreshing() {
  try {
    await refreshRuns();
  } catch (error) {
    if (!(error instanceof TypeError)) throw error;
  } finally {
    setTimeout(keepRefreshing, 2000);
  }
}

// ---- the page ----------------------------------------------------------------------------------------------

function options(id, names, none) {
  const before = byId(id).value;
  byId(id).replaceChildren(...(none === undefined ? [] : [element("option", { value: "" }, none)]),
    ...names.map((name) => element("option", { value: name }, name)));
  if (names.includes(before)) byId(id).value = before;
}

async function refreshForm() {
  form = await ask("form");
  byId("folder").textContent = form.folder;
  options("study", form.studies);
  options("measured", form.measured, "no file: only make the bank");
}

function choose() {
  const shape = chosen("shape"), target = chosen("target");
  for (const name of ["sphere", "solid", "file"]) show(`shape-${name}`, shape === name);
  show("filling", shape !== "sphere");
  show("target-numbers", target === "numbers");
  show("target-pictures", target === "pictures");
  byId("sizes-hint").textContent = byId("solid").selectedOptions[0].dataset.sizes;
}

await refreshForm();
options("test", Object.keys(form.tests));
byId("test").value = "lifted-cylinder";
fill("grain-fields", GRAIN);
fill("contact-fields", CONTACT);
fill("target-numbers", TARGET);
fill("measurement-fields", MEASUREMENT);
fillTest();
form.template.factor.forEach(addFactor);
choose();
byId("form").addEventListener("submit", (event) => event.preventDefault());
byId("form").addEventListener("change", (event) => {
  if (event.target.name === "shape" || event.target.name === "target" || event.target.id === "solid") choose();
  if (event.target.id === "test") fillTest();
  if (["mesh", "unit", "solid", "sizes", "spheres", "tolerance", "protrusion", "name"].includes(event.target.id)) clumpFile = "";
  if (["photos", "name"].includes(event.target.id)) photoFolder = "";
  if (["study", "command", "scale", "device", "out", "measured"].includes(event.target.id)) plan();
});
const onClick = (id, place, work) => byId(id).addEventListener("click", () => attempt(place, byId(id), work));
onClick("preview", "clump-error", () => preview());
onClick("measure", "angles-error", measure);
onClick("draft", "draft-error", draft);
onClick("check", "draft-error", async () => showCheck(await ask("check", textAsked())));
onClick("write", "draft-error", write);
onClick("start", "run-error", start);
byId("add-factor").addEventListener("click", () => addFactor());
await plan();
keepRefreshing();
document.documentElement.dataset.ready = "yes";
