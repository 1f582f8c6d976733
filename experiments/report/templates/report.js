"use strict";
const options = { displayModeBar: false, scrollZoom: false };
// Charts follow their place: a turned phone, a narrower window, a sheet of paper.
const sizes = new ResizeObserver((changes) => changes.forEach((change) => Plotly.Plots.resize(change.target)));
for (const source of document.querySelectorAll("script[data-plot]")) {
  const place = document.getElementById(source.dataset.plot);
  const figure = JSON.parse(source.textContent);
  Plotly.newPlot(place, figure.data, figure.layout, options).then(() => sizes.observe(place));
}
if (window.matchMedia("(max-width: 75rem)").matches) {
  document.querySelector(".contents details").removeAttribute("open");
}
