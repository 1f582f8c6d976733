"use strict";
const options = { displayModeBar: false, scrollZoom: false };
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const inDark = JSON.parse(document.getElementById("dark-colors").textContent);
let onPaper = false;

/** Return a copy of a figure's part in the colours of the page; paper is always light. */
function themed(part) {
  if (Array.isArray(part)) return part.map(themed);
  if (part && typeof part === "object") {
    return Object.fromEntries(Object.entries(part).map(([key, value]) => [key, themed(value)]));
  }
  return typeof part === "string" && dark.matches && !onPaper ? darkColor(part) : part;
}

function darkColor(text) {
  const [, red, green, blue, opacity] = text.match(/^rgba\((\d+), ?(\d+), ?(\d+), ?([\d.]+)\)$/) ?? [];
  if (red === undefined) return inDark[text.toLowerCase()] ?? text;
  const hex = (number) => Number(number).toString(16).padStart(2, "0");
  const found = inDark[`#${hex(red)}${hex(green)}${hex(blue)}`];
  if (!found) return text;
  const parts = [1, 3, 5].map((at) => parseInt(found.slice(at, at + 2), 16));
  return `rgba(${parts.join(",")},${opacity})`;
}

const charts = [...document.querySelectorAll("script[data-plot]")].map((source) => ({
  place: document.getElementById(source.dataset.plot),
  figure: JSON.parse(source.textContent),
}));
// Charts follow their place: a turned phone, a narrower window.
const sizes = new ResizeObserver((changes) => changes.forEach(({ target }) => Plotly.Plots.resize(target)));

const NARROW = 480; // pixels of a chart below which its long names are broken into lines
const BROKEN = 16; // letters of a line then

/** Break a text between its words. */
function broken(text) {
  if (typeof text !== "string" || text.length <= BROKEN || text.includes("<")) return text;
  return text.split(" ").reduce((lines, word) => {
    const last = lines.at(-1);
    if (last !== undefined && last.length + word.length < BROKEN) lines[lines.length - 1] = `${last} ${word}`;
    else lines.push(word);
    return lines;
  }, []).join("<br>");
}

/** Break the names along the axes of a figure, and their titles, in place. */
function breakNames({ data, layout }) {
  for (const trace of data) {
    for (const axis of ["x", "y"]) if (Array.isArray(trace[axis])) trace[axis] = trace[axis].map(broken);
  }
  for (const axis of [layout.xaxis, layout.yaxis]) {
    for (const names of ["categoryarray", "ticktext"]) if (axis?.[names]) axis[names] = axis[names].map(broken);
    if (axis?.title?.text) axis.title.text = broken(axis.title.text);
  }
}

function draw({ place, figure }, size = {}) {
  const shown = { data: themed(figure.data), layout: { ...themed(figure.layout), ...size } };
  if ((size.width ?? place.clientWidth) < NARROW) breakNames(shown);
  return Plotly.react(place, shown.data, shown.layout, options);
}

// A chart is drawn when it comes near the window: a phone need not draw all of them to show the first.
const near = new IntersectionObserver((seen) => {
  for (const { isIntersecting, target } of seen) {
    if (!isIntersecting) continue;
    near.unobserve(target);
    draw(charts.find(({ place }) => place === target)).then(() => sizes.observe(target));
  }
}, { rootMargin: "600px" });
const drawn = () => charts.filter(({ place }) => place.data);

charts.forEach(({ place }) => near.observe(place));
dark.addEventListener("change", () => drawn().forEach((chart) => draw(chart)));

// Browsers lay out paper after this event and tell no observer: the sizes are those of the print style on A4.
window.addEventListener("beforeprint", () => {
  onPaper = true;
  for (const details of document.querySelectorAll("details:not([open])")) {
    details.open = true;
    details.dataset.closed = "";
  }
  for (const chart of charts) {
    const width = chart.place.closest(".grid") ? 320 : 660;
    const height = chart.place.closest(".tall") ? 310 : chart.place.closest(".low") ? 210 : 270;
    draw(chart, { width, height });
  }
});
window.addEventListener("afterprint", () => {
  onPaper = false;
  for (const details of document.querySelectorAll("details[data-closed]")) {
    details.open = false;
    delete details.dataset.closed;
  }
  drawn().forEach((chart) => draw(chart).then(() => Plotly.Plots.resize(chart.place)));
});
if (window.matchMedia("(max-width: 75rem)").matches) {
  document.querySelector(".contents details").removeAttribute("open");
}

/** Mark a box that holds something wider, and the sides at which it goes on. */
function mark(box) {
  const hidden = box.scrollWidth - box.clientWidth;
  box.classList.toggle("wide", hidden > 1);
  box.classList.toggle("more-left", hidden > 1 && box.scrollLeft > 1);
  box.classList.toggle("more-right", hidden > 1 && box.scrollLeft < hidden - 1);
  // Only what scrolls is a stop of the Tab key.
  if (hidden > 1) box.tabIndex = 0;
  else box.removeAttribute("tabindex");
}
const widths = new ResizeObserver((changes) => changes.forEach(({ target }) => mark(target)));
for (const box of document.querySelectorAll(".table, .sweep")) {
  widths.observe(box);
  box.addEventListener("scroll", () => mark(box), { passive: true });
}

for (const button of document.querySelectorAll("button[data-copy]")) {
  const source = document.getElementById(button.dataset.copy);
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(source.textContent);
    } catch {
      // Pages from a disk may lack the clipboard; a selection always works.
      window.getSelection().selectAllChildren(source);
      document.execCommand("copy");
    }
    const label = button.textContent;
    button.textContent = "Copied";
    window.setTimeout(() => (button.textContent = label), 2000);
  });
}
