// Heaps of the report to be turned: unpacked from 16 bits when a reader asks for them.
function words(text) {
  return new Uint16Array(Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0)).buffer);
}

// Rows of x, y, z, radius [mm] and the number of the grain.
function unpacked(heap) {
  const packed = words(heap.spheres), owner = words(heap.grains);
  const rows = new Float32Array(STRIDE * owner.length);
  owner.forEach((grain, i) => {
    const center = [0, 1, 2].map((axis) => 1000 * (heap.low[axis] + (packed[4 * i + axis] / 65535) * heap.span));
    rows.set([...center, (1000 * packed[4 * i + 3] * heap.largest) / 65535, grain], STRIDE * i);
  });
  return rows;
}

function turn(figure) {
  figure.querySelector(".live").hidden = false;
  figure.querySelector(".still").hidden = true;
  const canvas = figure.querySelector(".scene");
  const view = new View(canvas, { elevation: 0.3 });
  view.set(unpacked(JSON.parse(figure.querySelector("script").textContent)));
  const scale = figure.querySelector(".scale");
  scale.textContent = `dark: 0 mm, bright: ${view.reach.high[2].toPrecision(2)} mm`;
  for (const button of figure.querySelectorAll("[data-color]")) {
    button.addEventListener("click", () => {
      view.byHeight = button.dataset.color === "height";
      scale.hidden = !view.byHeight;
      figure.querySelectorAll("[data-color]").forEach((one) => one.setAttribute("aria-pressed", String(one === button)));
      view.draw();
    });
  }
  for (const button of figure.querySelectorAll("[data-key]")) {
    button.addEventListener("click", () => view.move(button.dataset.key));
  }
  canvas.focus();
}

for (const figure of document.querySelectorAll(".solid")) {
  const button = figure.querySelector(".turn");
  button.hidden = false;
  button.addEventListener("click", () => turn(figure));
}
