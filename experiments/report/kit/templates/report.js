"use strict";
const options = { displayModeBar: false, scrollZoom: false };
const places = [];
// Charts follow their place: a turned phone, a narrower window.
const sizes = new ResizeObserver((changes) => changes.forEach((change) => Plotly.Plots.resize(change.target)));
for (const source of document.querySelectorAll("script[data-plot]")) {
  const place = document.getElementById(source.dataset.plot);
  const figure = JSON.parse(source.textContent);
  Plotly.newPlot(place, figure.data, figure.layout, options).then(() => sizes.observe(place));
  places.push(place);
}
// Browsers lay out paper after this event and tell no observer: the sizes are those of the print style on A4.
window.addEventListener("beforeprint", () => {
  for (const place of places) {
    const width = place.closest(".grid") ? 320 : 660;
    const height = place.closest(".tall") ? 340 : place.closest(".low") ? 220 : 300;
    Plotly.relayout(place, { width, height });
  }
});
window.addEventListener("afterprint", () => places.forEach((place) => Plotly.Plots.resize(place)));
if (window.matchMedia("(max-width: 75rem)").matches) {
  document.querySelector(".contents details").removeAttribute("open");
}
