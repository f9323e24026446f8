"use strict";
// Sliders over the iterations: pictures, caption and what a screen reader hears.
const viewers = [...document.querySelectorAll(".viewer")].map((card) => {
  const data = JSON.parse(card.querySelector("script").textContent);
  const slider = card.querySelector("input[type=range]");
  const pictures = [...card.querySelectorAll("img[data-moving]")];
  const names = pictures.map((p) => p.alt.slice(0, p.alt.lastIndexOf(",")));
  const show = (step) => {
    pictures.forEach((picture, i) => {
      picture.src = data.pictures[picture.dataset.moving][step];
      picture.alt = `${names[i]}, ${data.steps[step]}`;
    });
    card.querySelector(".step").textContent = data.steps[step] + data.words[step];
    if (!slider) return;
    slider.value = step;
    slider.setAttribute("aria-valuetext", data.steps[step] + data.words[step]);
  };
  return {card, slider, show, steps: data.steps.length};
});
for (const viewer of viewers) {
  if (!viewer.slider) continue;
  viewer.slider.addEventListener("input", () => {
    const step = Number(viewer.slider.value);
    const together = document.getElementById("together");
    const all = together && together.checked && viewer.card.closest("#images");
    for (const other of all ? viewers.filter((v) => v.card.closest("#images")) : [viewer]) other.show(step);
  });
}
// Paper shows the last iteration.
addEventListener("beforeprint", () => viewers.forEach((v) => v.show(v.steps - 1)));

// Charts: values under the pointer.
for (const chart of document.querySelectorAll("svg[data-chart]")) {
  const data = JSON.parse(chart.dataset.chart);
  const readout = chart.parentElement.querySelector(".readout");
  const box = chart.viewBox.baseVal;
  const cursor = document.createElementNS("http://www.w3.org/2000/svg", "line");
  cursor.setAttribute("class", "cursor");
  cursor.setAttribute("y1", 12);
  cursor.setAttribute("y2", data.bottom);
  cursor.style.display = "none";
  chart.append(cursor);
  const nearest = (xs, x) => xs.reduce((best, v, i) => (Math.abs(v - x) < Math.abs(xs[best] - x) ? i : best), 0);
  chart.addEventListener("pointermove", (event) => {
    const edge = chart.getBoundingClientRect();
    const across = box.width - data.left - data.right;
    const x = data.x0 + (((event.clientX - edge.left) / edge.width) * box.width - data.left) / across * (data.x1 - data.x0);
    const at = data.series[0].x[nearest(data.series[0].x, x)];
    const place = data.left + ((at - data.x0) / (data.x1 - data.x0)) * across;
    cursor.setAttribute("x1", place);
    cursor.setAttribute("x2", place);
    cursor.style.display = "";
    const values = data.series.map((s) => `${s.name ? s.name + " " : ""}${s.y[nearest(s.x, x)] ?? "–"}`);
    readout.textContent = `${data.label} ${at}: ${values.join(", ")}`;
  });
  chart.addEventListener("pointerleave", () => {
    cursor.style.display = "none";
    readout.textContent = "";
  });
}

