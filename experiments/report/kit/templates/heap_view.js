// Spheres on a canvas, seen from any side: drawn from the farthest to the nearest, each a shaded disc.

const STRIDE = 5; // x, y, z, radius, number of the grain
const SPRITE = 64;
const TONES = ["#c99a5b", "#d3a76c", "#bd8c4c", "#dab27c", "#b98a50", "#cfa063"];
const HEIGHTS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];

function sprite(tone) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SPRITE;
  const context = canvas.getContext("2d");
  const half = SPRITE / 2;
  context.beginPath();
  context.arc(half, half, half - 0.5, 0, 2 * Math.PI);
  context.fillStyle = tone;
  context.fill();
  const light = context.createRadialGradient(0.7 * half, 0.6 * half, 0.1 * half, half, half, half);
  light.addColorStop(0, "rgba(255,255,255,0.45)");
  light.addColorStop(0.45, "rgba(255,255,255,0)");
  light.addColorStop(1, "rgba(40,22,0,0.6)");
  context.fillStyle = light;
  context.fill();
  return canvas;
}

const sprites = new Map();

function spriteOf(tone) {
  if (!sprites.has(tone)) sprites.set(tone, sprite(tone));
  return sprites.get(tone);
}

function extent(spheres) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < spheres.length; i += STRIDE) {
    for (let axis = 0; axis < 3; axis += 1) {
      low[axis] = Math.min(low[axis], spheres[i + axis] - spheres[i + 3]);
      high[axis] = Math.max(high[axis], spheres[i + axis] + spheres[i + 3]);
    }
  }
  return { low, high };
}

