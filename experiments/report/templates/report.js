"use strict";
const options = { responsive: true, displayModeBar: false, scrollZoom: false };
const plots = Array.from(document.querySelectorAll("script[data-plot]"), (source) => {
  const place = document.getElementById(source.dataset.plot);
  const figure = JSON.parse(source.textContent);
  Plotly.newPlot(place, figure.data, figure.layout, options);
  return place;
});
// Paper is narrower than a screen, and charts do not follow by themselves.
for (const event of ["beforeprint", "afterprint"]) {
  window.addEventListener(event, () => plots.forEach((place) => Plotly.Plots.resize(place)));
}
if (window.matchMedia("(max-width: 75rem)").matches) {
  document.querySelector(".contents details").removeAttribute("open");
}
