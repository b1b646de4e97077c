// The page: playback, settings and texts.

const $ = (selector) => document.querySelector(selector);
const ABOUT = JSON.parse($("#about-json").textContent);
const PLANES = new Set(ABOUT.meshes.flatMap((mesh, i) => (mesh.is_plane ? [i] : [])));
const ICONS = {
  play: '<svg viewBox="0 0 18 18"><path d="M4 2l12 7-12 7z"/></svg>',
  pause: '<svg viewBox="0 0 18 18"><path d="M3 2h4v14H3zM11 2h4v14h-4z"/></svg>',
};

class Page {
  constructor(trajectory) {
    this.trajectory = trajectory;
    this.canvas = $("#scene");
    this.renderer = new Renderer(this.canvas, trajectory);
    this.frame = 0;
    this.playing = false;
    this.picked = -1;
    this.ratio = Math.min(2, window.devicePixelRatio || 1);
    this.stale = this.moved = true;
    this.scene = ABOUT.scene;
    const camera = ABOUT.camera[0];
    this.orbit = new Orbit(this.canvas, { eye: camera.slice(0, 3), target: camera.slice(3, 6), fov: camera[6] },
      () => { this.stale = true; this.follow = false; }, (x, y) => this.pickAt(x, y));
    this.colourings = colourings(trajectory, ABOUT);
    this.colouring = this.colourings[0];
    this.shownSigns = new Set(["guide", "constraints", "glue", "layers"]);
    this.signs = makeSigns(trajectory);
    this.makeText();
    this.makeControls();
    this.takeAddress();
    this.drawTrack();
    requestAnimationFrame((now) => this.step(now));
  }

  makeText() {
    $("#about h1").textContent = ABOUT.title;
    $("#about .sub").textContent = ABOUT.summary;
    if (ABOUT.thinned) {
      $("#about .said").hidden = false;
      $("#about .said").textContent = ABOUT.thinned;
    }
    $("#about ul").innerHTML = "";
    for (const line of ABOUT.lines) {
      const item = document.createElement("li");
      item.textContent = line;
      $("#about ul").append(item);
    }
  }

  makeControls() {
    const choose = $("#colours");
    for (const { key, name } of this.colourings) choose.add(new Option(name, key));
    choose.onchange = () => this.colourBy(choose.value);
    for (const name of Object.keys(this.signs)) this.addToggle(name[0].toUpperCase() + name.slice(1), true, (on) => {
      this.shownSigns[on ? "add" : "delete"](name);
      this.stale = true;
    });
    if (ABOUT.camera.length > 1) this.followBox = this.addToggle("Scene’s camera", false, (on) => { this.follow = on; this.stale = true; });
    $("#play").onclick = () => this.play(!this.playing);
    $("#time").max = ABOUT.frames - 1;
    $("#time").oninput = () => { this.play(false); this.goTo(+$("#time").value); };
    $("#body .close").onclick = () => this.pick(-1);
    window.addEventListener("resize", () => { this.stale = true; this.drawTrack(); });
    window.addEventListener("keydown", (event) => this.key(event));
    this.play(false);
  }

  addToggle(text, on, changed) {
    const label = document.createElement("label"), box = document.createElement("input");
    label.className = "row";
    box.type = "checkbox";
    box.checked = on;
    box.onchange = () => changed(box.checked);
    label.append(box, text);
    $("#toggles").append(label);
    return box;
  }

  // #frame=30&body=5&colours=speed&play=1
  takeAddress() {
    const given = new URLSearchParams(location.hash.slice(1));
    if (given.has("colours")) this.colourBy(given.get("colours"));
    if (given.has("body")) this.pick(this.trajectory.id.indexOf(+given.get("body")));
    this.goTo(given.has("frame") ? +given.get("frame") : 0);
    if (given.get("play") === "1" || (!given.has("frame") && ABOUT.frames > 1)) this.play(true);
  }