// A view of spheres, or of a surface, that a finger, a mouse or the arrow keys turn; + and - zoom it.
export class View {
  constructor(canvas, { plate = true, elevation = 0.18 } = {}) {
    this.canvas = canvas;
    this.plate = plate;
    this.azimuth = 0.6;
    this.elevation = elevation;
    this.zoom = 1;
    this.byHeight = false;
    this.spheres = new Float32Array();
    this.faces = null;
    this.reach = null;
    canvas.tabIndex = 0;
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener("keydown", (event) => { if (this.move(event.key)) event.preventDefault(); });
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return; // the page scrolls
      event.preventDefault();
      this.move(event.deltaY < 0 ? "+" : "-");
    }, { passive: false });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // Spheres as rows of five numbers, and triangles as rows of nine; lengths are free.
  set(spheres, faces = null) {
    this.spheres = spheres;
    this.faces = faces && faces.length ? faces : null;
    const points = spheres.length ? spheres : this.corners();
    if (points.length) {
      const { low, high } = extent(points);
      if (this.reach && this.plate) {
        // a heap that forms is shown at one scale
        low.forEach((value, axis) => { low[axis] = Math.min(value, this.reach.low[axis]); });
        high.forEach((value, axis) => { high[axis] = Math.max(value, this.reach.high[axis]); });
      }
      if (this.plate) low[2] = Math.min(low[2], 0);
      this.reach = { low, high };
    }
    this.draw();
  }

  corners() {
    const rows = new Float32Array((this.faces ? this.faces.length / 3 : 0) * STRIDE);
    for (let i = 0; i < rows.length / STRIDE; i += 1) rows.set(this.faces.slice(3 * i, 3 * i + 3), STRIDE * i);
    return rows;
  }

  grab(event) {
    const start = { x: event.clientX, y: event.clientY, azimuth: this.azimuth, elevation: this.elevation };
    const turn = (move) => {
      this.azimuth = start.azimuth + 0.01 * (move.clientX - start.x);
      if (event.pointerType === "mouse") this.tilt(start.elevation + 0.01 * (move.clientY - start.y));
      this.draw();
    };
    const end = () => {
      removeEventListener("pointermove", turn);
      removeEventListener("pointerup", end);
      removeEventListener("pointercancel", end);
    };
    addEventListener("pointermove", turn);
    addEventListener("pointerup", end);
    addEventListener("pointercancel", end);
  }

  // Turn or zoom by a key; return false where it means nothing.
  move(key) {
    const turns = { ArrowLeft: [-0.15, 0, 1], ArrowRight: [0.15, 0, 1], ArrowUp: [0, 0.1, 1], ArrowDown: [0, -0.1, 1],
      "+": [0, 0, 1.15], "-": [0, 0, 1 / 1.15] };
    const turn = turns[key];
    if (!turn) return false;
    this.azimuth += turn[0];
    this.tilt(this.elevation + turn[1]);
    this.zoom = Math.min(Math.max(this.zoom * turn[2], 0.3), 10);
    this.draw();
    return true;
  }

  tilt(elevation) {
    this.elevation = Math.min(Math.max(elevation, this.plate ? 0 : -1.5), 1.5);
  }

  // Function from a point to its place on the canvas and its depth.
  projection(width, height) {
    const { low, high } = this.reach;
    const middle = low.map((value, axis) => 0.5 * (value + high[axis]));
    const across = Math.hypot(high[0] - low[0], high[1] - low[1]);
    const tall = (high[2] - low[2]) * Math.cos(this.elevation) + across * Math.abs(Math.sin(this.elevation));
    const scale = 0.9 * this.zoom * Math.min(width / across, height / tall);
    const [ca, sa, ce, se] = [
      Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    const place = (x, y, z) => {
      const [px, py, pz] = [x - middle[0], y - middle[1], z - middle[2]];
      const [right, into] = [ca * px + sa * py, ca * py - sa * px];
      return [width / 2 + scale * right, height / 2 - scale * (ce * pz + se * into), ce * into - se * pz];
    };
    return { place, scale, middle, across };
  }

  draw() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(this.canvas.clientWidth * ratio);
    const height = Math.round(this.canvas.clientHeight * ratio);
    if (!width || !height || !this.reach) return;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    const context = this.canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const seen = this.projection(width, height);
    if (this.plate) this.drawPlate(context, seen);
    if (this.faces) this.drawFaces(context, seen);
    if (this.spheres.length) this.drawSpheres(context, seen);
  }

  drawPlate(context, { place, middle, across }) {
    context.beginPath();
    for (let i = 0; i <= 64; i += 1) {
      const angle = (2 * Math.PI * i) / 64;
      const [x, y] = place(middle[0] + 0.55 * across * Math.cos(angle), middle[1] + 0.55 * across * Math.sin(angle), 0);
      if (i) context.lineTo(x, y); else context.moveTo(x, y);
    }
    context.fillStyle = "rgba(128,140,155,0.18)";
    context.strokeStyle = "rgba(128,140,155,0.8)";
    context.fill();
    context.stroke();
  }

  drawSpheres(context, { place, scale }) {
    const count = this.spheres.length / STRIDE;
    const places = new Float32Array(3 * count);
    for (let i = 0; i < count; i += 1) {
      const at = STRIDE * i;
      places.set(place(this.spheres[at], this.spheres[at + 1], this.spheres[at + 2]), 3 * i);
    }
    const order = Array.from({ length: count }, (_, i) => i).sort((a, b) => places[3 * b + 2] - places[3 * a + 2]);
    for (const i of order) {
      const radius = scale * this.spheres[STRIDE * i + 3];
      const tone = this.byHeight
        ? HEIGHTS[Math.min(Math.max(Math.floor((HEIGHTS.length * this.spheres[STRIDE * i + 2]) / this.reach.high[2]), 0), HEIGHTS.length - 1)]
        : TONES[Math.abs(Math.round(this.spheres[STRIDE * i + 4])) % TONES.length];
      context.drawImage(spriteOf(tone), places[3 * i] - radius, places[3 * i + 1] - radius, 2 * radius, 2 * radius);
    }
  }

  drawFaces(context, { place }) {
    const drawn = [];
    for (let i = 0; i + 8 < this.faces.length; i += 9) {
      const [a, b, c] = [0, 3, 6].map((k) => place(this.faces[i + k], this.faces[i + k + 1], this.faces[i + k + 2]));
      const turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      if (turn < 0) drawn.push({ corners: [a, b, c], depth: a[2] + b[2] + c[2] });
    }
    drawn.sort((a, b) => b.depth - a.depth);
    for (const { corners } of drawn) {
      const [a, b, c] = corners;
      const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
      const unit = this.projectionScale(u, v);
      const bright = Math.round(95 + 130 * unit);
      context.beginPath();
      corners.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.closePath();
      context.fillStyle = context.strokeStyle = `rgb(${bright}, ${Math.round(0.83 * bright)}, ${Math.round(0.6 * bright)})`;
      context.fill();
      context.stroke();
    }
  }

  // How much a face looks at us, 0 to 1; depth is in metres, so that it is scaled to pixels first.
  projectionScale(u, v) {
    const { scale } = this.projection(this.canvas.width, this.canvas.height);
    const [uz, vz] = [u[2] * scale, v[2] * scale];
    const normal = [u[1] * vz - uz * v[1], uz * v[0] - u[0] * vz, u[0] * v[1] - u[1] * v[0]];
    return Math.abs(normal[2]) / (Math.hypot(...normal) || 1);
  }
}
