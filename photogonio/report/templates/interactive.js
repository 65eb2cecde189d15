"use strict";
// A ball to light, lobes and the set-up to turn. WebGL 2, no library; what cannot be drawn says so in its place.
const told = JSON.parse(document.getElementById("told").textContent);

function halves(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Uint16Array(bytes.buffer);
}
function toFloat(h) {
  const e = (h >> 10) & 31, m = h & 1023, s = h >> 15 ? -1 : 1;
  return s * (e ? Math.pow(2, e - 15) * (1 + m / 1024) : m * Math.pow(2, -24));
}
function context(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true, alpha: true });
  if (gl) return gl;
  const note = document.createElement("p");
  note.textContent = "This browser draws no WebGL 2.";
  canvas.replaceWith(note);
  return null;
}
function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, "#version 300 es\nprecision highp float; precision highp sampler3D;\n" + text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  gl.useProgram(made);
  return made;
}
function sized(canvas, gl) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  gl.viewport(0, 0, canvas.width, canvas.height);
}
function dragged(canvas, moved) {
  let last = null;
  canvas.style.touchAction = "none";
  canvas.addEventListener("pointerdown", (e) => { last = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); moved(0, 0, e); });
  canvas.addEventListener("pointermove", (e) => {
    if (!last) return;
    moved(e.clientX - last[0], e.clientY - last[1], e);
    last = [e.clientX, e.clientY];
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { last = null; });
}
const control = (id) => document.getElementById(id);
const add = (a, b) => a.map((x, k) => x + b[k]);
const scaled = (a, s) => a.map((x) => x * s);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => scaled(a, 1 / Math.max(Math.hypot(...a), 1e-12));

// ---------------------------------------------------------------- the table, on this side
class Table {
  constructor(data) {
    this.shape = data.shape;
    this.folded = data.folded;
    this.raw = halves(data.data);
    this.value = Float32Array.from(this.raw, toFloat);
  }
  // f in three channels and its relative error at unit vectors of the tangent frame
  at(i, r) {
    const h = unit(add(i, r)), th = Math.acos(Math.min(Math.max(h[2], 0), 1)), ph = Math.atan2(h[1], h[0]);
    const td = Math.acos(Math.min(Math.max(dot(i, h), 0), 1));
    const c = Math.cos(ph), s = Math.sin(ph), a = [c * i[0] + s * i[1], -s * i[0] + c * i[1], i[2]];
    let pd = Math.atan2(a[1], h[2] * a[0] - Math.sin(th) * a[2]) / (2 * Math.PI);
    const [n, nh, nd, np] = this.shape, along = [], spots = [];
    if (this.folded) {
      pd = Math.abs(pd) * 4;
      pd = (pd > 1 ? 2 - pd : pd) * (np - 1);
    } else pd = (pd - Math.floor(pd)) * np;
    const places = [n > 1 ? (ph / (2 * Math.PI) + 1) % 1 * n : 0, Math.sqrt(th / (Math.PI / 2)) * (nh - 1), td / (Math.PI / 2) * (nd - 1), pd];
    places.forEach((x, k) => { along[k] = Math.floor(x); spots[k] = x - along[k]; });
    const out = [0, 0, 0, 0];
    for (let corner = 0; corner < 16; corner++) {
      let weight = 1, place = 0;
      for (let k = 0; k < 4; k++) {
        const up = (corner >> k) & 1, count = this.shape[k];
        weight *= up ? spots[k] : 1 - spots[k];
        const round = k === 0 || (k === 3 && !this.folded);
        place = place * count + (round ? (along[k] + up) % count : Math.min(along[k] + up, count - 1));
      }
      if (weight) for (let k = 0; k < 4; k++) out[k] += weight * this.value[4 * place + k];
    }
    return out;
  }
}