// The view of the geometry: faces painted from the farthest to the nearest.
const canvas = document.getElementById("view");
if (canvas) {
  const scene = JSON.parse(document.getElementById("view-data").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  for (const mesh of scene.meshes) {
    mesh.points = new Float32Array(bytes(mesh.points));
    mesh.triangles = new Uint32Array(bytes(mesh.triangles));
    mesh.edges = new Uint32Array(bytes(mesh.edges));
    for (const layer in mesh.layers) mesh.layers[layer] = new Uint8Array(bytes(mesh.layers[layer]));
  }
  for (const line of scene.lines) {
    line.points = new Float32Array(bytes(line.points));
    line.pairs = new Uint32Array(bytes(line.pairs));
  }
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((v) => v / n); };
  const up = unit(scene.up);
  // Turn and height are angles about the scene's up direction; at first the camera's, from a little aside and above.
  const flat = scene.back.map((v, i) => v - dot(scene.back, up) * up[i]);
  const ahead = unit(Math.hypot(...flat) > 1e-3 ? flat : Math.abs(up[0]) < 0.9 ? cross(up, [1, 0, 0]) : cross(up, [0, 1, 0]));
  const aside = cross(up, ahead);
  const first = {turn: 0.45, height: Math.min(1.2, Math.asin(Math.max(-1, Math.min(1, dot(unit(scene.back), up)))) + 0.2), zoom: 1};
  let state = {...first};
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const channels = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  const moments = Object.keys(scene.names);
  // What colours mean: one for each moment, or the vertices' own.
  const switches = [...document.querySelectorAll("input[name=layer]")];
  const layer = () => switches.find((s) => s.checked)?.value ?? "shape";
  const draw = () => {
    const ratio = devicePixelRatio || 1;
    canvas.width = Math.round((canvas.clientWidth || 1200) * ratio);
    canvas.height = Math.round(Math.max(0.37 * canvas.width, 240 * ratio));
    const pen = canvas.getContext("2d");
    moments.forEach((moment, i) => panel(pen, moment, Math.round(i * canvas.width / moments.length), ratio));
  };
  const panel = (pen, moment, left, ratio) => {
    const [width, height] = [canvas.width / moments.length, canvas.height];
    const [c, s, ch, sh] = [Math.cos(state.turn), Math.sin(state.turn), Math.cos(state.height), Math.sin(state.height)];
    const back = up.map((v, i) => ch * (c * ahead[i] + s * aside[i]) + sh * v);
    const right = unit(cross(up, back));
    const above = cross(back, right);
    const distance = 3.6 * scene.radius / state.zoom;
    const focal = 1.7 * Math.min(width, height);
    const project = (points, i) => {
      const p = [0, 1, 2].map((k) => points[3 * i + k] - scene.middle[k]);
      const depth = distance - dot(p, back);
      const scale = depth > 0.02 * distance ? focal / depth : NaN;
      return [width / 2 + scale * dot(p, right), height / 2 - scale * dot(p, above), depth];
    };
    const stroke = (points, pairs, colour, alpha) => {
      pen.strokeStyle = colour;
      pen.globalAlpha = alpha;
      pen.beginPath();
      for (let i = 0; i < pairs.length; i += 2) {
        const [a, b] = [project(points, pairs[i]), project(points, pairs[i + 1])];
        if (isNaN(a[0]) || isNaN(b[0])) continue;
        pen.moveTo(a[0], a[1]);
        pen.lineTo(b[0], b[1]);
      }
      pen.stroke();
    };
    pen.save();
    pen.translate(left, 0);
    pen.beginPath();
    pen.rect(0, 0, width, height);
    pen.clip();
    pen.lineWidth = ratio;
    for (const line of scene.lines) stroke(line.points, line.pairs, style("--quiet"), 0.7);
    const faces = [];
    const rgb = channels(style(`--${moment}`));
    for (const mesh of scene.meshes.filter((m) => m.moment === moment)) {
      const own = mesh.layers[layer()];
      const at = Array.from({length: mesh.points.length / 3}, (_, i) => project(mesh.points, i));
      const p = (k) => [mesh.points[3 * k], mesh.points[3 * k + 1], mesh.points[3 * k + 2]];
      const minus = (u, v) => u.map((x, k) => x - v[k]);
      for (let i = 0; i < mesh.triangles.length; i += 3) {
        const [a, b, d] = [0, 1, 2].map((k) => mesh.triangles[i + k]);
        const normal = unit(cross(minus(p(b), p(a)), minus(p(d), p(a))));
        const facing = Math.abs(dot(normal, unit(back.map((v, k) => v + 0.7 * above[k] + 0.5 * right[k]))));
        const light = own ? 0.7 + 0.3 * facing : 0.35 + 0.65 * facing;  // colours that are values stay legible
        const colour = own ? [0, 1, 2].map((k) => (own[3 * a + k] + own[3 * b + k] + own[3 * d + k]) / 3) : rgb;
        const corners = [at[a], at[b], at[d]];
        if (corners.some((corner) => isNaN(corner[0]))) continue;
        faces.push({corners, depth: corners[0][2] + corners[1][2] + corners[2][2],
                    colour: `rgb(${colour.map((v) => Math.round(v * light)).join(",")})`});
      }
    }
    faces.sort((a, b) => b.depth - a.depth);
    pen.globalAlpha = 1;
    pen.lineWidth = 0.6 * ratio;
    for (const face of faces) {
      pen.beginPath();
      face.corners.forEach((corner, i) => (i ? pen.lineTo(corner[0], corner[1]) : pen.moveTo(corner[0], corner[1])));
      pen.closePath();
      pen.fillStyle = pen.strokeStyle = face.colour;
      pen.fill();
      pen.stroke();
    }
    pen.lineWidth = 1.2 * ratio;
    const edges = document.getElementById("edges");
    for (const mesh of scene.meshes.filter((m) => m.moment === "target"))
      if (moment !== "target" && edges && edges.checked) stroke(mesh.points, mesh.edges, style("--target"), 0.9);
    pen.globalAlpha = 1;
    pen.fillStyle = style("--text");
    pen.font = `${13 * ratio}px system-ui, sans-serif`;
    for (const [name, point] of scene.marks) {
      const [x, y] = project(point, 0);
      if (isNaN(x) || x < 0 || y < 0 || x > width || y > height) continue;
      pen.beginPath();
      pen.arc(x, y, 3 * ratio, 0, 7);
      pen.fill();
      pen.fillText(name, x + 7 * ratio, y + 4 * ratio);
    }
    pen.font = `600 ${15 * ratio}px system-ui, sans-serif`;
    pen.fillText(scene.names[moment], 12 * ratio, 24 * ratio);
    pen.restore();
  };
  const turn = (across, upwards) => {
    state.turn += across;
    state.height = Math.max(-1.5, Math.min(1.5, state.height + upwards));
    draw();
  };
  const zoom = (factor) => {
    state.zoom = Math.max(0.1, Math.min(30, state.zoom * factor));
    draw();
  };
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
    "+": () => zoom(1.2), "=": () => zoom(1.2), "-": () => zoom(1 / 1.2),
    Home: () => { state = {...first}; draw(); },
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey) return;
    keys[event.key]();
    event.preventDefault();
  });
  let held = null;
  canvas.addEventListener("pointerdown", (event) => { held = event; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    turn(-(event.clientX - held.clientX) * 0.01, (event.clientY - held.clientY) * 0.01);
    held = event;
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
  document.getElementById("edges")?.addEventListener("change", draw);
  const recolour = () => {
    for (const scale of document.querySelectorAll("[data-layer]")) scale.hidden = scale.dataset.layer !== layer();
    draw();
  };
  for (const one of switches) one.addEventListener("change", recolour);
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  recolour();
}
