// The 3-D view of a report page: convex polygons painted with their values, turned with mouse, touch or keys, picked by
// a click. Arrays come from the page's data scripts; nothing is loaded. WebGL 1, two programs.
"use strict";
(() => {
  const byId = (id) => document.getElementById(id);
  const record = JSON.parse(byId("data-record").textContent);
  const array = (name, Type) => {
    const node = byId("data-" + name);
    if (!node) return null;
    const text = atob(node.textContent);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return new Type(bytes.buffer);
  };
  const points = array("points", Float32Array);
  const starts = array("starts", Uint32Array);
  const corners = array("corners", Uint32Array);
  const elements = array("elements", Uint32Array);
  const faces = array("faces", Uint32Array);
  const groups = array("groups", Uint32Array);
  const materials = array("materials", Uint32Array);
  const areas = array("areas", Float32Array);
  const radiosity = array("radiosity", Float32Array);
  const irradiance = array("irradiance", Float32Array);
  const errors = array("errors", Float32Array);
  const count = faces.length;

  const canvas = byId("canvas");
  const gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) {
    byId("viewer").textContent = "This browser shows no WebGL: the 3-D view is left out. All else on this page is here.";
    return;
  }

  // ---- Vectors ----
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const along = (a, b, t) => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];
  const unit = (a) => along([0, 0, 0], a, 1 / Math.hypot(a[0], a[1], a[2]));

  // ---- Programs ----
  const program = (vertexText, fragmentText, names) => {
    const whole = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertexText], [gl.FRAGMENT_SHADER, fragmentText]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(whole, shader);
    }
    gl.linkProgram(whole);
    if (!gl.getProgramParameter(whole, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(whole));
    const places = {};
    for (const name of names) {
      places[name] = name[0] === "u" ? gl.getUniformLocation(whole, name) : gl.getAttribLocation(whole, name);
    }
    return { whole, places };
  };
  const surface = program(
    "attribute vec3 a_place; attribute vec4 a_colour; uniform mat4 u_matrix; varying vec4 v_colour;" +
      "void main() { gl_Position = u_matrix * vec4(a_place, 1.0); v_colour = a_colour; }",
    "precision mediump float; varying vec4 v_colour; void main() { gl_FragColor = v_colour; }",
    ["a_place", "a_colour", "u_matrix"]);
  // Edges of polygons that turn their back are moved out of sight.
  const lines = program(
    "attribute vec3 a_place; attribute vec3 a_normal; uniform mat4 u_matrix; uniform vec3 u_eye;" +
      "void main() { gl_Position = dot(a_normal, u_eye - a_place) > 0.0 ? u_matrix * vec4(a_place, 1.0) : vec4(2.0, 2.0, 2.0, 1.0); }",
    "precision mediump float; uniform vec4 u_colour; void main() { gl_FragColor = u_colour; }",
    ["a_place", "a_normal", "u_matrix", "u_eye", "u_colour"]);

  // ---- Polygons as triangles and edges ----
  let triangles = 0;
  for (let i = 0; i < count; i++) triangles += starts[i + 1] - starts[i] - 2;
  const places = new Float32Array(9 * triangles);
  const pointOf = new Uint32Array(3 * triangles);
  const polygonOf = new Uint32Array(3 * triangles);
  const numbers = new Uint8Array(12 * triangles);
  const edgePlaces = new Float32Array(6 * corners.length);
  const edgeNormals = new Float32Array(6 * corners.length);
  const at = (point) => points.subarray(3 * point, 3 * point + 3);
  let vertex = 0, edge = 0;
  for (let i = 0; i < count; i++) {
    const [first, end] = [starts[i], starts[i + 1]];
    let normal = [0, 0, 0];
    for (let k = first + 1; k + 1 < end; k++) {
      const fan = [corners[first], corners[k], corners[k + 1]];
      const [a, b, c] = fan.map(at);
      normal = along(normal, cross(along(b, a, -1), along(c, a, -1)), 1);
      for (const point of fan) {
        places.set(at(point), 3 * vertex);
        pointOf[vertex] = point;
        polygonOf[vertex] = i;
        numbers.set([(i + 1) & 255, ((i + 1) >> 8) & 255, ((i + 1) >> 16) & 255, 255], 4 * vertex);
        vertex++;
      }
    }
    for (let k = first; k < end; k++) {
      for (const point of [corners[k], corners[k + 1 < end ? k + 1 : first]]) {
        edgePlaces.set(at(point), 3 * edge);
        edgeNormals.set(normal, 3 * edge);
        edge++;
      }
    }
  }
  const buffer = (data) => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return made;
  };
  const placeBuffer = buffer(places);
  const numberBuffer = buffer(numbers);
  const edgeBuffer = buffer(edgePlaces);
  const normalBuffer = buffer(edgeNormals);
  const colourBuffer = gl.createBuffer();

  // ---- Paint ----
  const luminance = (values, i) => dot(record.luminance, values.subarray(3 * i, 3 * i + 3));
  const toByte = (x) => {
    const y = Math.min(1, Math.max(0, x));
    return Math.round(255 * (y <= 0.0031308 ? 12.92 * y : 1.055 * Math.pow(y, 1 / 2.4) - 0.055));
  };
  // Values at the points: means over the polygons around by area. Points are shared only where light does not jump.
  const atPoints = (values) => {
    const sums = new Float64Array(points.length), weights = new Float64Array(points.length / 3);
    for (let i = 0; i < count; i++) {
      for (let k = starts[i]; k < starts[i + 1]; k++) {
        const point = corners[k];
        weights[point] += areas[i];
        for (let c = 0; c < 3; c++) sums[3 * point + c] += areas[i] * values[3 * i + c];
      }
    }
    return sums.map((sum, k) => (weights[Math.floor(k / 3)] > 0 ? sum / weights[Math.floor(k / 3)] : 0));
  };
  const paintSelect = byId("paint"), exposure = byId("exposure"), smooth = byId("smooth"), edges = byId("edges");
  const legend = byId("legend");
  const paint = () => {
    const kind = paintSelect.value;
    const scale = record.paints.find((one) => one.name === kind);
    const isSmooth = smooth.checked && elements.length > 0 && kind !== "errors";
    const values = { radiosity, irradiance, errors }[kind];
    const shown = isSmooth ? atPoints(values) : values;
    const items = shown.length / 3;
    const colours = new Uint8Array(3 * items);
    // As shade-tool's pictures are: the mean becomes middle grey, and what few surfaces are brighter than becomes white.
    const gain = Math.pow(2, Number(exposure.value)) * record.gain;
    const white = Math.max(1, gain * record.white);
    const toned = (x) => x * (1 + x / (white * white)) / (1 + x);
    for (let i = 0; i < items; i++) {
      if (scale) {
        const part = (luminance(shown, i) - scale.low) / (scale.high - scale.low);
        const step = Math.round((record.colours.length - 1) * Math.min(1, Math.max(0, part)));
        colours.set(record.colours[step], 3 * i);
      } else {
        for (let c = 0; c < 3; c++) colours[3 * i + c] = toByte(toned(gain / Math.PI * shown[3 * i + c]));
      }
    }
    const data = new Uint8Array(4 * vertex);
    const index = isSmooth ? pointOf : polygonOf;
    for (let k = 0; k < vertex; k++) {
      const i = 3 * index[k];
      data[4 * k] = colours[i];
      data[4 * k + 1] = colours[i + 1];
      data[4 * k + 2] = colours[i + 2];
      data[4 * k + 3] = 255;
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, colourBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    const stops = Number(exposure.value);
    byId("stops").textContent = (stops < 0 ? "−" : "+") + Math.abs(stops) + " stops";
    byId("exposure-label").hidden = Boolean(scale);
    byId("exposure-label").style.display = scale ? "none" : "";
    showLegend(scale);
    draw();
  };
  const made = (name, text, parent) => {
    const node = document.createElement(name);
    node.textContent = text;
    parent.append(node);
    return node;
  };
  const showLegend = (scale) => {
    legend.replaceChildren();
    legend.hidden = !scale;
    if (!scale) return;
    made("div", scale.title, legend);
    const ramp = made("div", "", legend);
    ramp.className = "ramp";
    const stops = record.colours.filter((_, k) => k % 15 === 0).map((colour) => `rgb(${colour.join(",")})`);
    ramp.style.background = `linear-gradient(to right, ${stops.join(",")})`;
    const marks = made("div", "", legend);
    marks.className = "marks";
    for (const [part, text] of scale.marks) made("span", text, marks).style.left = 100 * part + "%";
  };

  // ---- Eye: it goes round a target, up stays up ----
  const start = record.camera;
  const axis = [0, 1, 2].reduce((best, k) => (Math.abs(start.up[k]) > Math.abs(start.up[best]) ? k : best), 0);
  const up = [0, 0, 0];
  up[axis] = Math.sign(start.up[axis]) || 1;
  const north = unit([up[1] || up[2] ? 1 : 0, 0, up[0] ? 1 : 0]);
  const east = cross(north, up);
  const halfHeight = start.half_height || Math.tan(Math.PI / 9);
  let target, distance, turn, tilt;
  const reset = () => {
    const toMiddle = -dot(start.eye, start.forward);
    distance = Math.max(toMiddle, 0.1 * record.radius);
    target = along(start.eye, start.forward, distance);
    tilt = Math.asin(Math.min(1, Math.max(-1, -dot(start.forward, up))));
    turn = Math.atan2(-dot(start.forward, east), -dot(start.forward, north));
  };
  const eyeNow = () => {
    const level = along(along([0, 0, 0], north, Math.cos(turn)), east, Math.sin(turn));
    const back = along(along([0, 0, 0], level, Math.cos(tilt)), up, Math.sin(tilt));
    const right = unit(cross(up, back));
    return { eye: along(target, back, distance), back, right, above: cross(back, right) };
  };
  // Columns of the projection of a view through a pinhole, wide enough for the shorter side.
  const matrixFor = ({ eye, back, right, above }) => {
    const aspect = canvas.width / canvas.height;
    const high = halfHeight * Math.max(1, 1 / aspect);
    const reach = Math.hypot(...eye) + 1.01 * record.radius;
    const near = Math.max(Math.hypot(...eye) - 1.01 * record.radius, 2e-3 * record.radius);
    const [sx, sy] = [1 / (high * aspect), 1 / high];
    const [za, zb] = [-(reach + near) / (reach - near), (-2 * reach * near) / (reach - near)];
    const rows = [[...right, -dot(right, eye)], [...above, -dot(above, eye)], [...back, -dot(back, eye)]];
    const matrix = new Float32Array(16);
    for (let k = 0; k < 4; k++) {
      matrix.set([sx * rows[0][k], sy * rows[1][k], za * rows[2][k] + (k === 3 ? zb : 0), -rows[2][k]], 4 * k);
    }
    return matrix;
  };

  // ---- Drawing ----
  let selected = -1, waiting = false;
  const attribute = (place, data, size, type, normalised) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, data);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, normalised, 0, 0);
  };
  const drawSurface = (colours, matrix) => {
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.useProgram(surface.whole);
    gl.uniformMatrix4fv(surface.places.u_matrix, false, matrix);
    attribute(surface.places.a_place, placeBuffer, 3, gl.FLOAT, false);
    attribute(surface.places.a_colour, colours, 4, gl.UNSIGNED_BYTE, true);
    gl.drawArrays(gl.TRIANGLES, 0, vertex);
  };
  const drawLines = (matrix, eye, colour, first, length) => {
    gl.useProgram(lines.whole);
    gl.uniformMatrix4fv(lines.places.u_matrix, false, matrix);
    gl.uniform3fv(lines.places.u_eye, eye);
    gl.uniform4fv(lines.places.u_colour, colour);
    attribute(lines.places.a_place, edgeBuffer, 3, gl.FLOAT, false);
    attribute(lines.places.a_normal, normalBuffer, 3, gl.FLOAT, false);
    gl.drawArrays(gl.LINES, first, length);
  };
  const render = () => {
    waiting = false;
    const view = eyeNow(), matrix = matrixFor(view);
    gl.clearColor(30 / 255, 33 / 255, 36 / 255, 1);
    drawSurface(colourBuffer, matrix);
    if (edges.checked) {
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      drawLines(matrix, view.eye, [1, 1, 1, 0.4], 0, edge);
      gl.disable(gl.BLEND);
    }
    if (selected >= 0) {
      gl.disable(gl.DEPTH_TEST);
      drawLines(matrix, view.eye, [1, 0.62, 0.1, 1], 2 * starts[selected], 2 * (starts[selected + 1] - starts[selected]));
    }
  };
  const draw = () => {
    if (!waiting) requestAnimationFrame(render);
    waiting = true;
  };

  // ---- Picking: the polygons drawn once more, each in the colour of its number ----
  const pick = (x, y) => {
    const frame = gl.createFramebuffer(), texture = gl.createTexture(), depth = gl.createRenderbuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, canvas.width, canvas.height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, canvas.width, canvas.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    gl.clearColor(0, 0, 0, 0);
    drawSurface(numberBuffer, matrixFor(eyeNow()));
    const pixel = new Uint8Array(4);
    gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    gl.deleteTexture(texture);
    gl.deleteRenderbuffer(depth);
    return pixel[0] + (pixel[1] << 8) + (pixel[2] << 16) - 1;
  };
  const digits = (x) => (Number.isFinite(x) ? String(Number(x.toPrecision(5))).replace("-", "−") : "∞");
  const triple = (values, i) => Array.from(values.subarray(3 * i, 3 * i + 3), digits).join("  ");
  const tell = (i) => {
    selected = i;
    const panel = byId("picked");
    panel.replaceChildren();
    if (i < 0) {
      made("p", "Nothing there. Click a surface to read its values.", panel);
      draw();
      return;
    }
    const table = made("tbody", "", made("table", "", panel));
    const row = (name, value) => {
      const line = made("tr", "", table);
      made("th", name, line).scope = "row";
      made("td", value, line);
    };
    if (elements.length) row("element", String(elements[i]));
    row("face", String(faces[i]));
    row("group", record.groups[groups[i]]);
    row("material", record.materials[materials[i]]);
    row("area", digits(areas[i]) + " " + record.unit + "²");
    row("B, W m⁻²", triple(radiosity, i));
    row("H, W m⁻²", triple(irradiance, i));
    row("illuminance", digits(record.efficacy * luminance(irradiance, i)) + " lx");
    row("error of B, ± W m⁻²", errors ? triple(errors, i) : "not computed");
    draw();
  };

  // ---- Hands ----
  const turnBy = (dx, dy) => {
    turn -= dx;
    tilt = Math.min(1.55, Math.max(-1.55, tilt + dy));
    draw();
  };
  const moveBy = (dx, dy) => {
    const { right, above } = eyeNow();
    target = along(along(target, right, -dx * distance), above, dy * distance);
    draw();
  };
  const zoomBy = (factor) => {
    distance = Math.min(40 * record.radius, Math.max(0.01 * record.radius, distance * factor));
    draw();
  };
  const pointers = new Map();
  let travelled = 0, wasTwo = false;
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size === 1) [travelled, wasTwo] = [0, false];
    else wasTwo = true;
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    const before = pointers.size === 2 ? spread() : 0;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    travelled += Math.abs(dx) + Math.abs(dy);
    const size = canvas.clientHeight;
    if (pointers.size === 2) {
      zoomBy(before / spread());
      moveBy((dx * halfHeight) / size, (dy * halfHeight) / size);
    } else if (event.shiftKey || event.buttons & 6) {
      moveBy((2 * dx * halfHeight) / size, (2 * dy * halfHeight) / size);
    } else {
      turnBy((4 * dx) / size, (4 * dy) / size);
    }
  });
  const release = (event) => {
    const known = pointers.delete(event.pointerId);
    if (!known || event.type !== "pointerup" || wasTwo || travelled > 5 || event.button !== 0) return;
    const box = canvas.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * canvas.width);
    const y = Math.floor((1 - (event.clientY - box.top) / box.height) * canvas.height);
    tell(pick(x, y));
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomBy(Math.exp(Math.sign(event.deltaY) * Math.min(0.2, Math.abs(event.deltaY) * 2e-3)));
  }, { passive: false });
  const keys = {
    ArrowLeft: () => turnBy(-0.1, 0),
    ArrowRight: () => turnBy(0.1, 0),
    ArrowUp: () => turnBy(0, 0.1),
    ArrowDown: () => turnBy(0, -0.1),
    "+": () => zoomBy(0.9),
    "=": () => zoomBy(0.9),
    "-": () => zoomBy(1.1),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });
  byId("reset").addEventListener("click", () => {
    reset();
    draw();
  });
  edges.addEventListener("change", draw);
  for (const control of [paintSelect, smooth, exposure]) control.addEventListener("input", paint);

  const fit = () => {
    const sharpness = Math.min(2, window.devicePixelRatio || 1);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * sharpness));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * sharpness));
    draw();
  };
  new ResizeObserver(fit).observe(canvas);
  reset();
  fit();
  paint();
})();
