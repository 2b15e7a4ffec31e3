"use strict";
// The viewer of samples: three choices, echoes, a tile, the probabilities of its classes, and the target's own motion to turn by hand.
(() => {
  const data = JSON.parse(document.getElementById("viewer-data").textContent);
  const at = (name) => document.getElementById(`viewer-${name}`);
  const unique = (values) => [...new Set(values)];
  const state = { frame: 0, turn: 0.6, lift: 0.5, points: null, motion: null, timer: 0 };

  function fill(select, values) {
    const before = select.value;
    select.replaceChildren(...values.map((value) => new Option(value, value)));
    if (values.map(String).includes(before)) select.value = before;
  }

  function shares(sample) {
    const names = Object.keys(sample.probabilities);
    if (!names.length) { at("shares").textContent = "No network was asked about this sample."; return; }
    const table = document.createElement("table");
    table.className = "plain";
    table.createCaption().textContent = "Class probabilities, percent";
    const head = table.createTHead().insertRow();
    for (const text of ["protocol and scheme", ...data.classes, "answer"]) {
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

  function draw() {
    const canvas = at("motion"), pen = canvas.getContext("2d"), found = state.motion;
    pen.clearRect(0, 0, canvas.width, canvas.height);
    if (!found) return;
    const middle = [canvas.width / 2, canvas.height / 2], half = 0.42 * Math.min(...middle) * 1.9;
    const [ct, st, cl, sl] = [Math.cos(state.turn), Math.sin(state.turn), Math.cos(state.lift), Math.sin(state.lift)];
    // Turned about the vertical axis, then seen from above by the angle `lift`.
    const seen = (x, y, z) => {
      const across = ct * x + st * y, deep = -st * x + ct * y;
      return [middle[0] + half * across, middle[1] - half * (cl * z + sl * deep), cl * deep - sl * z];
    };
    const ink = getComputedStyle(document.body).color;
    pen.strokeStyle = pen.fillStyle = ink;
    pen.font = "13px system-ui, sans-serif";
    const start = seen(0, 0, 0);
    [["x", [0.3, 0, 0]], ["y", [0, 0.3, 0]], ["z", [0, 0, 0.3]]].forEach(([name, end]) => {
      const [x, y] = seen(...end).map((value, axis) => value - start[axis] + [45, canvas.height - 45, 0][axis]);
      pen.beginPath();
      pen.moveTo(45, canvas.height - 45);
      pen.lineTo(x, y);
      pen.stroke();
      pen.fillText(name, x + 3, y - 3);
    });
    pen.fillText(`${(2 * found.scale_m).toPrecision(3)} m across`, 10, 18);
    const first = 3 * found.count * state.frame, dots = [];
    for (let i = 0; i < found.count; i += 1) {
      const place = [0, 1, 2].map((axis) => state.points[first + 3 * i + axis] / 32767);
      dots.push([...seen(...place), found.part[i]]);
    }
    dots.sort((one, other) => other[2] - one[2]);
    for (const [x, y, , part] of dots) {
      pen.fillStyle = part === 0 ? "#8a8f98" : `hsl(${(part * 67) % 360} 75% 50%)`;
      pen.beginPath();
      pen.arc(x, y, 3, 0, 7);
      pen.fill();
    }
    at("time").textContent = `${((1000 * state.frame * found.seconds) / found.frames).toPrecision(3)} ms of a cycle of ${(1000 * found.seconds).toPrecision(3)} ms.`;
    at("frame").value = state.frame;
  }

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

  // Power as a line, phase as a dash a symbol: a line through phases would jump at every full turn.
  function echoes(sample) {
    const speeds = [];
    for (const kind of ["power", "phase"]) {
      document.querySelectorAll(`#viewer-tile path.${kind}`).forEach((path, row) => {
        const echo = sample.echoes[row];
        if (!echo) { path.setAttribute("d", ""); return; }
        const values = bytes(echo[kind]), { wide, high, from } = path.dataset, step = wide / values.length;
        const level = (value) => (Number(from) + high * (1 - value / (kind === "power" ? 255 : 256))).toFixed(1);
        const parts = Array.from(values, (value, at) => (kind === "phase" ? `M${(at * step).toFixed(1)} ${level(value)}h1.2` : `${at ? "L" : "M"}${((at + 0.5) * step).toFixed(1)} ${level(value)}`));
        path.setAttribute("d", parts.join(""));
      });
    }
    sample.echoes.forEach((echo, row) => {
      if (echo.speed === undefined) return;
      const folds = echo.folds ? `shown at ${echo.shown} m/s, folded ${echo.folds} time${echo.folds > 1 ? "s" : ""}` : "not folded";
      speeds.push(`${data.stations[row]} ${echo.speed} m/s (${folds})`);
    });
    at("speeds").textContent = speeds.length ? `Radial speed of the whole target, receding positive: ${speeds.join("; ")}.` : "";
    document.querySelectorAll("#viewer-tile path.speed").forEach((path) => {
      const { row, low, high, size } = path.dataset, echo = sample.echoes[row];
      const there = echo && echo.shown !== undefined && echo.shown >= Number(low) && echo.shown <= Number(high);
      path.style.display = there ? "" : "none";
      if (there) path.setAttribute("transform", `translate(0 ${((size * (high - echo.shown)) / (high - low)).toFixed(1)})`);
    });
  }

  function show() {
    const one = data.samples.find((sample) => sample.subtype === at("subtype").value && String(sample.model) === at("model").value && sample.snr === at("snr").value);
    const name = `${one.category}: ${one.subtype} (${one.group}), motion model ${one.model}, ${one.snr}`;
    at("name").textContent = name;
    at("tile").setAttribute("aria-label", `tile of ${name}`);
    document.querySelectorAll("#viewer image").forEach((image) => image.setAttribute("href", one[image.dataset.of || "tile"]));
    echoes(one);
    shares(one);
    const found = data.motions[`${one.subtype} ${one.model}`] || null;
    if (found !== state.motion) {
      state.motion = found;
      state.frame = 0;
      if (found) {
        state.points = new Int16Array(bytes(found.points).buffer);
        at("frame").max = found.frames - 1;
      }
    }
    draw();
  }

  function choose() {
    const mine = data.samples.filter((sample) => sample.subtype === at("subtype").value);
    fill(at("model"), unique(mine.map((sample) => sample.model)).sort((x, y) => x - y));
    const levels = mine.filter((sample) => String(sample.model) === at("model").value);
    fill(at("snr"), levels.map((sample) => sample.snr));
    show();
  }

  function play() {
    if (state.timer) clearInterval(state.timer);
    state.timer = state.timer ? 0 : setInterval(() => {
      if (!state.motion) return;
      state.frame = (state.frame + 1) % state.motion.frames;
      draw();
    }, 80);
    at("play").textContent = state.timer ? "Pause" : "Play";
  }

  const canvas = at("motion");
  const turn = (across, up) => {
    state.turn += across;
    state.lift = Math.max(-1.57, Math.min(1.57, state.lift + up));
    draw();
  };
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => { if (event.buttons) turn(0.01 * event.movementX, 0.01 * event.movementY); });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    if (step) { event.preventDefault(); turn(...step); }
  });
  at("play").addEventListener("click", play);
  at("frame").addEventListener("input", () => { state.frame = Number(at("frame").value); draw(); });
  for (const name of ["subtype", "model"]) at(name).addEventListener("change", choose);
  at("snr").addEventListener("change", show);
  fill(at("subtype"), unique(data.samples.map((sample) => sample.subtype)));
  choose();
})();
