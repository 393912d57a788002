// The loop in motion: configurations on a canvas, with forces and touched areas.
const FRAME = { index: 0, shown: [] }; // functions that follow the picture
(function animation() {
  const canvas = $("scene");
  if (!canvas) return;
  const G = DATA.geometry, context = canvas.getContext("2d");
  const AREA = ["#0072b2", "#d55e00", "#009e73", "#b8860b", "#aa4499"]; // of area j and of 11 - j
  const SIDES = ["left", "right", "ring"]; // then the other wheels
  const NAMES = [...SIDES, ...G.wheels], tone = (side) => SIDES[side] ?? "wheel";
  const AREAS = G.areas.length;
  // length of the arrow of the force of the scale bar, m; no arrow is longer than that of the largest force
  const BAR = G.bars;
  let run = null, index = 0, playing = false, last = 0, due = 0;

  function load(picture) {
    const contacts = picture.contacts.map((flat) => // seven numbers a contact, lengths in units
      Array.from({ length: flat.length / 7 }, (_, k) => {
        const [side, x, y, u, v, area, groove] = flat.slice(7 * k, 7 * k + 7), force = Math.hypot(u, v);
        return { side, foot: [x * picture.unit, y * picture.unit], n: [u / force, v / force], force, area, groove };
      }));
    return { ...picture, frame: summed(picture), contacts };
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
    const width = run.start.length, f = run.frame.subarray(i * width, (i + 1) * width), n = run.bodies;
    // x of all bodies, y, angles, x and y of the wheels, angle of the sprocket
    const wheels = run.wheels.map(([r], k) => [f[3 * n + 2 * k], f[3 * n + 2 * k + 1], r]);
    const pins = Array.from({ length: n + 1 }, (_, b) => [f[b % n], f[n + (b % n)]]);
    return { pins, angle: (b) => f[2 * n + b], sprocket: f[width - 1], wheels };
  }

  // A point of a body in the inertial frame
  function ofBody(now, b, [u, v]) {
    const a = now.angle(b), c = Math.cos(a), s = Math.sin(a), [x, y] = now.pins[b];
    return [x + c * u - s * v, y + s * u + c * v];
  }

  // Link of a pitch: body, begin and end of its middle line; its connector's arcs: body and place of the left, of the right
  const link = (p) => G.links[p];
  const arcs = (p) => G.arcs[p];
  const pitches = () => G.links.length;
  const arc = (now, p, side) => ofBody(now, arcs(p)[2 * side], [arcs(p)[2 * side + 1], 0]);

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

  // The connector before the sprocket at the beginning: it passes during the run.
  function followed() {
    const now = state(0), before = [G.sprocket[0] - 0.5 * G.addendum, G.sprocket[1] + G.addendum];
    const away = (p) => Math.hypot(arc(now, p, 0)[0] - before[0], arc(now, p, 0)[1] - before[1]);
    let best = 0;
    for (let p = 1; p < pitches(); p++) if (away(p) < away(best)) best = p;
    return best;
  }

  function window_of(now) {
    if ($("view").value === "sprocket" && G.teeth) return [G.sprocket[0], G.sprocket[1], 1.42 * G.addendum, 1.42 * G.addendum];
    if ($("view").value === "follow") {
      const p = arc(now, followed(), 0), q = arc(now, followed(), 1), size = G.follow;
      return [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, 1.33 * size, size];
    }
    const xs = now.pins.map((p) => p[0]), ys = now.pins.map((p) => p[1]);
    const [l, r, b, t] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const margin = G.margin;
    return [(l + r) / 2, (b + t) / 2, (r - l) / 2 + margin, (t - b) / 2 + margin];
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
    for (const [x, y, r] of now.wheels) { disc(x, y, r, colour("rubber")); disc(x, y, 0.9 * r, colour("steel")); }
    for (const [wheel, x, y] of G.arms) { // from the pivot, in the hull, to the wheel's hub
      const [u, v, r] = now.wheels[wheel];
      context.save(); context.lineCap = "round"; context.strokeStyle = colour("soft"); context.lineWidth = 0.16 * r * scale;
      path([[x, y], [u, v]]); context.stroke(); context.restore();
      for (const end of [[x, y], [u, v]]) disc(...end, 0.06 * r, colour("card"));
    }
    if (run.radius !== null) disc(...G.sprocket, run.radius, colour("rubber"));
    if (G.teeth) {
      const outline = [];
      for (let k = G.teeth; k >= 1; k--)
        for (const p of G.outline) outline.push(ofGroove(now, k, p));
      path(outline, true); context.fillStyle = colour("steel"); context.fill(); context.stroke();
    }
    if (run.radius !== null) {
      context.save(); context.setLineDash([5 * ratio, 3 * ratio]); context.strokeStyle = colour("rubber");
      context.beginPath(); context.arc(...at(G.sprocket), run.radius * scale, 0, 2 * Math.PI);
      context.stroke(); context.restore();
    }
    if (G.teeth) {
      path([G.sprocket, ofGroove(now, 1, [0, 0.8 * G.addendum])]); context.stroke();
      disc(...G.sprocket, 0.1 * G.addendum, colour("card"));
    }
    chain(now, at, path, ratio, scale);
    forces(now, at, path, pen, ratio);
    if (G.force_bar) bar(ratio, BAR[$("view").value] * scale);
  }

  function bar(ratio, length) {
    const [x, y] = [14 * ratio, canvas.height - 14 * ratio];
    context.strokeStyle = colour("ink"); context.lineWidth = 2 * ratio;
    context.beginPath(); context.moveTo(x, y); context.lineTo(x + length, y);
    for (const end of [x, x + length]) { context.moveTo(end, y - 4 * ratio); context.lineTo(end, y + 4 * ratio); }
    context.stroke();
    label(G.force_bar < 1000 ? G.force_bar + " N" : G.force_bar / 1000 + " kN", [x + length / 2, y - 11 * ratio], ratio);
  }

  function chain(now, at, path, ratio, scale) {
    context.globalAlpha = $("view").value === "loop" ? 1 : 0.72;
    const inColours = $("colours").value === "tension", tint = (b, plain) =>
      inColours ? tensionColour((tensionOf(b) - run.low) / Math.max(run.high - run.low, 1)) : colour(plain);
    for (let p = 0; p < pitches(); p++) {
      if (arcs(p)[0] !== arcs(p)[2]) { shoe(now, p, at, path, ratio, scale, tint); continue; }
      const l = arc(now, p, 0), [px, py] = at(l), r = arc(now, p, 1), [qx, qy] = at(r);
      const a = Math.atan2(r[1] - l[1], r[0] - l[0]);
      context.beginPath();
      context.arc(px, py, G.arc * scale, Math.PI / 2 - a, 1.5 * Math.PI - a);
      context.arc(qx, qy, G.arc * scale, -Math.PI / 2 - a, Math.PI / 2 - a);
      context.closePath();
      context.fillStyle = tint(arcs(p)[0], "connectors"); context.fill(); context.lineWidth = 0.8 * ratio; context.stroke();
    }
    for (let p = 0; p < pitches(); p++) {
      const [b, from, to] = link(p), h = G.thickness / 2, sensor = G.sensors.some(([body]) => body === b);
      path([[from, -h], [to, -h], [to, h], [from, h]].map((point) => ofBody(now, b, point)), true);
      context.fillStyle = tint(b, "links");
      context.fill(); context.lineWidth = (sensor ? 2.6 : 0.8) * ratio; context.stroke();
    }
    for (const [body, x, y] of G.sensors) {
      const [sx, sy] = at(ofBody(now, body, [x, y]));
      context.beginPath(); context.arc(sx, sy, 4 * ratio, 0, 2 * Math.PI);
      context.fillStyle = colour("edge"); context.fill();
    }
    context.globalAlpha = 1;
  }

  // A single-pin chain has no connectors: the two arcs at a joint belong to the bodies on either side of it, a half each.
  function shoe(now, p, at, path, ratio, scale, tint) {
    const pin = now.pins[arcs(p)[2]];
    for (const side of [0, 1]) {
      const centre = arc(now, p, side), [x, y] = at(centre), body = arcs(p)[2 * side];
      const a = Math.atan2(centre[1] - pin[1], centre[0] - pin[0]), h = [-G.arc * Math.sin(a), G.arc * Math.cos(a)];
      path([[centre[0] + h[0], centre[1] + h[1]], [pin[0] + h[0], pin[1] + h[1]], [pin[0] - h[0], pin[1] - h[1]], [centre[0] - h[0], centre[1] - h[1]]]);
      context.arc(x, y, G.arc * scale, Math.PI / 2 - a, -Math.PI / 2 - a, true);
      context.closePath();
      context.fillStyle = tint(body, "links"); context.fill(); context.lineWidth = 0.8 * ratio; context.stroke();
    }
    context.beginPath(); context.arc(...at(pin), 0.35 * G.arc * scale, 0, 2 * Math.PI);
    context.fillStyle = colour("card"); context.fill(); context.stroke();
  }

  const tensionOf = (b) => run.tension[index * run.bodies + b];

  function forces(now, at, path, pen, ratio) {
    const counts = NAMES.map(() => 0), most = NAMES.map(() => 0), scale = BAR[$("view").value] / G.force_bar;
    const loop = $("view").value === "loop";
    for (const { side, foot, n, force, area, groove } of run.contacts[index]) {
      counts[side]++; most[side] = Math.max(most[side], Math.round(force));
      if (area) {
        path(G.areas[area - 1].map((q) => ofGroove(now, groove, q)));
        context.save(); context.strokeStyle = AREA[(Math.min(area, AREAS + 1 - area) - 1) % AREA.length];
        context.setLineDash(2 * area > AREAS + 1 ? [4 * ratio, 3 * ratio] : []);
        pen(loop ? 3 : 5); context.stroke(); context.restore();
        if (!loop) {
          const under = 0.17 * BAR.sprocket;
          label(String(area), at([foot[0] - under * n[0], foot[1] - under * n[1]]), ratio);
        }
      }
      const length = Math.min(force, G.force_most ?? Infinity) * scale;
      arrow(at(foot), at([foot[0] + length * n[0], foot[1] + length * n[1]]), side, ratio);
    }
    const tell = NAMES.map((name, i) => `${name} ${counts[i]}` + (counts[i] ? ` (largest ${most[i]} N)` : ""));
    $("readout").textContent = !G.force_bar ? "No contacts." : `Contacts at this instant: ${tell.join(", ")}. ` +
      `The bar is ${G.force_bar} N throughout` + (G.force_most ? `; arrows do not grow above ${G.force_most} N.` : ".");
    // formatted here, and so are the forces above: the reader chooses the instant
    $("clock").textContent = (index * run.interval + run.begin).toFixed(2) + " s";
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
    context.strokeStyle = context.fillStyle = colour(tone(side));
    context.lineWidth = 2.4 * ratio; context.beginPath(); context.moveTo(x, y);
    context.lineTo(u - 0.8 * head * Math.cos(turn), v - 0.8 * head * Math.sin(turn)); context.stroke();
    context.beginPath(); context.moveTo(u, v);
    for (const t of [0.42, -0.42]) context.lineTo(u - head * Math.cos(turn + t), v - head * Math.sin(turn + t));
    context.fill(); context.beginPath();
    if (side === 0) context.arc(x, y, m, 0, 2 * Math.PI);
    else if (side === 1) context.rect(x - m, y - m, 2 * m, 2 * m);
    else if (side > 2) {
      context.moveTo(x, y - 1.3 * m); context.lineTo(x + 1.3 * m, y); context.lineTo(x, y + 1.3 * m); context.lineTo(x - 1.3 * m, y);
      context.closePath();
    } else {
      context.moveTo(x, y - 1.2 * m); context.lineTo(x + m, y + m); context.lineTo(x - m, y + m); context.closePath();
    }
    context.fill(); context.lineWidth = ratio; context.strokeStyle = colour("card"); context.stroke();
    context.restore();
  }

  function go(i) {
    index = FRAME.index = i; $("scrub").value = i; draw();
    for (const follow of FRAME.shown) follow(i, playing);
  }
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
  function take(picture) {
    run = load(picture);
    $("scrub").max = run.frames - 1;
    go(Math.min(index, run.frames - 1));
  }
  for (const name of ["view", "colours"]) $(name).addEventListener("input", draw);
  $("scrub").addEventListener("input", () => { play(false); go(Number($("scrub").value)); });
  $("play").addEventListener("click", () => play(!playing));
  window.addEventListener("resize", draw);
  REDRAWS.push(draw);
  take(DATA.pictures[0]);
})();

// From little (blue) to much (red), the same in both themes; also of a reader who sees no red
function tensionColour(part) {
  const stops = [[69, 117, 180], [171, 217, 233], [254, 224, 144], [244, 109, 67], [165, 0, 38]];
  const x = Math.min(Math.max(part, 0), 1) * (stops.length - 1), k = Math.min(Math.floor(x), stops.length - 2);
  return `rgb(${stops[k].map((value, i) => Math.round(value + (x - k) * (stops[k + 1][i] - value))).join(",")})`;
}
