// The surface of the page: unpacks its arrays, and draws it in space or in the plane with WebGL 2.
//
// One context draws both views; what it drew is copied to the canvas of the view that asked.
"use strict";

// Base64 and deflate back to bytes.
async function unpack(text) {
  const binary = atob(text.trim());
  const packed = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) packed[i] = binary.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// A section is `components` runs of numbers; each run is `bytes` planes, the lowest bytes first. Numbers are zigzag differences
// from the one before, or plain where the section is no chain of differences.
function section(bytes, entry) {
  const { components, count, at } = entry;
  const out = entry.float ? new Float32Array(components * count) : new Uint32Array(components * count);
  const word = new Uint32Array(1);
  const real = new Float32Array(word.buffer);
  for (let c = 0; c < components; c++) {
    let last = 0;
    const start = at + c * entry.bytes * count;
    for (let i = 0; i < count; i++) {
      let value = 0;
      for (let b = 0; b < entry.bytes; b++) value |= bytes[start + b * count + i] << (8 * b);
      value >>>= 0;
      if (entry.float) {
        word[0] = value;
        out[i * components + c] = real[0];
      } else {
        last = (last + ((value >>> 1) ^ -(value & 1))) >>> 0;
        out[i * components + c] = last;
      }
    }
  }
  return out;
}

// Unit vector of two numbers on the octahedron, each from 0 to 4095.
function direction(a, b, out, at) {
  let x = a / 2047.5 - 1;
  let y = b / 2047.5 - 1;
  const z = 1 - Math.abs(x) - Math.abs(y);
  if (z < 0) {
    const turned = (1 - Math.abs(y)) * (x < 0 ? -1 : 1);
    y = (1 - Math.abs(x)) * (y < 0 ? -1 : 1);
    x = turned;
  }
  const length = Math.hypot(x, y, z) || 1;
  out[at] = x / length;
  out[at + 1] = y / length;
  out[at + 2] = z / length;
}

const SURFACE_VERTEX = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 chart;
layout(location = 3) in vec2 square;
layout(location = 4) in vec3 board;
layout(location = 5) in vec3 values;
layout(location = 6) in vec3 patchColour;
uniform mat4 matrix;
uniform mat3 turn;
uniform int space;
out vec3 lit;
out vec3 cells;
out vec3 weights;
out vec3 shown;
out vec3 tint;
flat out uint face;
void main() {
  vec3 p = space == 0 ? position : vec3(space == 1 ? chart : square, 0.0);
  gl_Position = matrix * vec4(p, 1.0);
  lit = turn * normal;
  cells = board;
  shown = values;
  tint = patchColour;
  int corner = gl_VertexID % 3;
  weights = vec3(corner == 0, corner == 1, corner == 2);
  face = uint(gl_VertexID / 3);
}`;

const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
in vec3 lit;
in vec3 cells;
in vec3 weights;
in vec3 shown;
in vec3 tint;
flat in uint face;
uniform int layer;
uniform int space;
uniform bool edges;
uniform bool picking;
uniform vec2 cellRange;
uniform vec3 low[7];
uniform vec3 rising[5];
out vec4 colour;
// Lines along both directions; their width is the same at any size.
float line(vec2 at) {
  vec2 away = abs(fract(at - 0.5) - 0.5) / max(fwidth(at), vec2(1e-6));
  return 1.0 - smoothstep(0.4, 1.5, min(away.x, away.y));
}
float dark(vec2 at) {
  vec2 q = floor(at);
  return mod(q.x + q.y, 2.0);
}
vec3 along(float t) {
  float x = clamp(t, 0.0, 1.0) * 6.0;
  int i = min(int(x), 5);
  return mix(low[i], low[i + 1], x - float(i));
}
vec3 up(float t) {
  float x = clamp(t, 0.0, 1.0) * 4.0;
  int i = min(int(x), 3);
  return mix(rising[i], rising[i + 1], x - float(i));
}
void main() {
  if (picking) {
    uint id = face + 1u;
    colour = vec4(float(id & 255u), float((id >> 8) & 255u), float((id >> 16) & 255u), float(id >> 24)) / 255.0;
    return;
  }
  vec3 c = vec3(0.8);
  float hatch = step(6.0, mod(gl_FragCoord.x + gl_FragCoord.y, 9.0));
  if (layer == 0 || layer == 5) {
    // Cells that got too large or too small are cut and joined by powers of two, one fading into the next.
    float excess = cells.z - clamp(cells.z, cellRange.x, cellRange.y);
    float s = floor(excess);
    float fade = clamp((excess - s - 0.47) / 0.06, 0.0, 1.0);
    vec2 at = cells.xy * exp2(s);
    float pixels = 1.0 / max(length(fwidth(at)), 1e-6);
    if (layer == 0) {
      float d = mix(dark(at), dark(2.0 * at), fade);
      d = 0.5 + (d - 0.5) * clamp((pixels - 1.0) / 2.0, 0.0, 1.0);
      c = mix(vec3(0.92, 0.90, 0.85), vec3(0.27, 0.45, 0.52), d);
    } else {
      float d = mix(line(at), line(2.0 * at), fade);
      d = mix(0.4, d, clamp((pixels - 2.0) / 3.0, 0.0, 1.0));
      c = mix(vec3(0.93, 0.91, 0.87), vec3(0.13, 0.30, 0.38), d);
    }
  } else if (layer == 1) {
    c = along(shown.x);
    // Hatched where the flat metric shrinks the surface.
    if (shown.x < 0.45) c = mix(c, c * 0.62, hatch);
  } else if (layer == 2) {
    c = up(shown.y);
  } else if (layer == 3) {
    c = up(shown.z);
  } else {
    c = tint;
  }
  if (edges) {
    vec3 d = fwidth(weights);
    vec3 near = smoothstep(vec3(0.0), d * 1.2, weights);
    c = mix(c * 0.45, c, min(near.x, min(near.y, near.z)));
  }
  if (space == 0) {
    vec3 n = normalize(lit);
    float front = abs(n.z);
    float side = 0.5 + 0.5 * dot(n * (n.z < 0.0 ? -1.0 : 1.0), normalize(vec3(-0.5, 0.7, 0.5)));
    c *= 0.42 + 0.38 * front + 0.26 * side;
  }
  colour = vec4(c, 1.0);
}`;

