
"use strict";
(async () => {
  const stage = document.getElementById("stage");
  if (!stage || !("DecompressionStream" in window)) return; // the still picture stays
  const canvas = document.getElementById("view");
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) return;
  const facts = JSON.parse(document.getElementById("facts").textContent);

  // --- The surface: see scene.py for the layout of the data.
  const text = atob(document.getElementById("data").textContent);
  const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(inflated).arrayBuffer();
  const n = facts.vertices;
  let at = 0;
  const columns = (Kind, count) => {
    const size = Kind.BYTES_PER_ELEMENT;
    const found = new Kind(n * count);
    for (let k = 0; k < count; k++, at += n * size) {
      const differences = new Kind(buffer.slice(at, at + n * size));
      const sum = new Kind(1); // wraps around as the differences do
      for (let i = 0; i < n; i++) {
        sum[0] += differences[i];
        found[i * count + k] = sum[0];
      }
    }
    return found;
  };
  const places = columns(Uint16Array, 3);
  const normals = columns(Int8Array, 3);
  const colour = columns(Uint8Array, 3);
  const layers = [colour, new Uint8Array(3 * n).fill(190)];
  for (let k = 0; k < facts.levels; k++) {
    const levels = columns(Uint8Array, 1);
    const painted = new Uint8Array(3 * n);
    for (let i = 0; i < n; i++) {
      for (let c = 0; c < 3; c++) painted[3 * i + c] = facts.colours[3 * levels[i] + c];
    }
    layers.push(painted);
  }
  const corners = new Uint32Array(buffer.slice(at));
  for (let i = 1; i < corners.length; i++) corners[i] += corners[i - 1];
  const points = new Float32Array(3 * n);
  for (let i = 0; i < 3 * n; i++) points[i] = facts.low[i % 3] + facts.scale[i % 3] * places[i];

  // --- The program of the graphics card: light from the eye and from the upper left, on both sides.
  const compiled = (kind, source) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compiled(gl.VERTEX_SHADER, `#version 300 es
    layout(location = 0) in vec3 place; layout(location = 1) in vec3 normal; layout(location = 2) in vec3 colour;
    uniform mat4 view, lens; out vec3 seen, turned; out vec3 eye;
    void main() {
      vec4 p = view * vec4(place, 1.0); gl_Position = lens * p;
      eye = -p.xyz; turned = mat3(view) * normal; seen = colour;
    }`));
  gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float; in vec3 seen, turned; in vec3 eye; out vec4 shade;
    void main() {
      vec3 e = normalize(eye), m = turned;
      if (dot(m, m) < 0.01) m = e;
      m = normalize(m); if (dot(m, e) < 0.0) m = -m;
      float light = 0.28 + 0.42 * dot(m, e) + 0.42 * max(dot(m, normalize(vec3(-0.5, 0.6, 0.6))), 0.0);
      shade = vec4(seen * min(light, 1.15), 1.0);
    }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
  gl.useProgram(program);
  const fill = (target, data) => {
    const held = gl.createBuffer();
    gl.bindBuffer(target, held);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return held;
  };
  const attribute = (place, data, kind) => {
    const held = fill(gl.ARRAY_BUFFER, data);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, kind, kind !== gl.FLOAT, 0, 0);
    return held;
  };
  attribute(0, points, gl.FLOAT);
  attribute(1, normals, gl.BYTE);
  const painted = attribute(2, colour, gl.UNSIGNED_BYTE);
  fill(gl.ELEMENT_ARRAY_BUFFER, corners);
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(0.965, 0.969, 0.976, 1);

  // --- The eye: turned by two angles about a point of the surface, at a distance.
  const FIELD = 0.6; // rad
  let eye;
  const home = () => {
    eye = { yaw: 0.35, pitch: 0.25, far: 0.92 * facts.radius / Math.sin(FIELD / 2), about: [...facts.centre] };
  };
  const axes = () => {
    const [cy, sy, cp, sp] = [Math.cos(eye.yaw), Math.sin(eye.yaw), Math.cos(eye.pitch), Math.sin(eye.pitch)];
    return [[cy, 0, sy], [sp * sy, cp, -sp * cy], [-cp * sy, sp, cp * cy]]; // right, up, backwards
  };
  let waiting = false;
  const draw = () => {
    waiting = false;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const turned = axes();
    const view = new Float32Array(16);
    for (let r = 0; r < 3; r++) {
      for (let c = 0; c < 3; c++) view[4 * c + r] = turned[r][c];
      view[12 + r] = -turned[r].reduce((sum, value, c) => sum + value * eye.about[c], 0) - (r === 2 ? eye.far : 0);
    }
    view[15] = 1;
    const [near, most] = [Math.max(eye.far - 6 * facts.radius, 0.01 * eye.far), eye.far + 6 * facts.radius];
    const reach = 1 / Math.tan(FIELD / 2);
    const shape = Math.min(1, width / height); // the whole surface, also in a narrow window
    const lens = new Float32Array(16);
    lens[0] = reach * shape * height / width;
    lens[5] = reach * shape;
    lens[10] = (near + most) / (near - most);
    lens[11] = -1;
    lens[14] = 2 * near * most / (near - most);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "view"), false, view);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "lens"), false, lens);
    gl.drawElements(gl.TRIANGLES, corners.length, gl.UNSIGNED_INT, 0);
  };
  const redraw = () => {
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  };
  const turn = (x, y) => {
    eye.yaw += x;
    eye.pitch = Math.max(-1.55, Math.min(1.55, eye.pitch + y));
    redraw();
  };
  const move = (x, y) => {
    const [right, up] = axes();
    const length = 2 * eye.far * Math.tan(FIELD / 2) / canvas.clientHeight; // of a pixel, mm
    for (let k = 0; k < 3; k++) eye.about[k] += length * (y * up[k] - x * right[k]);
    redraw();
  };
  const zoom = (by) => {
    eye.far = Math.max(0.05 * facts.radius, Math.min(40 * facts.radius, eye.far * Math.exp(by)));
    redraw();
  };

  // --- Mouse, fingers and keys.
  const held = new Map();
  const spread = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", (event) => {
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = held.get(event.pointerId);
    if (!last) return;
    const [x, y] = [event.clientX - last.x, event.clientY - last.y];
    const before = held.size === 2 ? spread() : 0;
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (held.size === 2) zoom(Math.log(before / Math.max(spread(), 1)));
    else if (event.shiftKey || event.buttons & 6) move(x, y);
    else turn(0.008 * x, 0.008 * y);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => held.delete(event.pointerId));
  }
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(event.deltaY * (event.deltaMode ? 0.03 : 0.001));
  }, { passive: false });
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, -0.1),
    ArrowDown: () => turn(0, 0.1), "+": () => zoom(-0.1), "-": () => zoom(0.1),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });
  canvas.addEventListener("webglcontextlost", () => {
    canvas.hidden = document.getElementById("controls").hidden = true;
    stage.classList.remove("turns");
  });
  const buttons = document.querySelectorAll("button[data-layer]");
  const choose = (layer) => {
    buttons.forEach((button, k) => button.setAttribute("aria-pressed", k === layer));
    gl.bindBuffer(gl.ARRAY_BUFFER, painted);
    gl.bufferData(gl.ARRAY_BUFFER, layers[layer], gl.STATIC_DRAW);
    redraw();
  };
  buttons.forEach((button, k) => button.addEventListener("click", () => choose(k)));
  document.getElementById("home").addEventListener("click", () => { home(); eye.yaw = eye.pitch = 0; redraw(); });
  new ResizeObserver(redraw).observe(canvas);
  home();
  canvas.hidden = document.getElementById("controls").hidden = false;
  stage.classList.add("turns");
  choose(0);
})();
