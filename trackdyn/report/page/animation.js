// The loop in motion: recorded configurations on a canvas, with forces and touched areas.
(function animation() {
  const canvas = $("scene");
  if (!canvas) return;
  const G = DATA.geometry, context = canvas.getContext("2d");
  const AREA = ["#0072b2", "#d55e00", "#009e73", "#b8860b", "#aa4499"]; // of area j and of 11 - j
  const SIDES = ["left", "right", "ring"];
  // length of the arrow of the force of the scale bar, m; no arrow is longer than that of the largest force
  const BAR = { loop: 0.15, sprocket: 0.13, follow: 0.07 };
  const loaded = new Map();
  let run = null, index = 0, playing = false, last = 0, due = 0;

  function load(picture) {
    if (!loaded.has(picture))
      loaded.set(picture, { ...picture, frame: summed(picture) });
    return loaded.get(picture);
  }

  // Places and angles from their second differences in time
  function summed({ frame, start, frames, unit }) {
    const out = new Float32Array(frame.length);
    start.forEach((value, k) => {
      for (let i = 0, rate = 0; i < frames; i++) {
        rate += frame[k * frames + i];
        value += rate;
        out[i * start.length + k] = value * unit;
      }
    });
    return out;
  }

  function state(i) {
    const width = run.bodies + 3, f = run.frame.subarray(i * width, (i + 1) * width);
    const pins = [[f[0], f[1]]];
    for (let b = 0; b < run.bodies; b++) {
      const length = b % 2 ? G.connector : G.link, [x, y] = pins[b];
      pins.push([x + length * Math.cos(f[2 + b]), y + length * Math.sin(f[2 + b])]);
    }
    return { pins, angle: (b) => f[2 + b], sprocket: f[width - 1] };
  }

  // Points of the frame of groove k (1 to m) in the inertial frame
  function ofGroove(now, k, [x, y]) {
    const beta = now.sprocket + ((2 * k - 1) * Math.PI) / G.teeth - Math.PI / 2, c = Math.cos(beta), s = Math.sin(beta);
    return [G.sprocket[0] + c * x - s * y, G.sprocket[1] + s * x + c * y];
  }

  function size() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), box = canvas.getBoundingClientRect();
    canvas.width = Math.round(box.width * ratio);
    canvas.height = Math.round(box.height * ratio);
    return ratio;
  }

  // The connector that stands before the sprocket at the beginning: it passes while the run lasts.
  function followed() {
    const pins = state(0).pins, before = [G.sprocket[0] - 0.5 * G.addendum, G.sprocket[1] + G.addendum];
    const away = (b) => Math.hypot(pins[b][0] - before[0], pins[b][1] - before[1]);
    let best = 1;
    for (let b = 3; b < run.bodies; b += 2) if (away(b) < away(best)) best = b;
    return best;
  }

  function window_of(now) {
    if ($("view").value === "sprocket") return [G.sprocket[0], G.sprocket[1], 1.42 * G.addendum, 1.42 * G.addendum];
    if ($("view").value === "follow") {
      const b = followed(), p = now.pins[b], q = now.pins[b + 1];
      return [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, 0.16, 0.12];
    }
    const xs = now.pins.map((p) => p[0]), ys = now.pins.map((p) => p[1]);
    const [l, r, b, t] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    return [(l + r) / 2, (b + t) / 2, (r - l) / 2 + 0.3, (t - b) / 2 + 0.3];
  }

  function draw() {
    const ratio = size(), now = state(index), [cx, cy, hx, hy] = window_of(now);
    const scale = Math.min(canvas.width / (2 * hx), canvas.height / (2 * hy));
    const at = ([x, y]) => [canvas.width / 2 + (x - cx) * scale, canvas.height / 2 - (y - cy) * scale];
    const pen = (width) => { context.lineWidth = width * ratio; };
    const path = (points, close) => {
      context.beginPath();
      points.forEach((p, i) => context[i ? "lineTo" : "moveTo"](...at(p)));
      if (close) context.closePath();
    };
    const disc = (x, y, r, face) => {
      context.beginPath();
      context.arc(...at([x, y]), r * scale, 0, 2 * Math.PI);
      context.fillStyle = face; context.fill(); context.stroke();
    };
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.strokeStyle = colour("edge"); pen(0.8);
    for (const [x, y, r] of run.wheels) { disc(x, y, r, colour("rubber")); disc(x, y, 0.9 * r, colour("steel")); }
    if (run.radius !== null) disc(...G.sprocket, run.radius, colour("rubber"));
    const outline = [];
    for (let k = G.teeth; k >= 1; k--)
      for (const arc of G.areas) for (const p of arc) outline.push(ofGroove(now, k, p));
    path(outline, true); context.fillStyle = colour("steel"); context.fill(); context.stroke();
    if (run.radius !== null) {
      context.save(); context.setLineDash([5 * ratio, 3 * ratio]); context.strokeStyle = colour("rubber");
      context.beginPath(); context.arc(...at(G.sprocket), run.radius * scale, 0, 2 * Math.PI);
      context.stroke(); context.restore();
    }
    path([G.sprocket, ofGroove(now, 1, [0, 0.8 * G.addendum])]); context.stroke();
    disc(...G.sprocket, 0.03, colour("card"));
    chain(now, at, path, ratio, scale);
    forces(now, at, path, pen, ratio);
    bar(ratio, BAR[$("view").value] * scale);
  }

  function bar(ratio, length) {
    const [x, y] = [14 * ratio, canvas.height - 14 * ratio];
    context.strokeStyle = colour("ink"); context.lineWidth = 2 * ratio;
    context.beginPath(); context.moveTo(x, y); context.lineTo(x + length, y);
    for (const end of [x, x + length]) { context.moveTo(end, y - 4 * ratio); context.lineTo(end, y + 4 * ratio); }
    context.stroke();
    label(G.force_bar / 1000 + " kN", [x + length / 2, y - 11 * ratio], ratio);
  }

  function chain(now, at, path, ratio, scale) {
    context.globalAlpha = $("view").value === "loop" ? 1 : 0.72;
    for (const odd of [1, 0])
      for (let b = odd; b < run.bodies; b += 2) {
        const a = now.angle(b), c = Math.cos(a), s = Math.sin(a), [x, y] = now.pins[b], [px, py] = at([x, y]);
        if (odd) {
          const [qx, qy] = at(now.pins[b + 1]);
          context.beginPath();
          context.arc(px, py, G.arc * scale, Math.PI / 2 - a, 1.5 * Math.PI - a);
          context.arc(qx, qy, G.arc * scale, -Math.PI / 2 - a, Math.PI / 2 - a);
          context.closePath();
        } else {
          const h = G.thickness / 2, corner = (u, v) => [x + c * u - s * v, y + s * u + c * v];
          path([corner(0, -h), corner(G.link, -h), corner(G.link, h), corner(0, h)], true);
        }
        const sensor = b === 2 * (G.sensor[0] - 1);
        context.fillStyle = odd ? colour("connectors") : colour("links");
        context.fill(); context.lineWidth = (sensor ? 2.6 : 0.8) * ratio; context.stroke();
        if (sensor) {
          const [u, v] = [G.sensor[1], G.sensor[2]], [sx, sy] = at([x + c * u - s * v, y + s * u + c * v]);
          context.beginPath(); context.arc(sx, sy, 4 * ratio, 0, 2 * Math.PI);
          context.fillStyle = colour("edge"); context.fill();
        }
      }
    context.globalAlpha = 1;
  }

  function forces(now, at, path, pen, ratio) {
    const p = run.bodies / 2, counts = [0, 0, 0], most = [0, 0, 0], scale = BAR[$("view").value] / G.force_bar;
    const loop = $("view").value === "loop";
    for (let i = 0; i < p; i++)
      for (let side = 0; side < 3; side++) {
        const force = run.force[(index * p + i) * 3 + side];
        const area = side < 2 ? run.area[(index * p + i) * 2 + side] : 0;
        if (!(side < 2 ? area : force)) continue;
        counts[side]++; most[side] = Math.max(most[side], force);
        let foot, n;
        if (side < 2) {
          const k = run.groove[(index * p + i) * 2 + side], pin = now.pins[2 * i + 1 + side];
          const centre = ofGroove(now, k, G.centre[area - 1]), d = Math.hypot(pin[0] - centre[0], pin[1] - centre[1]);
          const out = [(pin[0] - centre[0]) / d, (pin[1] - centre[1]) / d], sign = G.convex[area - 1] ? 1 : -1;
          n = [sign * out[0], sign * out[1]];
          foot = [pin[0] - G.arc * n[0], pin[1] - G.arc * n[1]];
          path(G.areas[area - 1].map((q) => ofGroove(now, k, q)));
          context.save(); context.strokeStyle = AREA[Math.min(area, 11 - area) - 1];
          context.setLineDash(area > 5 ? [4 * ratio, 3 * ratio] : []);
          pen(loop ? 3 : 5); context.stroke(); context.restore();
          if (!loop) label(String(area), at([foot[0] - 0.022 * n[0], foot[1] - 0.022 * n[1]]), ratio);
        } else {
          const [x, y] = now.pins[2 * i], a = now.angle(2 * i), c = Math.cos(a), s = Math.sin(a), [ox, oy] = G.sprocket;
          const along = Math.min(Math.max((ox - x) * c + (oy - y) * s, 0), G.link);
          const q = [x + along * c, y + along * s], d = Math.hypot(q[0] - ox, q[1] - oy);
          n = [(q[0] - ox) / d, (q[1] - oy) / d];
          foot = [q[0] - (G.thickness / 2) * n[0], q[1] - (G.thickness / 2) * n[1]];
        }
        const length = Math.min(force, G.force_most) * scale;
        arrow(at(foot), at([foot[0] + length * n[0], foot[1] + length * n[1]]), side, ratio);
      }
    const tell = SIDES.map((name, i) => `${name} ${counts[i]}` + (counts[i] ? ` (largest ${most[i]} N)` : ""));
    $("readout").textContent = `Contacts at this instant: ${tell.join(", ")}. ` +
      `The bar is ${G.force_bar} N in every run; forces above ${G.force_most} N are drawn no longer.`;
    $("clock").textContent = (index * run.interval).toFixed(2) + " s";
  }

  function label(text, [x, y], ratio) {
    context.font = "600 " + 12 * ratio + "px system-ui, sans-serif";
    context.textAlign = "center"; context.textBaseline = "middle";
    context.lineWidth = 3 * ratio; context.strokeStyle = colour("card"); context.strokeText(text, x, y);
    context.fillStyle = colour("ink"); context.fillText(text, x, y);
    context.strokeStyle = colour("edge");
  }

  function arrow([x, y], [u, v], side, ratio) {
    const length = Math.hypot(u - x, v - y), turn = Math.atan2(v - y, u - x);
    const head = Math.min(9 * ratio, 0.6 * length), m = 4 * ratio;
    context.save();
    context.strokeStyle = context.fillStyle = colour(SIDES[side]);
    context.lineWidth = 2.4 * ratio; context.beginPath(); context.moveTo(x, y);
    context.lineTo(u - 0.8 * head * Math.cos(turn), v - 0.8 * head * Math.sin(turn)); context.stroke();
    context.beginPath(); context.moveTo(u, v);
    for (const t of [0.42, -0.42]) context.lineTo(u - head * Math.cos(turn + t), v - head * Math.sin(turn + t));
    context.fill(); context.beginPath();
    if (side === 0) context.arc(x, y, m, 0, 2 * Math.PI);
    else if (side === 1) context.rect(x - m, y - m, 2 * m, 2 * m);
    else {
      context.moveTo(x, y - 1.2 * m); context.lineTo(x + m, y + m); context.lineTo(x - m, y + m); context.closePath();
    }
    context.fill(); context.lineWidth = ratio; context.strokeStyle = colour("card"); context.stroke();
    context.restore();
  }

  function go(i) { index = i; $("scrub").value = i; draw(); }
  function play(on) {
    playing = on; last = 0; due = 0;
    $("play").textContent = on ? "❚❚ Pause" : "▶ Play";
    $("play").setAttribute("aria-pressed", String(on));
    if (on) requestAnimationFrame(tick);
  }
  function tick(time) {
    if (!playing) return;
    if (last) due += Math.min(time - last, 250) * 1e-3 * Number($("pace").value) / run.interval;
    last = time;
    if (due >= 1) { const steps = Math.floor(due); due -= steps; go((index + steps) % run.frames); }
    requestAnimationFrame(tick);
  }
  function radii() {
    const here = DATA.pictures.filter((q) => String(q.rpm) === $("rpm").value);
    fill($("radius"), here.map((q) => [String(q.radius), radiusName(q.radius)]));
  }
  function choose() {
    run = load(DATA.pictures.find((q) => String(q.rpm) === $("rpm").value && String(q.radius) === $("radius").value));
    $("scrub").max = run.frames - 1;
    go(Math.min(index, run.frames - 1));
  }
  fill($("rpm"), [...new Set(DATA.pictures.map((q) => q.rpm))].map((rpm) => [rpm, rpm + " rpm"]));
  radii();
  const usual = [...$("radius").options].find((option) => option.value === "0.308");
  if (usual) $("radius").value = usual.value;
  $("rpm").addEventListener("input", () => { radii(); choose(); });
  $("radius").addEventListener("input", choose);
  $("view").addEventListener("input", draw);
  $("scrub").addEventListener("input", () => { play(false); go(Number($("scrub").value)); });
  $("play").addEventListener("click", () => play(!playing));
  window.addEventListener("resize", draw);
  REDRAWS.push(draw);
  choose();
})();