// ---------------------------------------------------------------- a ball under a light that follows the hand
function ball(canvas, data, table) {
  const gl = context(canvas);
  if (!gl) return;
  const [n, nh, nd, np] = data.shape;
  const shader = program(gl, "in vec2 corner; out vec2 at; void main() { at = corner; gl_Position = vec4(corner, 0., 1.); }", `
in vec2 at; out vec4 color;
uniform sampler3D table; uniform vec3 light; uniform float gain, band, turn; uniform vec4 shape; uniform bool folded;
const float PI = 3.14159265358979;
vec4 block(float k, vec3 spot) {
  return texture(table, vec3(spot.x, spot.y, (k * shape.y + spot.z) / (shape.x * shape.y)));
}
vec4 brdf(vec3 i, vec3 r) {
  vec3 h = normalize(i + r);
  float th = acos(clamp(h.z, 0., 1.)), td = acos(clamp(dot(i, h), 0., 1.)), ph = atan(h.y, h.x + 1e-9);
  float c = cos(ph), s = sin(ph);
  vec3 a = vec3(c * i.x + s * i.y, -s * i.x + c * i.y, i.z);
  float pd = atan(a.y, h.z * a.x - sin(th) * a.z + 1e-9) / (2. * PI), x;
  if (folded) { pd = abs(pd) * 4.; if (pd > 1.) pd = 2. - pd; x = (pd * (shape.w - 1.) + .5) / shape.w; }
  else x = fract(pd) + .5 / shape.w;
  vec3 spot = vec3(x, (td / (.5 * PI) * (shape.z - 1.) + .5) / shape.z, sqrt(th / (.5 * PI)) * (shape.y - 1.) + .5);
  if (shape.x < 1.5) return block(0., spot);
  float turn = fract(ph / (2. * PI)) * shape.x, k = floor(turn);
  return mix(block(k, spot), block(mod(k + 1., shape.x), spot), turn - k);
}
void main() {
  float r2 = dot(at, at);
  if (r2 >= 1.) { color = vec4(0.); return; }
  vec3 n = vec3(at, sqrt(1. - r2)), x = normalize(vec3(1., 0., 0.) - n.x * n), y = cross(n, x);
  vec3 e = cos(turn) * x + sin(turn) * y, o = cross(n, e);
  float cosine = dot(n, light);
  vec3 rgb = vec3(0.);
  if (cosine > 0.) {
    vec4 f = brdf(vec3(dot(e, light), dot(o, light), cosine), vec3(e.z, o.z, n.z));
    rgb = gain * PI * cosine * f.rgb * max(1. + band * f.a, 0.);
  }
  rgb = clamp(rgb, 0., 1.);
  rgb = mix(12.92 * rgb, 1.055 * pow(rgb, vec3(1. / 2.4)) - .055, step(.0031308, rgb));
  float edge = smoothstep(1., .985, sqrt(r2));
  color = vec4(rgb * edge, edge);
}`);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.bindAttribLocation(shader, 0, "corner");
  gl.vertexAttribPointer(gl.getAttribLocation(shader, "corner"), 2, gl.FLOAT, false, 0, 0);
  gl.bindTexture(gl.TEXTURE_3D, gl.createTexture());
  gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA16F, np, nd, nh * n, 0, gl.RGBA, gl.HALF_FLOAT, table.raw);
  for (const [name, value] of [["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_R", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]])
    gl.texParameteri(gl.TEXTURE_3D, gl["TEXTURE_" + name], gl[value]);
  gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_WRAP_S, data.folded ? gl.CLAMP_TO_EDGE : gl.REPEAT);
  const place = (name) => gl.getUniformLocation(shader, name);
  gl.uniform4f(place("shape"), n, nh, nd, np);
  gl.uniform1i(place("folded"), data.folded ? 1 : 0);
  let light = unit([-0.5, 0.6, 1.0]);
  const front = table.at([0, 0, 1], [0, 0, 1]), base = 0.5 / (Math.PI * Math.max(front[0], front[1], front[2], 1e-6));
  const draw = () => {
    sized(canvas, gl);
    gl.uniform3fv(place("light"), light);
    gl.uniform1f(place("gain"), base * Math.pow(2, +control("exposure").value));
    gl.uniform1f(place("band"), data.error ? +control("band").value : 0);
    gl.uniform1f(place("turn"), data.folded ? 0 : +control("turn").value * Math.PI / 180);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  };
  dragged(canvas, (dx, dy, e) => {
    const box = canvas.getBoundingClientRect();
    const x = (e.clientX - box.left) / box.width * 2 - 1, y = 1 - (e.clientY - box.top) / box.height * 2;
    const away = Math.min(Math.hypot(x, y) * Math.PI / 2, 2.6), s = Math.sin(away) / Math.max(Math.hypot(x, y), 1e-9);
    light = [s * x, s * y, Math.cos(away)];
    draw();
  });
  for (const id of ["exposure", "band", "turn"]) if (control(id)) control(id).addEventListener("input", draw);
  window.addEventListener("resize", draw);
  draw();
}