  key(event) {
    if (event.target instanceof HTMLSelectElement || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === " ") this.play(!this.playing);
    else if (step) { this.play(false); this.goTo(Math.round(this.frame) + step); }
    else if (event.key === "Home") this.goTo(0);
    else if (event.key === "End") this.goTo(ABOUT.frames - 1);
    else if (event.key === "Escape") this.pick(-1);
    else if (event.key === "r") this.orbit.reset();
    else return;
    event.preventDefault();
  }

  colourBy(key) {
    this.colouring = this.colourings.find((one) => one.key === key) || this.colourings[0];
    $("#colours").value = this.colouring.key;
    this.moved = true;
  }

  play(on) {
    if (on && this.frame >= ABOUT.frames - 1) this.frame = 0;
    this.playing = on && ABOUT.frames > 1;
    $("#play").innerHTML = this.playing ? ICONS.pause : ICONS.play;
    $("#play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  goTo(frame) {
    this.frame = Math.max(0, Math.min(ABOUT.frames - 1, Number.isFinite(frame) ? frame : 0));
    this.moved = true;
  }

  step(now) {
    const past = Math.min(0.1, (now - (this.last ?? now)) / 1000);
    this.last = now;
    if (this.playing) {
      this.goTo(this.frame + past * ABOUT.frame_rate * +$("#rate").value);
      if (this.frame >= ABOUT.frames - 1) this.play(false);
      this.keepUp(past);
    }
    if (this.moved) this.place();
    if (this.stale) this.draw();
    requestAnimationFrame((next) => this.step(next));
  }

  // Simplifies pictures that take long, and says so on the page.
  keepUp(past) {
    this.slow = past > 1 / 24 ? (this.slow || 0) + 1 : 0;
    if (this.slow < 12) return;
    this.slow = 0;
    if (this.ratio > 1) this.ratio = 1;
    else if (!this.renderer.coarse) this.renderer.coarse = true;
    else if (this.renderer.shadows) this.renderer.shadows = false;
    else return;
    if (!this.simpler) {
      this.simpler = document.createElement("li");
      $("#about ul").append(this.simpler);
    }
    this.simpler.textContent = "Drawn simpler (" + (this.renderer.shadows ? this.renderer.coarse ? "coarser shapes" : "fewer pixels" : "no shadows") + ") so that it keeps up here";
    this.stale = true;
  }

  place() {
    const { trajectory, renderer, frame, colouring } = this;
    const whole = Math.floor(frame + 1e-6), counts = [];
    const fixed = colouring.key !== "body";
    renderer.painted = !fixed;
    for (let body = 0; body < trajectory.count; ++body) {
      const state = trajectory.state(body, whole), at = 32 * body + 28;
      if (!(state & STATE.present)) { renderer.bytes[at + 3] = 0; continue; }
      trajectory.pose(body, frame, renderer.floats, INSTANCE * body);
      const moves = trajectory.colour[4 * body + 3];
      const colour = fixed && !moves && !PLANES.has(trajectory.shape[body]) ? FIXED
        : fixed && !moves ? [trajectory.colour[4 * body], trajectory.colour[4 * body + 1], trajectory.colour[4 * body + 2]]
        : colouring.of(body, state, whole);
      if (moves && colouring.find) { const i = colouring.find(state); counts[i] = (counts[i] || 0) + 1; }
      renderer.bytes[at] = colour[0];
      renderer.bytes[at + 1] = colour[1];
      renderer.bytes[at + 2] = colour[2];
      renderer.bytes[at + 3] = 255;
    }
    renderer.upload();
    const legend = colouring.legend(counts);
    if (legend !== this.legendText) $("#legend").innerHTML = this.legendText = legend;
    this.showTime();
    this.showBody();
    this.moved = false;
    this.stale = true;
  }

  draw() {
    this.renderer.resize(this.ratio);
    this.renderer.draw(this.view(), this.scene, this.visibleSigns());
    this.stale = false;
    document.documentElement.dataset.drawn = Math.round(this.frame);
  }

  view() {
    if (!this.follow) {
      if (this.followBox) this.followBox.checked = false;
      return this.orbit.view();
    }
    const c = ABOUT.camera[Math.min(Math.round(this.frame), ABOUT.camera.length - 1)];
    return { eye: c.slice(0, 3), target: c.slice(3, 6), fov: c[6] };
  }

  visibleSigns() {
    const signs = [];
    for (const [name, changes] of Object.entries(this.signs)) {
      if (!this.shownSigns.has(name)) continue;
      const now = changes.filter(([from]) => from <= this.frame + 1e-6).at(-1);
      for (const sign of now?.[1] ?? []) {
        sign.follow?.(this.frame, this.renderer.floats);
        signs.push(sign);
      }
    }
    return signs;
  }

  pickAt(x, y) {
    const scale = this.canvas.width / this.canvas.clientWidth;
    this.pick(this.renderer.bodyAt(Math.floor(x * scale), Math.floor(y * scale), this.view(), this.scene));
  }

  pick(body) {
    this.picked = this.renderer.picked = body;
    $("#body").hidden = body < 0;
    this.showBody();
    this.stale = true;
  }

  showTime() {
    const at = this.frame / ABOUT.frame_rate + ABOUT.first_s;
    $("#time").value = this.frame;
    $("#clock").innerHTML = `${at.toFixed(2)} s<small>frame ${Math.round(ABOUT.first_frame + this.frame * ABOUT.every)}</small>`;
    this.drawTrack();
  }

  showBody() {
    const body = this.picked, { trajectory } = this;
    if (body < 0) return;
    const whole = Math.floor(this.frame + 1e-6), state = trajectory.state(body, whole), pose = new Float64Array(7);
    trajectory.pose(body, this.frame, pose, 0);
    const words = !(state & STATE.present) ? "not there" : !trajectory.colour[4 * body + 3] ? "fixed"
      : [state & STATE.held ? "waiting" : state & STATE.asleep ? "asleep" : "awake", state & STATE.frozen && "held by the guide"].filter(Boolean).join(", ");
    const solver = ABOUT.mode !== "mixed" || !trajectory.colour[4 * body + 3] ? null
      : !(state & STATE.impulse) ? "sphere" : state & STATE.statistical ? "near exact ones" : "exact";
    const rows = [["Shape", ABOUT.meshes[trajectory.shape[body]].name], ["Number", trajectory.id[body]],
      ["State", words], ["Speed", rounded(trajectory.speed(body, whole) * ABOUT.frame_rate) + " m/s"],
      ...["x", "y", "z"].map((axis, i) => [axis, metres(pose[i])])];
    if (solver) rows.push(["Solved", solver]);
    if (trajectory.moments.length > 0 && trajectory.colour[4 * body + 3]) {
      const share = trajectory.overlap(body, whole);
      rows.push(["Overlap", `${rounded(1000 * share * ABOUT.overlaps.diameter_m)} mm, ${percent(share)}`]);
    }
    $("#body h2").textContent = trajectory.names[body];
    const list = $("#body dl");
    list.textContent = "";
    for (const [name, value] of rows) {
      for (const [tag, text] of [["dt", name], ["dd", value]]) list.appendChild(document.createElement(tag)).textContent = text;
    }
  }

  // Plots the number of moving bodies over time, with the current position.
  drawTrack() {
    const canvas = $("#track canvas"), scale = window.devicePixelRatio || 1;
    const width = canvas.width = Math.max(1, canvas.clientWidth * scale), height = canvas.height = Math.max(1, canvas.clientHeight * scale);
    const pen = canvas.getContext("2d"), last = Math.max(1, ABOUT.frames - 1), moving = ABOUT.moving;
    canvas.style.pointerEvents = "none";
    const most = Math.max(1, ...moving), inset = 7 * scale;
    const x = (frame) => inset + (width - 2 * inset) * frame / last;
    const curve = (upTo) => {
      pen.beginPath();
      pen.moveTo(x(0), height);
      for (let i = 0; i < moving.length; ++i) {
        const frame = i * last / Math.max(1, moving.length - 1);
        if (frame > upTo) break;
        pen.lineTo(x(frame), height - 3 * scale - (height - 12 * scale) * moving[i] / most);
      }
      pen.lineTo(x(upTo), height);
      pen.fill();
    };
    pen.fillStyle = "#1b253220";
    curve(last);
    pen.fillStyle = "#c4552d66";
    curve(this.frame);
    pen.fillStyle = "#1b253230";
    pen.fillRect(inset, height - 3 * scale, width - 2 * inset, 3 * scale);
    pen.fillStyle = "#c4552d";
    pen.fillRect(inset, height - 3 * scale, x(this.frame) - inset, 3 * scale);
    pen.fillRect(x(this.frame) - scale, 0, 2 * scale, height);
    pen.beginPath();
    pen.arc(x(this.frame), 6 * scale, 6 * scale, 0, 7);
    pen.fill();
  }
}

// name -> [[first frame, signs]]
function makeSigns(trajectory) {
  const signs = {}, { overlays } = trajectory;
  if (overlays.guide) signs.guide = [[0, [{ kind: "triangles", points: new Float32Array(overlays.guide), ink: [0.25, 0.5, 0.62, 0.16] }]]];
  if (overlays.constraints) {
    signs.constraints = overlays.constraints.map(([frame, points]) => [frame, points.length
      ? [{ kind: "points", through: true, points: new Float32Array(points), ink: [0.78, 0.2, 0.16, 0.85] }] : []]);
  }
  if (overlays.glue) signs.glue = [[0, [new Glue(overlays.glue, trajectory)]]];
  if (overlays.layers) {
    signs.layers = overlays.layers.map(([frame, layers]) => [frame, layers.flatMap((layer, i) => layerSigns(layer, i))]);
  }
  return signs;
}

// Lines between the centres of two bodies and their spot of glue, while it holds.
class Glue {
  constructor(pairs, trajectory) {
    const bodies = new Map(Array.from(trajectory.id, (id, body) => [id, body]));
    Object.assign(this, { kind: "lines", through: true, moves: true, ink: [0.78, 0.16, 0.1, 0.6] });
    this.pairs = pairs.map(([a, b, x, y, z, from, until]) =>
      ({ a: bodies.get(a), b: b < 0 ? -1 : bodies.get(b), arm: [x, y, z], from, until: until ?? Infinity }))
      .filter(({ a, b }) => a !== undefined && b !== undefined);
  }

