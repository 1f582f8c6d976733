// Heaps in three dimensions: made of their spheres when a reader asks for them.
const works3d = (() => {
  const canvas = document.createElement("canvas");
  return Boolean(window.WebGLRenderingContext && (canvas.getContext("webgl2") || canvas.getContext("webgl")));
})();
const FINE = 6000; // spheres up to which each has 80 faces; above, 20

/** Return corners and faces of a unit ball: an icosahedron, its faces cut in four `cuts` times. */
function ball(cuts) {
  const t = (1 + Math.sqrt(5)) / 2;
  const corners = [[-1, t, 0], [1, t, 0], [-1, -t, 0], [1, -t, 0], [0, -1, t], [0, 1, t],
    [0, -1, -t], [0, 1, -t], [t, 0, -1], [t, 0, 1], [-t, 0, -1], [-t, 0, 1]].map(unit);
  let faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
    [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9],
    [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]];
  for (let cut = 0; cut < cuts; cut++) {
    const known = new Map();
    const middle = (a, b) => {
      const key = a < b ? `${a} ${b}` : `${b} ${a}`;
      if (!known.has(key)) known.set(key, corners.push(unit(corners[a].map((x, i) => x + corners[b][i]))) - 1);
      return known.get(key);
    };
    faces = faces.flatMap(([a, b, c]) => {
      const [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
      return [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]];
    });
  }
  return { corners, faces };
}

function unit(point) {
  const length = Math.hypot(...point);
  return point.map((x) => x / length);
}

function words(text) {
  const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  return new Uint16Array(bytes.buffer);
}

/** Build the mesh of a packed heap [mm], with the grain and the height of each corner. */
function mesh(heap) {
  const packed = words(heap.spheres), owner = words(heap.grains), count = owner.length;
  const { corners, faces } = ball(count > FINE ? 0 : 1);
  const size = count * corners.length;
  const [x, y, z, grain] = [0, 1, 2, 3].map(() => new Float32Array(size));
  const [i, j, k] = [0, 1, 2].map(() => new Uint32Array(count * faces.length));
  for (let sphere = 0, at = 0, face = 0; sphere < count; sphere++) {
    const center = [0, 1, 2].map((axis) => heap.low[axis] + (packed[4 * sphere + axis] / 65535) * heap.span);
    const radius = (packed[4 * sphere + 3] / 65535) * heap.largest;
    // Neighbouring numbers get colours far apart.
    const color = (owner[sphere] * 0.61803398875) % 1;
    for (const [a, b, c] of faces) {
      [i[face], j[face], k[face]] = [at + a, at + b, at + c];
      face++;
    }
    for (const corner of corners) {
      x[at] = 1000 * (center[0] + radius * corner[0]);
      y[at] = 1000 * (center[1] + radius * corner[1]);
      z[at] = 1000 * (center[2] + radius * corner[2]);
      grain[at] = color;
      at++;
    }
  }
  return { x, y, z, i, j, k, grain };
}

const COLORS = {
  grain: { colorscale: [[0, "#5b3d24"], [0.5, "#a8763f"], [1, "#dcb780"]], cmin: 0, cmax: 1, showscale: false },
  height: { colorscale: "Viridis", showscale: true, cmin: null, cmax: null },
};

/** Draw the heap in place of its picture, with its tools. */
function turn(figure) {
  const heap = JSON.parse(figure.querySelector("script").textContent);
  const { x, y, z, i, j, k, grain } = mesh(heap);
  const reach = Math.max(...[x, y].map((values) => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0)));
  const top = z.reduce((most, value) => Math.max(most, value), 0);
  const place = figure.querySelector(".scene");
  const ink = getComputedStyle(document.documentElement).getPropertyValue("--muted").trim();
  const bar = { title: { text: "height [mm]", font: { color: ink } }, thickness: 10, len: 0.7, x: 0.98, xanchor: "right", tickfont: { color: ink } };
  const lighting = { ambient: 0.45, diffuse: 0.8, specular: 0.08, roughness: 0.9, fresnel: 0 };
  const grains = { type: "mesh3d", x, y, z, i, j, k, intensity: grain, ...COLORS.grain, colorbar: bar,
    hoverinfo: "skip", flatshading: false, lighting, lightposition: { x: 2000, y: -4000, z: 9000 } };
  const plate = { type: "mesh3d", x: [-reach, reach, reach, -reach], y: [-reach, -reach, reach, reach], z: [0, 0, 0, 0],
    i: [0, 0], j: [1, 2], k: [2, 3], color: "#9aa3af", hoverinfo: "skip", lighting: { ambient: 1, diffuse: 0 } };
  const axis = { visible: false, showspikes: false };
  const eye = { x: 0.95, y: -1.15, z: 0.5 };
  const layout = { margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", showlegend: false,
    scene: { xaxis: { ...axis, range: [-reach, reach] }, yaxis: { ...axis, range: [-reach, reach] },
      zaxis: { ...axis, range: [0, top] }, aspectmode: "data", dragmode: "turntable",
      camera: { eye, center: { x: 0, y: 0, z: -0.1 } } } };
  figure.querySelector(".live").hidden = false;
  figure.querySelector(".still").hidden = true;
  Plotly.newPlot(place, [grains, plate], layout, { displayModeBar: false, scrollZoom: true }).then(() => sizes.observe(place));
  place.addEventListener("keydown", (event) => byKey(event, place));
  for (const button of figure.querySelectorAll("[data-color]")) {
    button.addEventListener("click", () => {
      const kind = button.dataset.color;
      const end = kind === "height" ? { cmin: 0, cmax: top } : {};
      const style = { ...COLORS[kind], ...end, colorscale: [COLORS[kind].colorscale] };
      Plotly.restyle(place, { intensity: [kind === "height" ? z : grain], ...style }, [0]);
      figure.querySelectorAll("[data-color]").forEach((one) => one.setAttribute("aria-pressed", String(one === button)));
    });
  }
  for (const button of figure.querySelectorAll("[data-key]")) {
    button.addEventListener("click", () => move(place, button.dataset.key));
  }
  place.focus();
}

function byKey(event, place) {
  if (move(place, event.key)) event.preventDefault();
}

/** Turn or near the camera; tell whether the key means anything. */
function move(place, key) {
  const [around, over, zoom] = { ArrowLeft: [-1, 0, 1], ArrowRight: [1, 0, 1], ArrowUp: [0, 1, 1], ArrowDown: [0, -1, 1],
    "+": [0, 0, 0.85], "-": [0, 0, 1 / 0.85] }[key] ?? [];
  if (around === undefined) return false;
  const camera = place._fullLayout.scene._scene.getCamera();
  const { x, y, z } = camera.eye;
  const far = zoom * Math.hypot(x, y, z);
  const azimuth = Math.atan2(y, x) + (around * Math.PI) / 18;
  const height = Math.min(1.5, Math.max(0.02, Math.asin(z / Math.hypot(x, y, z)) + (over * Math.PI) / 36));
  const flat = far * Math.cos(height);
  const eye = { x: flat * Math.cos(azimuth), y: flat * Math.sin(azimuth), z: far * Math.sin(height) };
  Plotly.relayout(place, { "scene.camera": { ...camera, eye } });
  return true;
}

for (const figure of document.querySelectorAll(".solid")) {
  const button = figure.querySelector(".turn");
  button.hidden = !works3d;
  figure.querySelector(".flat").hidden = works3d;
  button.addEventListener("click", () => turn(figure));
}