// ---------------------------------------------------------------- meshes that turn under the hand
class Viewer {
  constructor(canvas, { elevation = 0.5, azimuth = -0.6, reach = 3.2 } = {}) {
    this.canvas = canvas;
    this.gl = context(canvas);
    this.angles = [azimuth, elevation];
    this.reach = reach;
    this.middle = [0, 0, 0];
    this.parts = [];
    if (!this.gl) return;
    const gl = this.gl;
    this.shader = program(gl, `
in vec3 point, normal; in vec4 tint; uniform mat3 turn; uniform vec3 middle; uniform vec2 lens; out vec3 n; out vec4 c;
void main() {
  vec3 p = turn * (point - middle);
  n = turn * normal; c = tint;
  gl_Position = vec4(p.xy * 2.2 / vec2(lens.y, 1.), -p.z * .2, (lens.x - p.z));
}`, `
in vec3 n; in vec4 c; out vec4 color;
void main() {
  float lit = dot(n, n) > .1 ? .55 + .45 * abs(normalize(n).z) : 1.;
  color = vec4(c.rgb * lit * c.a, c.a);
}`);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    dragged(canvas, (dx, dy) => {
      this.angles[0] += dx * 0.01;
      this.angles[1] = Math.min(Math.max(this.angles[1] + dy * 0.01, -0.2), 1.57);
      this.draw();
    });
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.reach = Math.min(Math.max(this.reach * Math.exp(e.deltaY * 0.001), 0.6), 30);
      this.draw();
    }, { passive: false });
    window.addEventListener("resize", () => this.draw());
  }
  // numbers: 10 a vertex (point, normal, tint); the solid ones first
  show(parts) {
    this.parts = parts.map(([mode, numbers]) => [mode, new Float32Array(numbers)]);
    this.draw();
  }
  draw() {
    const gl = this.gl;
    if (!gl) return;
    sized(this.canvas, gl);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [a, e] = this.angles, ca = Math.cos(a), sa = Math.sin(a), ce = Math.cos(e), se = Math.sin(e);
    // the board's z is up: x right, then up the screen, then toward the eye; by columns
    const turn = [ca, sa * se, -sa * ce, -sa, ca * se, -ca * ce, 0, ce, se];
    gl.useProgram(this.shader);
    gl.uniformMatrix3fv(gl.getUniformLocation(this.shader, "turn"), false, turn);
    gl.uniform3fv(gl.getUniformLocation(this.shader, "middle"), this.middle);
    gl.uniform2f(gl.getUniformLocation(this.shader, "lens"), this.reach, this.canvas.width / this.canvas.height);
    for (const [mode, numbers] of this.parts) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer || (this.buffer = gl.createBuffer()));
      gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.DYNAMIC_DRAW);
      [["point", 3, 0], ["normal", 3, 12], ["tint", 4, 24]].forEach(([name, size, offset]) => {
        const k = gl.getAttribLocation(this.shader, name);
        gl.enableVertexAttribArray(k);
        gl.vertexAttribPointer(k, size, gl.FLOAT, false, 40, offset);
      });
      gl.drawArrays(gl[mode], 0, numbers.length / 10);
    }
  }
}
const NONE = [0, 0, 0];
const vertex = (p, n, c) => [...p, ...n, ...c];
const line = (out, a, b, tint) => out.push(...vertex(a, NONE, tint), ...vertex(b, NONE, tint));
function sheet(rows, tint, out) {
  for (let k = 0; k + 1 < rows.length; k++)
    for (let j = 0; j + 1 < rows[k].length; j++) {
      const [a, b, c, d] = [rows[k][j], rows[k][j + 1], rows[k + 1][j], rows[k + 1][j + 1]];
      const n = unit(cross(add(d, scaled(a, -1)), add(c, scaled(b, -1))));
      for (const p of [a, b, d, a, d, c]) out.push(...vertex(p, n, tint));
    }
}
function sphere(center, radius, tint, out) {
  const rows = [];
  for (let k = 0; k <= 12; k++) {
    const row = [], t = Math.PI * k / 12;
    for (let j = 0; j <= 24; j++)
      row.push(add(center, scaled([Math.sin(t) * Math.cos(Math.PI * j / 12), Math.sin(t) * Math.sin(Math.PI * j / 12), Math.cos(t)], radius)));
    rows.push(row);
  }
  sheet(rows, tint, out);
}