  // `instances`: the bodies' poses at `frame`.
  follow(frame, instances) {
    const points = [];
    for (const { a, b, arm, from, until } of this.pairs) {
      if (frame < from || frame >= until) continue;
      const centre = (body) => instances.subarray(INSTANCE * body, INSTANCE * body + 3);
      const turn = instances.subarray(INSTANCE * a + 3, INSTANCE * a + 7);
      const place = add(centre(a), turned(arm, turn));
      points.push(...centre(a), ...place);
      if (b >= 0) points.push(...centre(b), ...place);
    }
    this.points = new Float32Array(points);
  }
}

// A layer of a pile: [bottom, top, x, z, x, z, ...].
function layerSigns([bottom, top, ...ring], index) {
  const ink = index % 2 ? [0.91, 0.59, 0.2] : [0.22, 0.46, 0.75];
  const sides = [], rims = [];
  for (let i = 0; i < ring.length; i += 2) {
    const j = (i + 2) % ring.length;
    const a = [ring[i], bottom, ring[i + 1]], b = [ring[j], bottom, ring[j + 1]];
    const c = [a[0], top, a[2]], d = [b[0], top, b[2]];
    sides.push(...a, ...b, ...c, ...c, ...b, ...d);
    rims.push(...a, ...b, ...c, ...d);
  }
  return [{ kind: "triangles", points: new Float32Array(sides), ink: [...ink, 0.14] },
    { kind: "lines", points: new Float32Array(rims), ink: [...ink, 0.7] }];
}

(async () => {
  try {
    if (!window.DecompressionStream) throw new Error("This browser is too old: it cannot inflate data (DecompressionStream).");
    const trajectory = new Trajectory(await inflated($("#data").textContent), ABOUT);
    await trajectory.unpackPictures();
    window.page = new Page(trajectory);
  } catch (fault) {
    $("#fault").hidden = false;
    $("#fault").textContent = "This page cannot be shown. " + fault.message;
    document.documentElement.dataset.fault = fault.message;
    throw fault;
  }
})();
