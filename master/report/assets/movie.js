"use strict";
// Plays the run: the line with its deformation magnified, the pantographs, and the contact force below them.
(function () {
  const source = document.getElementById("movie-data");
  if (!source) return;
  const movie = JSON.parse(source.textContent);
  const canvas = document.getElementById("movie");
  const by = (id) => document.getElementById(id);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const integers = (text) => new Int16Array(bytes(text).buffer);
  const [metre, newton] = movie.units;
  const sections = movie.sections.map((s) => Object.assign({}, s, {
    displacement: integers(s.displacement), slack: bytes(s.slack), rowBytes: Math.ceil(s.droppers[0].length / 8),
  }));
  const riders = movie.riders.map((r) => ({
    name: r.name, section: bytes(r.section), x: new Float32Array(bytes(r.x).buffer), strip: integers(r.strip), touching: bytes(r.touching),
    force: integers(r.force), filtered: integers(r.filtered),
  }));
  const seconds = movie.end - movie.start, last = movie.count - 1;
  const low = Math.min(...sections.flatMap((s) => s.wire[1])), high = Math.max(...sections.flatMap((s) => s.messenger[1]));
  let frame = 0, playing = false, before = 0;

  function interpolate(xs, ys, x) {
    let a = 0, b = xs.length - 1;
    if (x <= xs[0]) return ys[0];
    if (x >= xs[b]) return ys[b];
    while (b - a > 1) { const m = (a + b) >> 1; if (xs[m] <= x) a = m; else b = m; }
    return ys[a] + (ys[b] - ys[a]) * (x - xs[a]) / (xs[b] - xs[a] || 1);
  }
  const bit = (data, i) => (data[i >> 3] >> (7 - (i & 7))) & 1;
  const rest = (s, x) => interpolate(s.wire[0], s.wire[1], x);

  function between(values, at) {
    const i = Math.min(last, Math.floor(at)), k = Math.min(last, i + 1);
    return values[i] + (values[k] - values[i]) * (at - i);
  }

  // Known displacements at this moment, sorted: recorded points and the contacts.
  function known(s, index, at) {
    const i = Math.min(last, Math.floor(at)), k = Math.min(last, i + 1), n = s.points.length, w = at - i, d = s.displacement;
    const list = s.points.map((x, j) => [x, metre * (d[i * n + j] * (1 - w) + d[k * n + j] * w)]);
    for (const r of riders) if (r.section[i] === index && bit(r.touching, i)) list.push([between(r.x, at), metre * between(r.strip, at)]);
    list.sort((p, q) => p[0] - q[0]);
    return [list.map((p) => p[0]), list.map((p) => p[1])];
  }

  function view(at, width) {
    const xs = riders.map((r) => between(r.x, at)), middle = (Math.min(...xs) + Math.max(...xs)) / 2;
    const half = Math.max(width < 600 ? 40 : 80, (Math.max(...xs) - Math.min(...xs)) / 2 + 30);
    return [middle - half, middle + half];
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    }
    const g = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue("--" + name).trim();
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    g.font = "12px system-ui, sans-serif";
    const left = 46, right = width - 8, [x0, x1] = view(frame, width);
    const px = (x) => left + (right - left) * (x - x0) / (x1 - x0);
    line(g, px, [x0, x1], 0.56 * height, colour);
    force(g, px, [x0, x1], [0.62 * height, height - 24], colour, [left, right]);
    g.fillStyle = colour("ink");
    g.textAlign = "left";
    const time = movie.start + seconds * frame / last;
    g.fillText("t = " + time.toFixed(2) + " s", left + 4, 0.56 * height - 6);
    by("movie-clock").textContent = time.toFixed(2) + " s, " + riders.map((r) =>
      (newton * r.force[Math.round(frame)]).toFixed(0) + " N").join(", ");
  }

  function line(g, px, [x0, x1], bottom, colour) {
    const magnified = Number(by("movie-scale").value);
    const floor = low - 0.9, top = high + 0.25, pz = (z) => bottom - (bottom - 8) * (z - floor) / (top - floor);
    sections.forEach((s, index) => section(g, px, pz, s, index, [x0, x1, top, magnified], colour));
    for (const r of riders) {
      const x = between(r.x, frame), on = sections[r.section[Math.min(last, Math.floor(frame))]];
      const z = rest(on, x) + magnified * metre * between(r.strip, frame), foot = pz(floor);
      const head = pz(z), knee = (head + foot) / 2, reach = 16;
      stroke(g, colour("ink"), 2, [], () => {
        g.moveTo(px(x) - 4, foot); g.lineTo(px(x) - reach, knee); g.lineTo(px(x), head + 5);
        g.moveTo(px(x), head + 5); g.lineTo(px(x), head);
      });
      stroke(g, colour("slack"), 4, [], () => { g.moveTo(px(x) - 8, head); g.lineTo(px(x) + 8, head); });
    }
    g.fillStyle = colour("soft");
    g.textAlign = "right";
    g.fillText("deformation \u00d7 " + magnified, px(x1) - 4, bottom - 6);
  }

  function section(g, px, pz, s, index, [x0, x1, top, magnified], colour) {
    const [xs, ds] = known(s, index, frame), row = Math.round(frame) * s.rowBytes;
    const moved = (x) => rest(s, x) + magnified * interpolate(xs, ds, x);
    const a = Math.max(x0, s.wire[0][0]), b = Math.min(x1, s.wire[0][s.wire[0].length - 1]);
    if (b <= a) return;
    for (const x of s.supports) if (x > x0 && x < x1) {
      stroke(g, colour("mark"), 2.5, [], () => { g.moveTo(px(x), pz(top)); g.lineTo(px(x), pz(rest(s, x) + 0.35)); });
    }
    s.droppers[0].forEach((x, j) => {
      if (x < x0 || x > x1) return;
      const isSlack = bit(s.slack.subarray(row, row + s.rowBytes), j);
      stroke(g, colour(isSlack ? "slack" : "mark"), isSlack ? 2 : 1, isSlack ? [3, 3] : [], () => {
        g.moveTo(px(x), pz(moved(x))); g.lineTo(px(x), pz(s.droppers[2][j]));
      });
    });
    stroke(g, colour("messenger"), 1.5, [], () => path(g, [a, b], (x) => interpolate(s.messenger[0], s.messenger[1], x), px, pz));
    stroke(g, colour("messenger"), 1, [2, 3], () => path(g, [a, b], (x) => rest(s, x), px, pz));
    stroke(g, colour("wire"), 2.4, [], () => path(g, [a, b], moved, px, pz));
  }

  function force(g, px, [x0, x1], [top, bottom], colour, [left, right]) {
    const most = 50 * Math.ceil(1.05 * Math.max(200, ...riders.map((r) => newton * limits(r))) / 50);
    const py = (f) => bottom - (bottom - top) * f / most;
    g.fillStyle = colour("soft");
    g.textAlign = "right";
    for (let f = 0; f <= most; f += 100) {
      g.fillText(String(f), left - 6, py(f) + 4);
      stroke(g, colour("rule"), 1, [], () => { g.moveTo(left, py(f)); g.lineTo(right, py(f)); });
    }
    g.textAlign = "left";
    g.fillText("contact force [N]", left + 4, top - 4);
    g.textAlign = "center";
    for (let x = 20 * Math.ceil(x0 / 20); px(x) < right - 14; x += 20) g.fillText(String(x), px(x), bottom + 14);
    g.textAlign = "right";
    g.fillText("over track position [m]", right, top - 4);
    riders.forEach((r, i) => {
      trace(g, r, r.force, px, py, x0, colour("raw"), 1, 0, []);
      trace(g, r, r.filtered, px, py, x0, colour(i % 2 ? "slack" : "wire"), 2.4, -30000, i % 2 ? [7, 4] : []);
    });
  }
  function limits(r) {
    if (r.most === undefined) { r.most = 0; for (const f of r.filtered) if (f > r.most) r.most = f; }
    return r.most;
  }
  function trace(g, r, values, px, py, x0, colour, width, least, dash) {
    const end = Math.floor(frame);
    stroke(g, colour, width, dash, () => {
      let pen = false;
      for (let i = 0; i <= end; i++) {
        if (r.x[i] < x0 || values[i] < least) { pen = false; continue; }
        if (pen) g.lineTo(px(r.x[i]), py(newton * values[i])); else g.moveTo(px(r.x[i]), py(newton * values[i]));
        pen = true;
      }
    });
  }
  function path(g, [x0, x1], height, px, pz) {
    const n = 240;
    for (let i = 0; i <= n; i++) { const x = x0 + (x1 - x0) * i / n; if (i) g.lineTo(px(x), pz(height(x))); else g.moveTo(px(x), pz(height(x))); }
  }
  function stroke(g, colour, width, dash, body) {
    g.strokeStyle = colour; g.lineWidth = width; g.setLineDash(dash); g.beginPath(); body(); g.stroke(); g.setLineDash([]);
  }

  function tick(now) {
    if (!playing) return;
    const rate = Number(by("movie-speed").value), passed = Math.min(0.1, (now - before) / 1000);
    before = now;
    frame = Math.min(last, frame + passed * rate * last / seconds);
    by("movie-seek").value = frame;
    if (frame >= last) play(false);
    draw();
    if (playing) requestAnimationFrame(tick);
  }
  function play(wanted) {
    playing = wanted;
    by("movie-play").textContent = playing ? "pause" : "play";
    if (!playing) return;
    if (frame >= last) frame = 0;
    before = performance.now();
    requestAnimationFrame(tick);
  }
  by("movie-seek").max = last;
  by("movie-seek").step = "any";
  frame = Math.round(last * Number(canvas.dataset.begin || 0));
  by("movie-seek").value = frame;
  by("movie-play").addEventListener("click", () => play(!playing));
  by("movie-seek").addEventListener("input", (e) => { frame = Number(e.target.value); draw(); });
  by("movie-scale").addEventListener("input", draw);
  window.addEventListener("resize", draw);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  window.addEventListener("beforeprint", draw);
  draw();
  canvas.dataset.drawn = "yes";
})();
