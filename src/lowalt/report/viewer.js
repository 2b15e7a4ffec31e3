"use strict";
// The viewer of samples: choices, then cloud, truth, echoes and spectra of one sample at one instant of its look.
(() => {
  const data = JSON.parse(document.getElementById("viewer-data").textContent);
  const root = document.getElementById("viewer-root");
  const at = (name) => document.getElementById(`viewer-${name}`);
  const all = (selector) => [...root.querySelectorAll(selector)];
  const unique = (values) => [...new Set(values)];
  const state = { time: 0, turn: 0.6, lift: 0.5, points: null, motion: null, timer: 0 };
  const EVERY = "all";
  const TICK_MS = 40;
  // A cycle of the moving parts takes at least this long while the look is played.
  const CYCLE_S = 1.5;

  function fill(select, values) {
    const before = select.value;
    select.replaceChildren(...values.map((value) => new Option(value, value)));
    if (values.map(String).includes(before)) select.value = before;
  }

  function shares(sample) {
    const names = Object.keys(sample.probabilities);
    at("shares").hidden = !data.samples.some((one) => Object.keys(one.probabilities).length);
    if (!names.length) { at("shares").textContent = "No network was asked about this sample."; return; }
    const table = document.createElement("table");
    table.className = "plain";
    table.createCaption().textContent = "Class probabilities, percent";
    const head = table.createTHead().insertRow();
    for (const text of ["network", ...data.classes, "answer"]) {
      const cell = document.createElement("th");
      cell.scope = "col";
      cell.textContent = text;
      head.append(cell);
    }
    const body = table.createTBody();
    for (const name of names) {
      const row = body.insertRow(), values = sample.probabilities[name];
      const guess = data.classes[values.indexOf(Math.max(...values))];
      const answer = guess === sample.category ? `${guess}, right` : `${guess}, wrong`;
      for (const text of [name, ...values.map((value) => (100 * value).toFixed(1)), answer]) row.insertCell().textContent = text;
    }
    at("shares").replaceChildren(table);
  }

  // Points between the two kept instants of the cycle that enclose the chosen one.
  function places(found) {
    const phase = ((state.time / found.seconds) % 1) * found.frames, before = Math.floor(phase), share = phase - before;
    const [one, other] = [before, (before + 1) % found.frames].map((frame) => 3 * found.count * frame);
    const mean = (i) => ((1 - share) * state.points[one + i] + share * state.points[other + i]) / 32767;
    return Array.from({ length: found.count }, (_, i) => [mean(3 * i), mean(3 * i + 1), mean(3 * i + 2)]);
  }

  function cloud() {
    const canvas = at("motion"), pen = canvas.getContext("2d"), found = state.motion;
    const wide = canvas.width / 2, high = canvas.height / 2;
    pen.setTransform(2, 0, 0, 2, 0, 0);
    pen.clearRect(0, 0, wide, high);
    pen.strokeStyle = pen.fillStyle = getComputedStyle(root).color;
    pen.font = "12px system-ui, sans-serif";
    if (!found) { pen.fillText("The place of this target is not known.", 10, 18); return; }
    const half = 0.8 * Math.min(wide, high) / 2;
    const [ct, st, cl, sl] = [Math.cos(state.turn), Math.sin(state.turn), Math.cos(state.lift), Math.sin(state.lift)];
    // Turned about the vertical axis, then seen from above by the angle `lift`.
    const seen = ([x, y, z]) => {
      const across = ct * x + st * y, deep = -st * x + ct * y;
      return [wide / 2 + half * across, high / 2 - half * (cl * z + sl * deep), cl * deep - sl * z];
    };
    const start = seen([0, 0, 0]), corner = [30, high - 30, 0];
    [["x", [0.25, 0, 0]], ["y", [0, 0.25, 0]], ["z", [0, 0, 0.25]]].forEach(([name, end]) => {
      const [x, y] = seen(end).map((value, axis) => value - start[axis] + corner[axis]);
      pen.beginPath();
      pen.moveTo(corner[0], corner[1]);
      pen.lineTo(x, y);
      pen.stroke();
      pen.fillText(name, x + 3, y - 3);
    });
    pen.fillText(`cloud, ${(2 * found.scale_m).toPrecision(3)} m across`, 10, 18);
    const dots = places(found).map((place, i) => [...seen(place), found.colours[i]]);
    dots.sort((one, other) => other[2] - one[2]);
    for (const [x, y, , colour] of dots) {
      pen.fillStyle = colour;
      pen.beginPath();
      pen.arc(x, y, 2, 0, 7);
      pen.fill();
    }
  }

  const slowed = () => Math.max(1, CYCLE_S / (state.motion ? state.motion.seconds : CYCLE_S));

  function draw() {
    cloud();
    for (const line of all(".now")) {
      const { left, right, wide } = line.dataset, share = (state.time - left) / (right - left);
      line.style.display = share >= 0 && share <= 1 ? "" : "none";
      line.setAttribute("transform", `translate(${(wide * share).toFixed(1)} 0)`);
    }
    at("time").textContent = `${state.time.toFixed(3)} s`;
    at("frame").value = state.time;
  }

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

  // Power as a line, phase as a dash per symbol: a line through phases would jump at every full turn.
  function echoes(sample) {
    for (const kind of ["power", "phase"]) {
      all(`path.${kind}`).forEach((path, row) => {
        const echo = sample.echoes[row];
        if (!echo) { path.setAttribute("d", ""); return; }
        const values = bytes(echo[kind]), { wide, high, from } = path.dataset, step = wide / values.length;
        const level = (value) => (Number(from) + high * (1 - value / (kind === "power" ? 255 : 256))).toFixed(1);
        const parts = Array.from(values, (value, place) => (kind === "phase" ? `M${(place * step).toFixed(1)} ${level(value)}h1.2` : `${place ? "L" : "M"}${((place + 0.5) * step).toFixed(1)} ${level(value)}`));
        path.setAttribute("d", parts.join(""));
      });
    }
    all("path.speed").forEach((path) => {
      const { row, low, high, size } = path.dataset, echo = sample.echoes[row];
      const there = echo && echo.shown !== undefined && echo.shown >= Number(low) && echo.shown <= Number(high);
      path.style.display = there ? "" : "none";
      if (there) path.setAttribute("transform", `translate(0 ${((size * (high - echo.shown)) / (high - low)).toFixed(1)})`);
    });
  }

  function speeds(sample) {
    const texts = [];
    sample.echoes.forEach((echo, row) => {
      if (echo.speed === undefined || all(`.station[data-row="${row}"]`)[0].hidden) return;
      const folds = echo.folds ? `shown at ${echo.shown} m/s, folded ${echo.folds} time${echo.folds > 1 ? "s" : ""}` : "not folded";
      texts.push(`${data.stations[row]} ${echo.range} m and ${echo.speed} m/s (${folds})`);
    });
    const whole = texts.length ? `Range and radial speed of the whole target, receding positive: ${texts.join("; ")}.` : "";
    const times = Math.round(slowed());
    at("speeds").textContent = times > 1 ? `${whole} Played ${times} times slower.` : whole;
  }

  const one = (values) => data.samples.filter((sample) => Object.keys(values).every((name) => String(sample[name]) === values[name]));

  function show() {
    const [subtype, model, snr, effect, station] = ["subtype", "model", "snr", "effect", "station"].map((name) => at(name).value);
    const sample = one({ subtype, model, snr, effect })[0];
    const group = sample.group ? ` (${sample.group})` : "";
    const scene = effect === "none" ? "" : `, with ${effect}`;
    at("name").textContent = `${sample.category}: ${subtype}${group}, motion model ${model}, ${snr}${scene}`;
    all(".station").forEach((node) => { node.hidden = station !== EVERY && data.stations[node.dataset.row] !== station; });
    all("svg.panel").forEach((node) => node.setAttribute("aria-label", `${node.dataset.name} at station ${data.stations[node.dataset.row]} of ${at("name").textContent}`));
    all("image.tile").forEach((image) => image.setAttribute("href", sample[image.dataset.of || "tile"]));
    const found = data.motions[`${subtype} ${model}`] || null;
    all("image.truth").forEach((image) => image.setAttribute("href", found ? found.truth[image.dataset.row] : "data:,"));
    echoes(sample);
    shares(sample);
    if (found !== state.motion) {
      state.motion = found;
      state.points = found && new Int16Array(bytes(found.points).buffer);
      at("frame").step = Math.min(data.step_s, found ? found.seconds / found.frames : data.step_s);
    }
    speeds(sample);
    draw();
  }

  // Each choice offers what the choices before it leave.
  function choose() {
    const values = {};
    for (const name of ["subtype", "model", "snr", "effect"]) {
      const left = unique(one(values).map((sample) => sample[name]));
      fill(at(name), name === "model" ? left.sort((x, y) => x - y) : left);
      values[name] = at(name).value;
      at(name).parentElement.hidden = left.length < 2;
    }
    show();
  }

  function play() {
    if (state.timer) clearInterval(state.timer);
    state.timer = state.timer ? 0 : setInterval(() => {
      state.time = (state.time + TICK_MS / 1000 / slowed()) % data.look_s;
      draw();
    }, TICK_MS);
    at("play").textContent = state.timer ? "Pause" : "Play";
  }

  const canvas = at("motion");
  const turn = (across, up) => {
    state.turn += across;
    state.lift = Math.max(-1.57, Math.min(1.57, state.lift + up));
    cloud();
  };
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => { if (event.buttons) turn(0.01 * event.movementX, 0.01 * event.movementY); });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    if (step) { event.preventDefault(); turn(...step); }
  });
  at("play").addEventListener("click", play);
  at("frame").addEventListener("input", () => { state.time = Number(at("frame").value); draw(); });
  for (const name of ["subtype", "model", "snr", "effect", "station"]) at(name).addEventListener("change", choose);
  // The cloud's letters have the colour of the page's text, which a theme changes.
  const themed = new MutationObserver(cloud);
  for (const node of [document.documentElement, document.body]) themed.observe(node, { attributes: true });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", cloud);
  fill(at("station"), [...data.stations, EVERY]);
  choose();
})();
