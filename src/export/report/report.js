// The two views of the page and their controls.
"use strict";

const LAYERS = ["board", "log-scale", "angle-error", "distance", "patches", "field"];

// Column-major matrices.
const multiply = (a, b) => {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) {
    for (let r = 0; r < 4; r++) {
      for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  }
  return out;
};

// A rotation about an axis of the screen, then what was before.
function turned(rotation, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const step = axis === 0 ? [1, 0, 0, 0, c, s, 0, -s, c]
    : axis === 1 ? [c, 0, -s, 0, 1, 0, s, 0, c]
    : [c, s, 0, -s, c, 0, 0, 0, 1];
  const out = new Float32Array(9);
  for (let col = 0; col < 3; col++) {
    for (let r = 0; r < 3; r++) {
      for (let k = 0; k < 3; k++) out[3 * col + r] += step[3 * k + r] * rotation[3 * col + k];
    }
  }
  return out;
}

function startRotation() {
  const none = new Float32Array([1, 0, 0, 0, 1, 0, 0, 0, 1]);
  return turned(turned(none, 1, -0.6), 0, 0.35);
}

// A colour of the style sheet as red, green, blue from 0 to 1.
function inkOf(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
}

function palette() {
  const solid = (name) => [...inkOf(name), 1];
  return {
    border: solid("--border-line"),
    ink: solid("--ink"),
    halo: solid("--halo"),
    cut: solid("--cut"),
    feature: solid("--feature"),
    positive: inkOf("--positive"),
    negative: inkOf("--negative"),
  };
}

// One canvas with what it shows and how it is moved.
class View {
  constructor(page, canvas, space) {
    this.page = page;
    this.canvas = canvas;
    this.target = canvas.getContext("2d");
    this.space = space;
    this.pointers = new Map();
    this.reset();
    canvas.addEventListener("pointerdown", (e) => this.press(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (e) => this.pointers.delete(e.pointerId));
    }
    canvas.addEventListener("pointerleave", () => page.say(this, -1, null));
    canvas.addEventListener("keydown", (e) => this.key(e));
    canvas.addEventListener("wheel", (e) => {
      // The page scrolls until the canvas has been clicked.
      if (document.activeElement !== canvas && !e.ctrlKey) return;
      e.preventDefault();
      this.zoom(Math.exp(-e.deltaY * 0.0015), this.place(e));
    }, { passive: false });
    new ResizeObserver(() => page.redraw()).observe(canvas);
  }

  reset() {
    this.rotation = startRotation();
    this.scale = 1;
    this.shift = [0, 0];
  }

  // Where an event is: −1 to 1, up.
  place(e) {
    const box = this.canvas.getBoundingClientRect();
    return [((e.clientX - box.left) / box.width) * 2 - 1, 1 - ((e.clientY - box.top) / box.height) * 2];
  }

  zoom(factor, at = [0, 0]) {
    const scale = Math.min(400, Math.max(0.4, this.scale * factor));
    const real = scale / this.scale;
    this.shift = this.shift.map((s, i) => at[i] + (s - at[i]) * real);
    this.scale = scale;
    this.page.redraw();
  }

  press(e) {
    this.canvas.focus();
    this.canvas.setPointerCapture(e.pointerId);
    this.pointers.set(e.pointerId, this.place(e));
    this.read(this.place(e));
  }

  move(e) {
    const at = this.place(e);
    const before = this.pointers.get(e.pointerId);
    if (!before) {
      this.asked = at;
      this.page.redraw(false);
      return;
    }
    const others = [...this.pointers].filter(([id]) => id !== e.pointerId);
    this.pointers.set(e.pointerId, at);
    const d = at.map((x, i) => x - before[i]);
    if (others.length > 0) {
      const other = others[0][1];
      const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1e-3;
      this.shift = this.shift.map((s, i) => s + d[i] / 2);
      this.zoom(apart(at) / apart(before), at.map((x, i) => (x + other[i]) / 2));
    } else if (this.space > 0 || e.shiftKey || e.buttons === 2) {
      this.pan(d[0], d[1]);
    } else {
      this.rotation = turned(turned(this.rotation, 1, d[0] * 2.5), 0, -d[1] * 2.5);
      this.page.redraw();
    }
  }

  pan(x, y) {
    this.shift = [this.shift[0] + x, this.shift[1] + y];
    this.page.redraw();
  }

  key(e) {
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const arrow = arrows[e.key];
    if (arrow && (this.space > 0 || e.shiftKey)) this.pan(arrow[0] * -0.1, arrow[1] * -0.1);
    else if (arrow) {
      this.rotation = turned(turned(this.rotation, 1, arrow[0] * 0.15), 0, -arrow[1] * 0.15);
      this.page.redraw();
    } else if (e.key === "+" || e.key === "=") this.zoom(1.25);
    else if (e.key === "-") this.zoom(0.8);
    else if (e.key === "0") {
      this.reset();
      this.page.redraw();
    } else if (e.key === "Enter") this.read([0, 0]);
    else return;
    e.preventDefault();
  }