// ---------------------------------------------------------------- a lobe with its band of error
function lobe(canvas, data, table) {
  const viewer = new Viewer(canvas, { elevation: 0.3, azimuth: 0.35, reach: 2.9 });
  viewer.middle = [0, 0, 0.3];
  if (!viewer.gl) return;
  const length = (f) => (control("root").checked ? Math.sqrt(Math.max(f, 0) / data.highest) : Math.max(f, 0) / data.highest);
  const draw = () => {
    const ti = +control("incidence").value * Math.PI / 180, i = [-Math.sin(ti), 0, Math.cos(ti)];
    control("incidence-said").textContent = control("incidence").value + "°";
    const rows = [[], [], []];
    for (let k = 0; k <= 64; k++) {
      const t = 85 * Math.PI / 180 * k / 64, row = [[], [], []];
      for (let j = 0; j <= 72; j++) {
        const p = 2 * Math.PI * j / 72, r = [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
        const [a, b, c, e] = table.at(i, r), f = (a + b + c) / 3;
        [0, 1.96, -1.96].forEach((z, m) => row[m].push(scaled(r, length(f * Math.max(1 + z * e, 0)))));
      }
      row.forEach((one, m) => rows[m].push(one));
    }
    const solid = [], shell = [], lines = [], ink = [0.5, 0.52, 0.55, 1];
    sheet(rows[0], [0.35, 0.55, 0.8, 1], solid);
    if (data.error) for (const m of [2, 1]) sheet(rows[m], [0.9, 0.6, 0.2, 0.28], shell);
    for (const radius of [0.5, 1]) for (let j = 0; j < 72; j++) {
      const at = (q) => { const p = 2 * Math.PI * q / 72, l = length(radius * data.highest); return [l * Math.cos(p), l * Math.sin(p), 0]; };
      line(lines, at(j), at(j + 1), ink);
    }
    line(lines, [-1.1, 0, 0], [1.1, 0, 0], ink);
    line(lines, [0, 0, 0], [0, 0, 1.1], ink);
    line(lines, scaled(i, 1.4), NONE, [0.9, 0.55, 0.1, 1]);
    viewer.show([["LINES", lines], ["TRIANGLES", solid], ["TRIANGLES", shell]]);
  };
  for (const id of ["incidence", "root"]) control(id).addEventListener("input", draw);
  draw();
}

// ---------------------------------------------------------------- where everything stood
function setUp(canvas, scene) {
  const viewer = new Viewer(canvas, { elevation: 0.55, azimuth: 0.6, reach: 6 });
  if (!viewer.gl) return;
  const solid = [], lines = [], camera = [0.25, 0.5, 0.85, 1], idle = [0.55, 0.6, 0.65, 1], lamp = [0.92, 0.6, 0.1, 1];
  if (scene.board.length) sheet([[scene.board[0], scene.board[1]], [scene.board[3], scene.board[2]]], [0.8, 0.82, 0.84, 1], solid);
  if (scene.sample.ball) sphere(scene.sample.ball.slice(0, 3), scene.sample.ball[3], [0.75, 0.4, 0.3, 1], solid);
  else scene.sample.outline.forEach((p, k, all) => {
    line(lines, p, all[(k + 1) % all.length], [0.75, 0.4, 0.3, 1]);
    if (k > 1) for (const q of [all[0], all[k - 1], p]) solid.push(...vertex(add(q, [0, 0, 0.002]), [0, 0, 1], [0.75, 0.4, 0.3, 1]));
  });
  for (const one of scene.balls) sphere(one.slice(0, 3), one[3], [0.7, 0.72, 0.76, 1], solid);
  let far = 1;
  for (const [some, tint] of [[scene.boards, idle], [scene.cameras, camera]]) for (const one of some) {
    const ends = one.view.map((d) => add(one.at, scaled(d, 0.28)));
    ends.forEach((p, k) => { line(lines, one.at, p, tint); line(lines, p, ends[(k + 1) % 4], tint); });
    far = Math.max(far, Math.hypot(...one.at));
  }
  for (const one of scene.lamps) if (!one.far) far = Math.max(far, Math.hypot(...one.at));
  for (const one of scene.lamps) {
    const at = one.far ? scaled(one.at, far) : one.at;
    sphere(at, 0.045, lamp, solid);
    line(lines, at, one.far ? scaled(one.at, 0.7 * far) : NONE, [lamp[0], lamp[1], lamp[2], one.far ? 1 : 0.35]);
  }
  viewer.reach = 1.15 * far + 1;
  viewer.middle = [0, 0, 0.35 * far];
  viewer.show([["TRIANGLES", solid], ["LINES", lines]]);
}

if (told.table) {
  const table = new Table(told.table);
  ball(control("ball"), told.table, table);
  lobe(control("lobe"), told.table, table);
}
if (told.scene) setUp(control("set-up"), told.scene);