const LINE_VERTEX = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
uniform mat4 matrix;
uniform vec2 size;
uniform float width;
uniform float nearer;
void main() {
  vec4 a = matrix * vec4(from, 1.0);
  vec4 b = matrix * vec4(to, 1.0);
  vec2 along = (b.xy / b.w - a.xy / a.w) * size;
  float extent = length(along);
  along = extent > 1e-6 ? along / extent : vec2(1.0, 0.0);
  float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  bool end = gl_VertexID >= 2;
  vec4 p = end ? b : a;
  // A little longer, so that neighbours overlap at corners.
  vec2 off = (vec2(-along.y, along.x) * side + along * (end ? 0.7 : -0.7)) * width;
  p.xy += off / size * p.w;
  p.z -= nearer * p.w;
  gl_Position = p;
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
uniform vec4 ink;
out vec4 colour;
void main() { colour = ink; }`;

const CONE_VERTEX = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in vec4 place;
uniform mat4 matrix;
uniform float side;
uniform float nearer;
flat out float positive;
void main() {
  gl_Position = matrix * vec4(place.xyz, 1.0);
  gl_Position.z -= nearer * gl_Position.w;
  gl_PointSize = side;
  positive = place.w;
}`;

// Triangles where the curvature is positive, diamonds where it is negative.
const CONE_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
flat in float positive;
uniform vec3 inks[2];
out vec4 colour;
void main() {
  vec2 p = gl_PointCoord * 2.0 - 1.0;
  float d = positive > 0.5
    ? max(abs(p.x) * 0.9 - p.y * 0.5 - 0.45, p.y - 0.8)
    : abs(p.x) + abs(p.y) - 0.95;
  if (d > 0.0) discard;
  colour = vec4(d > -0.22 ? vec3(1.0) : positive > 0.5 ? inks[0] : inks[1], 1.0);
}`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(gl.getShaderInfoLog(shader) || "a shader does not compile");
    }
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) {
    throw new Error(gl.getProgramInfoLog(made) || "the shaders do not link");
  }
  const uniforms = {};
  const count = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < count; i++) {
    const name = gl.getActiveUniform(made, i).name.replace("[0]", "");
    uniforms[name] = gl.getUniformLocation(made, name);
  }
  return { made, uniforms };
}

const LINE_KINDS = ["border", "boundary", "cut", "feature"];
const SPACES = ["space", "chart", "packed"];

class Surface {
  constructor(meta, bytes) {
    const gl = document.createElement("canvas").getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("this browser offers no WebGL 2");
    this.gl = gl;
    this.meta = meta;
    const get = (name) => section(bytes, meta.sections[name]);
    this.expand(get);
    this.surface = program(gl, SURFACE_VERTEX, SURFACE_FRAGMENT);
    this.line = program(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.cone = program(gl, CONE_VERTEX, CONE_FRAGMENT);
    this.pick = gl.createFramebuffer();
    const buffers = [gl.createRenderbuffer(), gl.createRenderbuffer()];
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.pick);
    gl.bindRenderbuffer(gl.RENDERBUFFER, buffers[0]);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, 1, 1);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, buffers[0]);
    gl.bindRenderbuffer(gl.RENDERBUFFER, buffers[1]);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, 1, 1);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, buffers[1]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  // From rows of vertices to three corners a face, each with all it needs.
  expand(get) {
    const { meta, gl } = this;
    const place = get("position");
    const normal = get("normal");
    const level = get("level");
    const distance = meta.sections.distance ? get("distance") : null;
    const vertex = get("vertex");
    const patch = get("patch");
    const chart = get("chart");
    const packed = get("packed");
    const board = get("board");
    const corner = get("corner");
    const faceNormal = get("face_normal");
    const logScale = get("log_scale");
    const angle = get("angle_error");
    this.sourceFace = get("source_face");
    const corners = corner.length;
    this.corners = corners;
    // Longest side 2, in the middle.
    const extent = meta.high.map((h, i) => h - meta.low[i]);
    const longest = Math.max(...extent) || 1;
    const positions = new Float32Array(3 * corners);
    const charts = new Float32Array(2 * corners);
    const squares = new Float32Array(2 * corners);
    const boards = new Float32Array(3 * corners);
    const normals = new Int8Array(4 * corners);
    const values = new Uint16Array(4 * corners);
    const colours = new Uint8Array(4 * corners);
    this.facePatch = new Uint32Array(corners / 3);
    const levels = meta.level[1] - meta.level[0];
    const spread = [0, 1].map((i) => meta.chart.high[i] - meta.chart.low[i]);
    const wide = Math.max(...spread) || 1;
    const own = [0, 0, 0];
    const flat = [0, 0, 0];
    const { middle, reach } = meta.log_scale_colours;
    for (let i = 0; i < corners; i++) {
      const f = (i / 3) | 0;
      const at = corner[i];
      const v = vertex[at];
      for (let k = 0; k < 3; k++) {
        positions[3 * i + k] = (place[3 * v + k] / 65535 - 0.5) * (2 * extent[k] / longest);
      }
      direction(faceNormal[2 * f], faceNormal[2 * f + 1], flat, 0);
      direction(normal[2 * v], normal[2 * v + 1], own, 0);
      // Round where neighbours are nearly level, sharp along creases.
      const round = flat[0] * own[0] + flat[1] * own[1] + flat[2] * own[2] > 0.8;
      for (let k = 0; k < 3; k++) normals[4 * i + k] = Math.round(127 * (round ? own : flat)[k]);
      for (let k = 0; k < 2; k++) {
        charts[2 * i + k] = (chart[2 * at + k] / 8388607 - 0.5) * (2 * spread[k] / wide);
        squares[2 * i + k] = (packed[2 * at + k] / 65535) * 2 - 1;
        boards[3 * i + k] = board[2 * at + k];
      }
      boards[3 * i + 2] = meta.level[0] + (level[v] / 65535) * levels;
      const log = this.logScaleOf(logScale[f]);
      const scaled = 0.5 + (log - middle) / (2 * reach);
      values[4 * i] = Math.round(65535 * Math.min(1, Math.max(0, scaled)));
      values[4 * i + 1] = Math.round(65535 * Math.min(1, (angle[f] / 65535) * meta.angle_error / meta.angle_colours));
      values[4 * i + 2] = distance
        ? Math.round(65535 * Math.min(1, (distance[v] / 65535) * meta.distance / (meta.distance_colours || 1)))
        : 0;
      const colour = meta.patches[patch[at]];
      for (let k = 0; k < 3; k++) colours[4 * i + k] = colour[k];
      this.facePatch[f] = patch[at];
    }
    Object.assign(this, { positions, charts, squares, logScale, angle, distance, vertexOf: vertex, corner });
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    const attribute = (index, data, size, type, normalised, stride) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(index);
      gl.vertexAttribPointer(index, size, type, normalised, stride, 0);
    };
    attribute(0, positions, 3, gl.FLOAT, false, 12);
    attribute(1, normals, 3, gl.BYTE, true, 4);
    attribute(2, charts, 2, gl.FLOAT, false, 8);
    attribute(3, squares, 2, gl.FLOAT, false, 8);
    attribute(4, boards, 3, gl.FLOAT, false, 12);
    attribute(5, values, 3, gl.UNSIGNED_SHORT, true, 8);
    attribute(6, colours, 3, gl.UNSIGNED_BYTE, true, 4);
    this.expandLines(get("line_corner"), get("line_kind"), get("line_segment"));
    this.expandCones();
  }

  logScaleOf(stored) {
    const [least, most] = this.meta.log_scale;
    return least + (stored / 65535) * (most - least);
  }

  // A point of a corner in one of the three spaces.
  point(space, corner) {
    if (space === 0) return [0, 1, 2].map((k) => this.positions[3 * corner + k]);
    const plane = space === 1 ? this.charts : this.squares;
    return [plane[2 * corner], plane[2 * corner + 1], 0];
  }

  // Lines come sorted by kind.
  expandLines(corners, kinds, segments) {
    const { gl } = this;
    this.runs = LINE_KINDS.map((_, kind) => {
      const first = kinds.indexOf(kind);
      return [first, first < 0 ? 0 : kinds.lastIndexOf(kind) + 1 - first];
    });
    this.faceSegment = new Map();
    this.lines = SPACES.map((_, space) => {
      const data = new Float32Array(6 * corners.length);
      corners.forEach((c, i) => {
        const next = c - (c % 3) + ((c + 1) % 3);
        data.set(this.point(space, c), 6 * i);
        data.set(this.point(space, next), 6 * i + 3);
        if (kinds[i] === 2) this.faceSegment.set((c / 3) | 0, segments[i]);
      });
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      return { buffer, array: gl.createVertexArray() };
    });
  }

  // In the plane a cone is wherever a copy of its vertex is.
  expandCones() {
    const { gl, meta } = this;
    const cones = new Map(meta.cones.map((cone, i) => [cone.vertex, i]));
    this.marks = SPACES.map(() => []);
    const known = SPACES.map(() => new Set());
    for (let i = 0; i < this.corners; i++) {
      const row = this.corner[i];
      const cone = cones.get(this.vertexOf[row]);
      if (cone === undefined) continue;
      for (let space = 0; space < 3; space++) {
        const key = space === 0 ? cone : row;
        if (known[space].has(key)) continue;
        known[space].add(key);
        this.marks[space].push({ cone: meta.cones[cone], at: this.point(space, i) });
      }
    }
    this.markArrays = this.marks.map((marks) => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      const rows = marks.flatMap((m) => [...m.at, m.cone.curvature > 0 ? 1 : 0]);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(rows), gl.STATIC_DRAW);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 16, 0);
      return array;
    });
  }

  setSurface(view) {
    const { gl, surface, meta } = this;
    gl.useProgram(surface.made);
    const u = surface.uniforms;
    gl.uniformMatrix4fv(u.matrix, false, view.matrix);
    gl.uniformMatrix3fv(u.turn, false, view.turn);
    gl.uniform1i(u.space, view.space);
    gl.uniform1i(u.layer, view.layer);
    gl.uniform1i(u.edges, view.edges ? 1 : 0);
    gl.uniform2fv(u.cellRange, meta.cell_range);
    gl.uniform3fv(u.low, meta.diverging.flat().map((x) => x / 255));
    gl.uniform3fv(u.rising, meta.rising.flat().map((x) => x / 255));
    if (view.space === 0) gl.enable(gl.DEPTH_TEST);
    else gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.array);
  }

  // Draws a view and copies it to its canvas.
  draw(view, target, palette) {
    const { gl } = this;
    const { width, height } = target.canvas;
    const screen = gl.canvas;
    if (screen.width < width || screen.height < height) {
      screen.width = Math.max(screen.width, width);
      screen.height = Math.max(screen.height, height);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.setSurface(view);
    gl.uniform1i(this.surface.uniforms.picking, 0);
    gl.drawArrays(gl.TRIANGLES, 0, this.corners);
    this.drawLines(view, width, height, palette);
    if (view.cones) this.drawCones(view, palette);
    target.clearRect(0, 0, width, height);
    target.drawImage(screen, 0, screen.height - height, width, height, 0, 0, width, height);
  }

  drawLines(view, width, height, palette) {
    const { gl, line } = this;
    gl.useProgram(line.made);
    gl.uniformMatrix4fv(line.uniforms.matrix, false, view.matrix);
    gl.uniform2f(line.uniforms.size, width / 2, height / 2);
    const { buffer, array } = this.lines[view.space];
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    const layers = [
      [0, view.borders, 0.6, palette.border],
      [1, true, 1.3, palette.ink],
      [3, view.features, 2.6, palette.halo],
      [3, view.features, 1.5, palette.feature],
      [2, view.cut, 2.6, palette.halo],
      [2, view.cut, 1.5, palette.cut],
    ];
    layers.forEach(([kind, on, wide, ink], i) => {
      const [first, count] = this.runs[kind];
      if (!on || count === 0) return;
      for (const [index, at] of [[0, 0], [1, 12]]) {
        gl.enableVertexAttribArray(index);
        gl.vertexAttribPointer(index, 3, gl.FLOAT, false, 24, 24 * first + at);
        gl.vertexAttribDivisor(index, 1);
      }
      gl.uniform1f(line.uniforms.width, wide * view.ratio);
      gl.uniform1f(line.uniforms.nearer, view.space === 0 ? 0.004 + 0.0008 * i : 0);
      gl.uniform4fv(line.uniforms.ink, ink);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    });
  }

  drawCones(view, palette) {
    const { gl, cone } = this;
    gl.useProgram(cone.made);
    gl.uniformMatrix4fv(cone.uniforms.matrix, false, view.matrix);
    gl.uniform1f(cone.uniforms.side, 17 * view.ratio);
    gl.uniform1f(cone.uniforms.nearer, view.space === 0 ? 0.035 : 0);
    gl.uniform3fv(cone.uniforms.inks, [...palette.positive, ...palette.negative]);
    gl.bindVertexArray(this.markArrays[view.space]);
    gl.drawArrays(gl.POINTS, 0, this.marks[view.space].length);
  }

  // The face under a point of the view (−1 to 1 in both directions), or −1.
  faceAt(view, x, y, width, height) {
    const { gl } = this;
    // The matrix that blows the pixel up to the whole of a picture of one pixel.
    const zoom = new Float32Array(view.matrix);
    for (let column = 0; column < 4; column++) {
      const w = zoom[4 * column + 3];
      zoom[4 * column] = (zoom[4 * column] - x * w) * width;
      zoom[4 * column + 1] = (zoom[4 * column + 1] - y * w) * height;
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.pick);
    gl.viewport(0, 0, 1, 1);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.setSurface({ ...view, matrix: zoom });
    gl.uniform1i(this.surface.uniforms.picking, 1);
    gl.drawArrays(gl.TRIANGLES, 0, this.corners);
    const p = new Uint8Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, p);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return p[0] + 256 * p[1] + 65536 * p[2] + 16777216 * p[3] - 1;
  }

  // The cone nearest to a point of the view, within `reach` pixels.
  coneAt(view, x, y, width, height, reach) {
    let best = null;
    for (const mark of this.marks[view.space]) {
      const m = view.matrix;
      const p = [0, 1, 3].map((r) => m[r] * mark.at[0] + m[4 + r] * mark.at[1] + m[8 + r] * mark.at[2] + m[12 + r]);
      const d = Math.hypot((p[0] / p[2] - x) * width, (p[1] / p[2] - y) * height) / 2;
      if (d < reach) {
        reach = d;
        best = mark.cone;
      }
    }
    return best;
  }
}