  // What the surface is drawn with.
  now() {
    const { width, height } = this.canvas;
    const [sx, sy] = width < height ? [1, width / height] : [height / width, 1];
    const k = this.scale * (this.space === 0 ? 0.72 : 0.96);
    const fit = new Float32Array([k * sx, 0, 0, 0, 0, k * sy, 0, 0, 0, 0, -0.25, 0, ...this.shift, 0, 1]);
    const r = this.rotation;
    const spin = this.space === 0
      ? new Float32Array([r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6], r[7], r[8], 0, 0, 0, 0, 1])
      : new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    return { matrix: multiply(fit, spin), turn: r, space: this.space, ratio: this.ratio, ...this.page.chosen() };
  }

  draw(surface) {
    this.ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * this.ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * this.ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    surface.draw(this.now(), this.target, this.page.palette);
  }

  read(at) {
    const { surface } = this.page;
    if (!surface) return;
    const [view, { width, height }] = [this.now(), this.canvas];
    const reach = 12 * (this.ratio || 1);
    this.page.say(
      this,
      surface.faceAt(view, at[0], at[1], width, height),
      view.cones ? surface.coneAt(view, at[0], at[1], width, height, reach) : null,
    );
  }
}

class Page {
  constructor(meta) {
    this.meta = meta;
    this.palette = palette();
    this.form = document.getElementById("layers");
    this.views = [
      new View(this, document.getElementById("view-space"), 0),
      new View(this, document.getElementById("view-plane"), 2),
    ];
    this.form.addEventListener("change", () => this.redraw());
    this.form.addEventListener("submit", (e) => e.preventDefault());
    for (const input of document.querySelectorAll('input[name="plane"]')) {
      input.addEventListener("change", () => {
        this.views[1].space = input.value === "chart" ? 1 : 2;
        this.views[1].reset();
        this.redraw();
      });
    }
    for (const button of document.querySelectorAll("button[data-view]")) {
      button.addEventListener("click", () => {
        const view = this.views[Number(button.dataset.view)];
        const act = { in: () => view.zoom(1.3), out: () => view.zoom(1 / 1.3), reset: () => view.reset() };
        act[button.dataset.act]();
        this.redraw();
      });
    }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.palette = palette();
      this.redraw();
    });
  }

  chosen() {
    // What a surface does not have has no box.
    const on = (name) => Boolean(this.form.elements[name]?.checked);
    return {
      layer: LAYERS.indexOf(this.form.elements.layer.value),
      cones: on("cones"),
      cut: on("cut"),
      features: on("features"),
      borders: on("borders"),
      edges: on("edges"),
    };
  }

  // Once a frame at most; without `all` only what is under the pointer is looked up.
  redraw(all = true) {
    this.stale = this.stale || all;
    if (this.waiting || !this.surface) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (this.stale) {
        this.stale = false;
        for (const view of this.views) view.draw(this.surface);
        this.legend();
      }
      for (const view of this.views) {
        if (view.asked) view.read(view.asked);
        view.asked = null;
      }
    });
  }

  legend() {
    for (const item of document.querySelectorAll("[data-legend]")) {
      item.hidden = item.dataset.legend !== this.form.elements.layer.value;
    }
  }

  // Says in words what is under the pointer.
  say(view, face, cone) {
    const output = document.getElementById(view.space === 0 ? "read-space" : "read-plane");
    const { surface, meta } = this;
    if (face < 0 && !cone) {
      output.textContent = output.dataset.empty;
      return;
    }
    const words = [];
    if (cone) {
      const file = cone.source_vertex === null ? "not in the file" : `${cone.source_vertex} of the file`;
      words.push(`cone at vertex ${cone.vertex} (${file}): curvature ${(cone.curvature / Math.PI).toPrecision(4)}π`);
    }
    if (face >= 0) {
      const log = surface.logScaleOf(surface.logScale[face]);
      const angle = (surface.angle[face] / 65535) * meta.angle_error;
      words.push(`face ${face} (${surface.sourceFace[face]} of the file)`, `patch ${surface.facePatch[face]}`);
      if (surface.faceSegment.has(face)) words.push(`beside segment ${surface.faceSegment.get(face)}`);
      words.push(`log scale ${log.toFixed(4)}`, `angle error ${angle.toPrecision(3)} rad`);
      if (surface.distance) {
        const of = (k) => surface.distance[surface.vertexOf[surface.corner[3 * face + k]]];
        const most = Math.max(of(0), of(1), of(2));
        words.push(`images ${((most / 65535) * meta.distance).toPrecision(3)} away`);
      }
    }
    output.textContent = words.join(" · ");
  }
}

async function start() {
  const note = document.getElementById("surface-note");
  const meta = JSON.parse(document.getElementById("surface-meta").textContent);
  const page = new Page(meta);
  const data = document.getElementById("surface-data");
  try {
    page.surface = new Surface(meta, await unpack(data.textContent));
  } catch (error) {
    note.textContent = `The surface cannot be drawn: ${error.message}. Figures and tables below are complete.`;
    document.documentElement.dataset.state = "no-surface";
    return;
  }
  data.remove();
  note.textContent = "";
  page.redraw();
  requestAnimationFrame(() => {
    document.documentElement.dataset.state = "drawn";
  });
}

if (document.getElementById("surface-meta")) start();
else document.documentElement.dataset.state = "no-surface";
